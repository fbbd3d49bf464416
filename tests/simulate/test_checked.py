"""What controllers may return."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dh2sim.errors import ControllerError
from dh2sim.simulate import rollout
from tests.program import contents
from tests.simulate import robots

DRIVERS = "tests.simulate.drivers"


@pytest.mark.parametrize(
    ("driver", "words"),
    [
        ("Nothing", "None for controls"),
        ("Flat", "controls of shape (2,), expected (2, 2): rollouts, actuators"),
        ("Words", "controls that are not an array of numbers: their type is <U5"),
        ("Complex", "controls that are not an array of numbers: their type is complex128"),
        (
            "Narrow",
            "controls of shape (2, 1, 1), expected (2, 1, 2): rollouts, time steps or 1, actuators",
        ),
        (
            "Single",
            "reference positions of shape (2, 2), expected (2, 2, 2): rollouts, time steps, joints",
        ),
    ],
)
def test_what_is_no_control_is_an_error_that_says_what_is(driver: str, words: str) -> None:
    with pytest.raises(ControllerError) as caught:
        rollout(robots.arm(), rollouts=3, steps=7, controller=f"{DRIVERS}:{driver}")
    assert str(caught.value) == f"controller '{DRIVERS}:{driver}' returned {words}"


@pytest.mark.parametrize(
    ("driver", "words"),
    [
        ("Late", "controls of shape (2,), expected (3, 2): rollouts, actuators"),
        (
            "LateOpen",
            "controls of shape (3, 0, 2), expected (3, 7, 2) or (3, 1, 2): rollouts, time steps or 1, actuators",
        ),
    ],
)
def test_the_same_holds_later_in_a_run(driver: str, words: str) -> None:
    with pytest.raises(ControllerError) as caught:
        rollout(robots.arm(), rollouts=3, steps=7, controller=f"{DRIVERS}:{driver}")
    assert str(caught.value) == f"controller '{DRIVERS}:{driver}' returned {words}"


@pytest.mark.parametrize("driver", ["Flat", "Narrow", "Half", "Nothing"])
def test_a_controller_that_fails_at_once_does_so_before_a_run_is_replaced(driver: str, tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    rollout(robots.arm(), rollouts=3, steps=7, out=path)
    before = contents(path)
    with pytest.raises(ControllerError):
        rollout(robots.arm(), rollouts=3, steps=7, controller=f"{DRIVERS}:{driver}", out=path, overwrite=True)
    assert contents(path) == before
    with pytest.raises(ControllerError):
        rollout(robots.arm(), rollouts=3, steps=7, controller=f"{DRIVERS}:{driver}", out=tmp_path / "other.zarr")
    assert not (tmp_path / "other.zarr").exists()


def test_rows_of_different_lengths_are_no_array() -> None:
    with pytest.raises(ControllerError) as caught:
        rollout(robots.arm(), rollouts=3, steps=7, controller=f"{DRIVERS}:Ragged")
    reported = str(caught.value)
    assert reported.startswith(f"controller '{DRIVERS}:Ragged' returned controls that are not an array of numbers: ")
    assert "\n" not in reported


def test_a_reference_without_velocities_is_an_error() -> None:
    with pytest.raises(ControllerError) as caught:
        rollout(robots.arm(), rollouts=3, steps=7, controller=f"{DRIVERS}:Half")
    assert (
        str(caught.value) == f"controller '{DRIVERS}:Half': its reference must be a pair of positions and velocities"
    )


def test_a_reference_that_is_not_recorded_is_not_asked_for() -> None:
    rollout(robots.arm(), rollouts=3, steps=7, controller=f"{DRIVERS}:Half", record="qpos")


def test_lists_are_controls() -> None:
    run = rollout(robots.arm(), rollouts=3, steps=7, controller=f"{DRIVERS}:Lists")
    assert np.array_equal(run.ctrl.values, -run.qvel.values[:, :-1])


def test_controls_may_be_said_once_or_in_single_precision() -> None:
    runs = [
        rollout(
            robots.arm(), rollouts=3, steps=7, controller=f"{DRIVERS}:{driver}", record="qpos,ctrl", start="random"
        )
        for driver in ("Still", "Single")
    ]
    assert np.array_equal(runs[0].qpos.values, runs[1].qpos.values)
    assert np.array_equal(runs[0].ctrl.values, runs[1].ctrl.values)
    assert np.array_equal(runs[0].ctrl.values[:, 3], runs[0].qpos.values[:, 0].astype(np.float32))
