"""Driven joints move mechanisms as closed forms say, up to dead positions."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from dh2sim import Robot
from dh2sim.errors import ConfigurationError, SingularPositionError
from dh2sim.kinematics.loop_motion import (
    actuated_joints,
    driven_motion,
    mechanism_configuration,
    mechanism_jacobian,
    mechanism_pose,
)
from dh2sim.robot.links import ToolSpec
from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import RobotSpec
from tests.refusals import refusal


def _rocker_angle(lengths: tuple[float, float, float, float], crank: float, side: float) -> float | None:
    """Freudenstein's equation: K1 cos(rocker) - K2 cos(crank) + K3 = cos(crank - rocker), solved for the rocker."""
    ground, a, b, c = lengths
    K1, K2, K3 = ground / a, ground / c, (a**2 - b**2 + c**2 + ground**2) / (2 * a * c)
    A = math.cos(crank) - K1 - K2 * math.cos(crank) + K3
    B = -2 * math.sin(crank)
    C = K1 - (K2 + 1) * math.cos(crank) + K3
    root = B * B - 4 * A * C
    if root < 1e-3:
        return None
    if side * B > 0:  # the other form of the same root, where this one's difference cancels
        return 2 * math.atan2(2 * C, -B - side * math.sqrt(root))
    return 2 * math.atan2(-B + side * math.sqrt(root), 2 * A)


def _four_bar(lengths: tuple[float, float, float, float], crank: float, side: float) -> RobotSpec | None:
    ground, a, b, c = lengths
    rocker = _rocker_angle(lengths, crank, side)
    if rocker is None:
        return None
    B = a * np.array([math.cos(crank), math.sin(crank)])
    C = np.array([ground, 0.0]) + c * np.array([math.cos(rocker), math.sin(rocker)])
    coupler = math.atan2(*(C - B)[::-1]) - crank
    return parse_robot(
        f"""\
name: four_bar
convention: standard
tool: {{xyz: [-0.4, 0.3, 0]}}
joints: [{{type: continuous, a: {a!r}}}, {{type: continuous, a: {b!r}}}]
branches:
  rocker: {{from: base_link, pose: {{xyz: [{ground!r}, 0, 0]}}, joints: [{{type: continuous, a: {c!r}}}]}}
closures: [{{between: [dh_2, rocker/dh_1], type: revolute}}]
actuated: [joint_1]
assembly: {{q: [{crank!r}, {coupler!r}, {rocker!r}]}}
"""
    )


length = st.floats(0.4, 2.5)


@given(
    lengths=st.tuples(length, length, length, length), side=st.sampled_from([1.0, -1.0]), move=st.floats(-2.5, 2.5)
)
def test_a_four_bars_coupler_curve_is_that_of_freudensteins_equation(
    lengths: tuple[float, float, float, float], side: float, move: float
) -> None:
    """Grashof or not: where the crank gets stuck, the closed form has no solution, or a double one, on the way."""
    crank = 1.1
    spec = _four_bar(lengths, crank, side)
    assume(spec is not None)
    assert spec is not None
    way = np.linspace(crank, crank + move, 400)
    exact = [_rocker_angle(lengths, angle, side) for angle in way]
    try:
        q = mechanism_configuration(spec, [crank + move])
    except SingularPositionError:
        ground, a, b, c = lengths
        extremes = [angle for angle in (-math.pi, 0.0, math.pi) if way.min() <= angle <= way.max()]
        reach = np.sqrt(ground**2 + a**2 - 2 * ground * a * np.cos([*way, *extremes]))
        dead = min((b + c - reach).min(), (reach - abs(b - c)).min())
        assert dead < 1e-3
        return
    assume(None not in exact)
    rocker = exact[-1]
    assert rocker is not None
    ground, a, b, c = lengths
    B = a * np.array([math.cos(crank + move), math.sin(crank + move)])
    C = np.array([ground, 0.0]) + c * np.array([math.cos(rocker), math.sin(rocker)])
    along = (C - B) / b
    point = C - 0.4 * along + 0.3 * np.array([-along[1], along[0]])
    assert np.abs(mechanism_pose(spec, q)[:2, 3] - point).max() < 1e-12


