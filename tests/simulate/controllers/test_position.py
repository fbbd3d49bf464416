from __future__ import annotations

import re

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dh2sim.errors import ControllerError
from dh2sim.robot.row import ActuatorType
from dh2sim.robot.spec import RobotSpec
from dh2sim.simulate.controllers.position import Hold, RandomSpline, Sine
from dh2sim.simulate.controllers.protocol import OpenLoop
from tests.simulate.controllers.samples import arm, driven, make, started
from tests.strategies import robot_specs

POSITION, MOTOR, VELOCITY, NONE = ActuatorType.POSITION, ActuatorType.MOTOR, ActuatorType.VELOCITY, ActuatorType.NONE
specs = robot_specs(max_rows=4)


def test_passive_has_no_controls() -> None:
    controller, _ = make("passive", arm())
    assert isinstance(controller, OpenLoop)
    assert controller.controls(3, 9).shape == (7, 1, 0)


def test_hold_keeps_a_simulated_arm_still() -> None:
    group = started(driven(arm(), POSITION), range(1), q0=np.array([0.4, 0.1, 0.3]))
    data = mujoco.MjData(group.plant.model)
    data.qpos[:] = group.q0[0]
    for _ in range(300):
        data.ctrl[:] = Hold(group).controls(0, 1)[0, 0]
        mujoco.mj_step(group.plant.model, data)
    np.testing.assert_allclose(data.qpos, group.q0[0], rtol=0, atol=1e-9)


def test_hold_asks_for_nothing_outside_of_the_range() -> None:
    group = started(driven(arm(), POSITION), range(1), q0=np.array([-1.0, 0.3, 0.0]))
    controls = Hold(group).controls(0, 1)[0, 0]
    wanted = group.q0[0] + group.gravity0[0] / group.plant.model.actuator_gainprm[:, 0]
    assert (wanted > group.plant.control_upper).any() or (wanted < group.plant.control_lower).any()
    np.testing.assert_array_equal(controls, np.clip(wanted, group.plant.control_lower, group.plant.control_upper))


@settings(max_examples=min(25, settings().max_examples))
@given(
    spec=specs,
    seed=st.integers(0, 99),
    harmonics=st.integers(1, 8),
    frequency=st.floats(0.01, 5.0),
    amplitude=st.floats(0.0, 1.0),
    fade=st.floats(0.01, 2.0),
)
def test_sines_stay_inside_all_limits(
    spec: RobotSpec, seed: int, harmonics: int, frequency: float, amplitude: float, fade: float
) -> None:
    group = started(driven(spec, POSITION), range(3), steps=400, timestep=0.01, seed=seed)
    plant = group.plant
    sine = Sine(group, harmonics=harmonics, frequency=frequency, amplitude=amplitude, fade=fade)
    controls = sine.controls(0, 400)
    assert (controls >= plant.lower).all()
    assert (controls <= plant.upper).all()
    q, v = sine.reference(0, 400)
    assert np.array_equal(q, controls)
    assert (np.abs(v) <= plant.velocity * (1.0 + 1e-12)).all()
    assert (np.abs(np.diff(q, axis=1)) <= plant.velocity * plant.timestep * (1.0 + 1e-9) + 1e-12).all()


def test_sines_begin_at_rest_where_the_rollout_starts() -> None:
    group = started(driven(arm(), POSITION))
    q, v = Sine(group).reference(0, 1)
    assert np.array_equal(q[:, 0], group.q0)
    assert not v.any()


def test_rates_of_sines_are_the_derivatives() -> None:
    step = 1e-4
    group = started(driven(arm(), POSITION), steps=4000, timestep=step)
    q, v = Sine(group, fade=0.2, frequency=1.0).reference(0, 4000)
    np.testing.assert_allclose(np.gradient(q, step, axis=1)[:, 1:-1], v[:, 1:-1], rtol=0, atol=2e-5)


def test_sines_have_the_frequencies_that_are_asked_for_and_no_others() -> None:
    group = started(driven(arm(), POSITION), steps=2500)
    q = Sine(group, harmonics=3, frequency=0.5, fade=0.5).controls(500, 2000)  # 4 s, two periods
    spectrum = np.abs(np.fft.rfft(q - q.mean(axis=1, keepdims=True), axis=1)) / 2000
    lines = spectrum[:, [2, 4, 6]]
    assert (lines > 1e-6).all()
    spectrum[:, [2, 4, 6]] = 0.0
    assert spectrum.max() < 1e-13


