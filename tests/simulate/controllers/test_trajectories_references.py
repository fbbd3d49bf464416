from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dh2sim.errors import ControllerError
from dh2sim.robot.spec import RobotSpec
from dh2sim.simulate import rollout
from dh2sim.simulate.controllers.trajectories import SmoothReference
from dh2sim.typing import Array
from tests.simulate.controllers.samples import arm, make, started
from tests.simulate.robots import worm
from tests.strategies import robot_specs

STEPS = 1300


def quintic(start: Array, end: Array, s: Array) -> Array:
    """From rest to rest, as printed by Flash and Hogan."""
    return start + (start - end) * (15.0 * s**4 - 6.0 * s**5 - 10.0 * s**3)


@settings(max_examples=min(25, settings().max_examples))
@given(
    spec=robot_specs(max_rows=4), period=st.floats(0.05, 3.0), amplitude=st.floats(0.0, 1.0), seed=st.integers(0, 99)
)
def test_references_stay_inside_all_limits(spec: RobotSpec, period: float, amplitude: float, seed: int) -> None:
    group = started(spec, range(3), steps=400, seed=seed)
    motion = SmoothReference(group, period=period, amplitude=amplitude).motion(0, 401)
    plant = group.plant
    assert (motion.q >= plant.lower).all()
    assert (motion.q <= plant.upper).all()
    assert (np.abs(motion.v) < plant.velocity).all()
    assert np.isfinite(motion.a).all()
    # no jump between time steps
    assert (np.abs(np.diff(motion.q, axis=1)) <= plant.velocity * plant.timestep * (1.0 + 1e-9) + 1e-12).all()


def test_a_reference_begins_at_rest_where_the_rollout_starts() -> None:
    group = started(arm())
    motion = SmoothReference(group, period=0.5, amplitude=0.5).motion(0, 1)
    assert np.array_equal(motion.q[:, 0], group.q0)
    assert not motion.v.any()
    assert not motion.a.any()


def test_a_reference_is_a_quintic_from_waypoint_to_waypoint() -> None:
    group = started(arm(), steps=STEPS)
    motion = SmoothReference(group, period=0.5, amplitude=0.5).motion(0, STEPS + 1)
    for first in range(0, STEPS - 249, 250):
        s = (np.arange(251) / 250)[:, None]
        piece = motion.q[:, first : first + 251]
        np.testing.assert_allclose(piece, quintic(piece[:, :1], piece[:, -1:], s), rtol=0, atol=1e-12)


def test_velocities_and_accelerations_are_the_derivatives() -> None:
    step = 1e-4
    group = started(arm(), steps=5000, timestep=step)
    motion = SmoothReference(group, period=0.5, amplitude=0.5).motion(0, 5000)
    np.testing.assert_allclose(np.gradient(motion.q, step, axis=1)[:, 1:-1], motion.v[:, 1:-1], rtol=0, atol=1e-5)
    np.testing.assert_allclose(np.gradient(motion.v, step, axis=1)[:, 1:-1], motion.a[:, 1:-1], rtol=0, atol=0.05)


def test_a_waypoint_out_of_reach_is_approached_as_fast_as_is_allowed() -> None:
    group = started(arm(), range(40), steps=STEPS)
    motion = SmoothReference(group, period=0.1, amplitude=1.0).motion(0, STEPS)
    fastest = np.abs(motion.v).max(axis=(0, 1))
    np.testing.assert_allclose(fastest, group.plant.velocity, rtol=1e-6)
    assert (fastest < group.plant.velocity).all()


def test_an_amplitude_of_zero_stays_at_the_start() -> None:
    group = started(arm(), steps=STEPS)
    motion = SmoothReference(group, period=0.5, amplitude=0.0).motion(0, STEPS)
    np.testing.assert_allclose(motion.q, np.broadcast_to(group.q0[:, None], motion.q.shape), rtol=0, atol=1e-12)


def test_waypoints_fill_the_share_of_the_range_that_is_asked_for() -> None:
    group = started(arm(), range(200), steps=400, timestep=0.1, q0=np.array([0.75, 0.05, 0.4]))
    motion = SmoothReference(group, period=10.0, amplitude=0.5).motion(0, 401)
    reached = np.abs(motion.q[:, 100::100] - group.q0[:, None]).max(axis=(0, 1))
    np.testing.assert_allclose(reached, [0.5 * 1.75, 0.5 * 0.25, 0.5 * np.pi], rtol=0.02)
    assert (reached <= [0.5 * 1.75, 0.5 * 0.25, 0.5 * np.pi]).all()


def test_one_time_step_at_a_time_gives_the_same_bits() -> None:
    group = started(arm(), steps=STEPS)
    reference = SmoothReference(group, period=0.5, amplitude=0.5)
    motion = reference.motion(0, 300)
    for step in (*range(140), 5, 299):
        q, v, a = reference.at(step)
        assert np.array_equal(q, motion.q[:, step])
        assert np.array_equal(v, motion.v[:, step])
        assert np.array_equal(a, motion.a[:, step])


@pytest.mark.parametrize("name", ["pd", "computed-torque"])
def test_a_motion_that_time_steps_cannot_show_is_refused(name: str) -> None:
    message = f"controller '{name}': option 'period' must be at least 10 time steps, 0.02 s, got 0.01 s"
    with pytest.raises(ControllerError, match=f"^{re.escape(message)}$"):
        make(f"{name}:period=0.01", arm())


def test_links_do_not_touch_along_a_reference(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    how: dict[str, Any] = {"rollouts": 12, "steps": 60, "timestep": 0.02, "start": "random", "seed": 5}
    run = rollout(worm(), controller="computed-torque:amplitude=1,period=0.4", record="reference", out=path, **how)
    model = mujoco.MjModel.from_xml_string(run.attrs["mjcf"])
    data = mujoco.MjData(model)
    travelled = 0.0
    for reference in run.qpos_ref.values:
        travelled += float(np.abs(np.diff(reference, axis=0)).sum())
        for q in reference:
            data.qpos[:] = q
            mujoco.mj_kinematics(model, data)
            mujoco.mj_collision(model, data)
            assert data.ncon == 0
    assert travelled > 12.0