CRANK, ROD, OFFSET = 0.3, 0.9, 0.1
SLIDER = f"""\
name: slider_crank
convention: standard
joints: [{{type: continuous, a: {CRANK}}}, {{type: continuous, a: {ROD}}}]
branches:
  slider:
    from: base_link
    pose: {{xyz: [0, {OFFSET}, 0], rpy: [0, {math.pi / 2!r}, 0]}}
    joints: [{{type: prismatic, alpha: {-math.pi / 2!r}, theta: {math.pi / 2!r}}}]
closures: [{{name: pin, between: [dh_2, slider/dh_1], type: revolute}}]
actuated: [joint_1]
assembly: {{q: [0.9, -1.2, 1.0]}}
"""


@pytest.mark.slow
def test_a_slider_crank_moves_as_its_closed_form() -> None:
    spec = parse_robot(SLIDER)
    for angle in np.linspace(-7, 7, 15):
        q = mechanism_configuration(spec, [angle])
        exact = CRANK * math.cos(angle) + math.sqrt(ROD**2 - (CRANK * math.sin(angle) - OFFSET) ** 2)
        assert abs(mechanism_pose(spec, q, "slider/dh_1")[0, 3] - exact) < 1e-12
        assert abs(q[2] - exact) < 1e-12


def test_a_dead_position_is_named_where_it_is() -> None:
    spec = _four_bar((3.0, 1.0, 1.8, 1.4), 1.1, -1.0)
    assert spec is not None
    message = refusal(SingularPositionError, mechanism_configuration, spec, [2.5])
    angle = float(message.split("joint_1 = ")[1].split(" deg")[0])
    assert angle == pytest.approx(math.degrees(math.acos((3**2 + 1 - 3.2**2) / (2 * 3))), abs=1e-3)


def test_a_flat_parallelogram_is_not_passed() -> None:
    spec = _four_bar((2.0, 1.0, 2.0, 1.0), 1.1, -1.0)
    assert spec is not None
    rocker = mechanism_configuration(spec, [3.1])[2]
    assert math.remainder(rocker - 3.1, math.tau) == pytest.approx(0, abs=1e-9)
    message = refusal(SingularPositionError, mechanism_configuration, spec, [3.4])
    assert float(message.split("joint_1 = ")[1].split(" deg")[0]) == pytest.approx(180, abs=0.05)


def test_a_robot_takes_driven_or_all_coordinates() -> None:
    robot = Robot.load("four_bar")
    q = mechanism_configuration(robot, [2.0])
    assert np.array_equal(robot.fk([2.0]), robot.fk(q))
    assert np.array_equal(robot.fk("home", "dh_0"), np.eye(4))
    assert "expected 1 coordinates of driven joints" in refusal(ConfigurationError, robot.fk, [1.0, 2.0])


def test_driven_joints_that_do_not_determine_the_others_are_refused() -> None:
    loose = SLIDER.replace("actuated: [joint_1]", "actuated: []")
    assert "none driven, 1 freedom at the assembly: 1 of them stays open" in refusal(
        SingularPositionError, mechanism_configuration, parse_robot(loose), []
    )
    tight = SLIDER.replace("actuated: [joint_1]", "actuated: [joint_1, joint_2]")
    message = refusal(SingularPositionError, mechanism_configuration, parse_robot(tight), [1.0, 2.0])
    assert "cannot be moved independently" in message