def test_amplitudes_of_sines_add_up_to_the_share_that_is_asked_for() -> None:
    group = started(driven(arm(), POSITION), steps=20000, timestep=0.01, q0=np.array([0.75, 0.05, 0.0]))
    q = Sine(group, harmonics=4, frequency=0.01, amplitude=0.3, fade=20.0).controls(10000, 10000)  # one period
    lines = 2.0 * np.abs(np.fft.rfft(q, axis=1))[:, 1:5] / 10000
    expected = np.broadcast_to([0.3 * 1.75, 0.3 * 0.25, 0.3 * np.pi], (7, 3))
    np.testing.assert_allclose(lines.sum(axis=1), expected, rtol=1e-8)


def test_a_frequency_that_time_steps_cannot_show_is_refused() -> None:
    message = (
        "controller 'sine': the highest frequency, harmonics x frequency, must be at most half the rate of the "
        "time steps, 250 Hz, got 300 Hz"
    )
    with pytest.raises(ControllerError, match=f"^{re.escape(message)}$"):
        make("sine:frequency=60", arm())


@settings(max_examples=min(25, settings().max_examples))
@given(
    spec=specs, kind=st.sampled_from([POSITION, MOTOR, VELOCITY]), rate=st.floats(0.2, 40.0), seed=st.integers(0, 99)
)
def test_noise_stays_inside_the_ranges_and_is_smooth(
    spec: RobotSpec, kind: ActuatorType, rate: float, seed: int
) -> None:
    group = started(driven(spec, kind), range(3), steps=400, seed=seed)
    plant = group.plant
    controls = RandomSpline(group, rate=rate, amplitude=1.0).controls(0, 400)
    assert (controls >= plant.control_lower).all()
    assert (controls <= plant.control_upper).all()
    start = group.q0 if kind is POSITION else np.zeros_like(group.q0)
    np.testing.assert_allclose(controls[:, 0], start, rtol=0, atol=1e-12 * (1.0 + np.abs(start).max()))
    reach = np.where(np.isfinite(plant.control_upper), plant.control_upper - plant.control_lower, 2.0 * np.pi) / 2.0
    # a uniform cubic B-spline's second derivative is at most that of its points, 4 reaches over the interval squared
    bend = np.abs(np.diff(controls, 2, axis=1)).max(axis=(0, 1), initial=0.0)
    assert (bend <= 4.0 * reach * (rate * plant.timestep) ** 2 + 1e-9 * (1.0 + reach)).all()
    if kind is POSITION:
        speed = np.abs(np.diff(controls, axis=1)) / plant.timestep
        assert (speed <= plant.velocity * (1.0 + 1e-9) + 1e-12 / plant.timestep).all()


def test_noise_uses_the_range_that_is_asked_for() -> None:
    group = started(arm((POSITION, MOTOR, VELOCITY)), range(50), steps=4000, q0=np.array([0.75, 0.05, 0.0]))
    controls = RandomSpline(group, rate=5.0, amplitude=0.2).controls(0, 4000)
    reached = np.abs(controls - [0.75, 0.0, 0.0]).max(axis=(0, 1))
    bound = np.array([0.2 * 1.75, 0.2 * 90.0, 0.2 * 2.0])
    assert (reached <= bound).all()
    assert (reached >= 0.8 * bound).all()


def test_noise_drives_the_joints_that_have_actuators() -> None:
    group = started(arm((NONE, POSITION, NONE)))
    controls = RandomSpline(group).controls(0, 1)
    np.testing.assert_allclose(controls[:, 0], group.q0[:, [1]], rtol=0, atol=1e-15)


def test_noise_for_a_robot_without_actuators_is_nothing() -> None:
    assert RandomSpline(started(arm(NONE))).controls(0, 300).shape == (7, 300, 0)


def test_noise_of_more_points_than_time_steps_is_refused() -> None:
    message = "controller 'random': option 'rate' must be at most that of the time steps, 500 Hz, got 501 Hz"
    with pytest.raises(ControllerError, match=f"^{re.escape(message)}$"):
        make("random:rate=501", arm())
