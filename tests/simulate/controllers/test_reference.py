"""Trajectory files in rollouts: followed from where they begin, by setpoints or by torques."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dh2sim import plan_trajectory
from dh2sim.errors import SettingsError
from dh2sim.simulate import rollout
from tests.sample_robots import model


@pytest.fixture(scope="module", params=["csv", "npz"])
def motion(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A motion of the Puma that does not begin at home."""
    file = tmp_path_factory.mktemp("motion") / f"motion.{request.param}"
    plan_trajectory(model("puma560"), ["zero", "home"], duration=1.0).save(file, rate=200.0)
    return file


def test_torques_follow_a_file_from_where_it_begins(motion: Path) -> None:
    planned = plan_trajectory(model("puma560"), ["zero", "home"], duration=1.0)
    run = rollout("puma560", rollouts=2, steps=600, controller=f"computed-torque:reference={motion}")
    assert run.attrs["settings"]["start"] == "reference"
    time = run["time"].values
    q, v, *_ = planned.at(time)
    # between the samples, every 5 ms, the curve through them is the motion
    np.testing.assert_allclose(run["qpos_ref"].values[0], q, atol=1e-6)
    np.testing.assert_allclose(run["qvel_ref"].values[1], v, atol=1e-3)
    assert np.abs(run["qpos"].values - q).max() < 2e-3
    assert (run["qpos_ref"].values[0, 500:] == run["qpos_ref"].values[0, -1]).all()  # at rest where it ends


def test_setpoints_follow_a_file_that_is_named_alone(motion: Path) -> None:
    run = rollout("puma560", rollouts=1, steps=100, controller=f"replay:{motion}")
    assert run.attrs["controller"] == f"replay:file={motion}"
    assert run["qpos"].values[0, 0].tolist() == [0.0] * 6
    assert np.abs(run["qpos"].values - run["qpos_ref"].values).max() < 0.1


def test_a_start_that_is_given_wins(motion: Path) -> None:
    run = rollout("puma560", rollouts=1, steps=5, controller=f"replay:{motion}", start="home")
    assert run["qpos"].values[0, 0].tolist() == model("puma560").home.tolist()


@pytest.mark.parametrize(
    ("controller", "start", "said"),
    [
        ("sine", "reference", "start must not be 'reference': the controller follows no file that begins somewhere"),
        ("computed-torque:reference=none.csv", "auto", "cannot read 'none.csv': No such file or directory"),
        ("computed-torque:reference=x.csv,period=2", "auto", "'period' and 'amplitude' are of random references"),
        ("replay:", "auto", "option 'file' is missing"),
    ],
)
def test_what_cannot_be_followed_is_refused(controller: str, start: str, said: str) -> None:
    with pytest.raises(SettingsError) as refused:
        rollout("puma560", rollouts=1, steps=5, controller=controller, start=start)
    assert said in str(refused.value)


def test_a_file_of_another_robot_is_refused(motion: Path) -> None:
    with pytest.raises(Exception, match=r"its joints are joint_1, .*; the robot has shoulder_pan"):
        rollout("ur5e", rollouts=1, steps=5, controller=f"computed-torque:reference={motion}")