@pytest.mark.parametrize("name", ["slider_crank", "bennett", "delta", "stewart"])
def test_the_jacobian_is_the_change_of_the_pose_with_the_driven_joints(name: str) -> None:
    robot = Robot.load(name)
    tree, q0 = robot.mechanism.tree, robot.mechanism.q
    driven = sorted(actuated_joints(robot))
    start, h = np.array([q0[k] for k in driven]) + 0.05, 1e-5
    J = mechanism_jacobian(robot, driven_motion(robot, q0, start), "tool0")
    assert J.shape == (6, len(driven))
    for k in range(len(driven)):
        step = h * np.eye(len(driven))[k]
        (T1, T2) = (mechanism_pose(robot, driven_motion(robot, q0, start + side * step)) for side in (-1, 1))
        W = (T2[:3, :3] - T1[:3, :3]) / (2 * h) @ (0.5 * (T1 + T2)[:3, :3]).T
        rate = [*(T2 - T1)[:3, 3] / (2 * h), W[2, 1], W[0, 2], W[1, 0]]
        assert J[:, k] == pytest.approx(rate, abs=1e-7 * max(1.0, np.abs(J).max()))
    assert tree.n > len(driven)


def test_the_jacobian_of_a_crank_is_that_of_the_textbook() -> None:
    crank, rod, angle = 0.5, 1.5, 0.7
    J = Robot.load("slider_crank").jacobian([angle], "slide/dh_1")
    lengths = Robot.load("slider_crank").spec
    assert lengths.rows[0].a == pytest.approx(crank)
    assert lengths.rows[1].a == pytest.approx(rod)
    slope = crank * math.sin(angle) / math.sqrt(rod**2 - (crank * math.sin(angle)) ** 2)
    x_rate = -crank * math.sin(angle) - crank * math.cos(angle) * slope
    assert J[:3, 0] == pytest.approx([x_rate, 0, 0], abs=1e-10)


RSSR = """name: rssr
convention: standard
units: {angle: deg}
parameters: {crank: 0.3, rod: 1.2, rocker: 0.8}
joints:
  - {type: revolute, a: crank}
  - {type: revolute, alpha: 90}                      # a ball joint
  - {type: revolute, theta: 90, alpha: 90}
  - {type: revolute, theta: 90, a: rod}
branches:
  rocker: {from: base_link, pose: {xyz: [1, 0.3, 0.2], rpy: [90, 0, 0]}, joints: [{type: revolute, a: rocker}]}
closures: [{name: S, between: [dh_4, rocker/dh_1], type: spherical}]
actuated: [joint_1]
assembly: {q: [60, 0, 0, 0, 80]}
"""


def test_a_rod_that_spins_between_two_ball_joints_hinders_nothing() -> None:
    spec = parse_robot(RSSR)
    for crank in (0.2, 1.0, 2.5):
        q = mechanism_configuration(spec, [crank])
        near = mechanism_pose(spec, q, "dh_1")[:3, 3]
        far = mechanism_pose(spec, q, "rocker/dh_1")[:3, 3]
        assert math.dist(near, (0.3 * math.cos(crank), 0.3 * math.sin(crank), 0.0)) < 1e-12
        assert math.dist(near, far) == pytest.approx(1.2, abs=1e-11)
        assert math.dist(far, (1.0, 0.3, 0.2)) == pytest.approx(0.8, abs=1e-12)
        step = 1e-6
        moved = [mechanism_pose(spec, [crank + sign * step], "rocker/dh_1")[:3, 3] for sign in (1, -1)]
        velocity = mechanism_jacobian(spec, [crank], "rocker/dh_1")[:3, 0]
        assert np.allclose(velocity, (moved[0] - moved[1]) / (2 * step), rtol=0, atol=1e-8)


def test_a_joint_that_hangs_loose_is_no_idle_spin() -> None:
    text = RSSR.replace("closures:", "  flag: {from: dh_1, joints: [{type: revolute, a: 0.1}]}\nclosures:")
    spec = parse_robot(text.replace("0, 80]", "0, 80, 0]"))
    with pytest.raises(SingularPositionError, match="stay open, so that the passive joints are not determined"):
        mechanism_configuration(spec, [1.0])


def test_loops_that_nothing_drives_do_not_pass_for_idle_spins() -> None:
    """Their closures, and tool0, are at rest in the ground."""
    for name in ("bennett", "spherical_four_bar"):
        loose = dataclasses.replace(Robot.load(name).spec, actuated=(), tool=ToolSpec())
        with pytest.raises(SingularPositionError, match="none driven, 1 freedom"):
            mechanism_configuration(loose, [])
