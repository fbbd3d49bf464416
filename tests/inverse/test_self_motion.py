"""Self-motions: joint vectors that change while the pose does not."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from dh2sim.inverse.loop import build_arm
from dh2sim.inverse.redundancy import joints_to_lock
from dh2sim.inverse.self_motion import Path, inside, lies_on
from dh2sim.inverse.solutions import Curve, Solutions
from dh2sim.inverse.solver import inverse_kinematics
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.row import JointType, Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.sample_robots import STANDARD, in_limits, model, robot, row


def solved(spec: RobotSpec, q: Array, **options: object) -> Solutions:
    answer = inverse_kinematics(spec, table_tool_pose(spec, q), q, **options)  # type: ignore[arg-type]
    assert isinstance(answer, Solutions)
    return answer


def apart(q: Array, curve: Curve) -> float:
    """How far a configuration is from the points of a curve, angles modulo whole turns."""
    gaps = np.abs((curve.q - q + math.pi) % (2.0 * math.pi) - math.pi)
    return float(gaps.max(axis=1).min())


@cache
def whole_curves(name: str) -> Solutions:
    return solved(robot(name), in_limits(model(name), 1, seed=4)[0], limits=False)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["franka_panda", *(pytest.param(name, marks=pytest.mark.slow) for name in ("ssrms", "kuka_iiwa14"))]
)
def test_every_solution_with_a_joint_locked_lies_on_a_closed_curve(name: str) -> None:
    spec, q = robot(name), in_limits(model(name), 1, seed=4)[0]
    T, answer = table_tool_pose(spec, q), whole_curves(name)
    assert all(curve.closed for curve in answer.curves)
    for curve in answer.curves:
        assert np.abs(table_tool_pose(spec, curve.q) - T).max() <= 1e-11
        assert np.abs(np.diff(curve.q, axis=0)).max() <= 0.06
    assert apart(q, answer.curves[0]) <= 1e-9
    assert answer.q[0] == pytest.approx(q, abs=1e-9)
    # other values than those at which curves were looked for, of another joint
    for value in (-1.234, 0.4321, 2.0123):
        for other in inverse_kinematics(spec, T, lock={model(name).moving_joints[-1].name: value}, limits=False):
            assert min(apart(other, curve) for curve in answer.curves) <= 0.06


@pytest.mark.parametrize("angle", [0.3, 6.27, -0.02, 0.0])
def test_a_closed_curve_holds_the_points_between_its_last_and_its_first(angle: float) -> None:
    circle = np.linspace(0.0, 2.0 * math.pi, 150, endpoint=False)[:, None] * [1.0, 0.0, -1.0]
    turns = np.ones(3, dtype=np.bool_)
    assert lies_on(circle, angle * np.array([1.0, 0.0, -1.0]), turns, closed=True)
    assert not lies_on(circle, angle * np.array([1.0, 0.0, -1.0]) + [0.0, 0.02, 0.0], turns, closed=True)


@pytest.mark.slow
def test_no_curve_is_returned_twice() -> None:
    answer = whole_curves("franka_panda")
    for i, curve in enumerate(answer.curves):
        for other in answer.curves[:i]:
            # half way along, it is not on the other: two curves never meet at a regular pose
            assert apart(curve.q[len(curve) // 2], other) > 1e-3


@pytest.mark.slow
def test_inside_the_limits_a_curve_is_cut_where_it_leaves_them() -> None:
    spec, built = robot("franka_panda"), model("franka_panda")
    q = in_limits(built, 1, seed=4)[0]
    lower, upper = np.array([joint.position_range for joint in built.moving_joints]).T
    answer = solved(spec, q)
    assert answer.q[0] == pytest.approx(q, abs=1e-9)
    for curve in answer.curves:
        assert ((curve.q >= lower - 1e-9) & (curve.q <= upper + 1e-9)).all()


def planar(count: int, *, limit: float = math.pi) -> RobotSpec:
    limits = Limits(position=(-limit, limit))
    rows = [
        Row(name=f"j{i}", type=JointType.REVOLUTE, convention=STANDARD, a=0.5 - 0.1 * i, limits=limits)
        for i in range(count)
    ]
    return RobotSpec(name="snake", rows=tuple(rows))


def test_a_planar_arm_of_three_joints_swings_around_a_point_as_a_four_bar_does() -> None:
    # l1 = 0.5, l2 = 0.4, l3 = 0.3 and the distance 0.2: Grashof's condition holds (0.2 + 0.5 <= 0.4 + 0.3), and the
    # frame is the shortest bar, so both links beside it turn fully, in two separate curves
    spec, T = planar(3), np.eye(4)
    T[0, 3] = 0.19
    answer = inverse_kinematics(spec, T, free="rotation", limits=False)
    assert len(answer.curves) == 2
    assert all(curve.closed for curve in answer.curves)
    for curve in answer.curves:
        tip = table_tool_pose(spec, curve.q)[:, :2, 3]
        assert np.abs(tip - [0.19, 0.0]).max() <= 1e-11
        assert np.ptp(curve.q[:, 0]) > 6.1


def test_a_roll_that_the_last_joint_makes_leaves_a_curve_of_it_alone() -> None:
    spec = robot("arm_5r")
    answer = solved(spec, np.deg2rad([10, -40, 60, 30, 20]), free="roll")
    for curve in answer.curves:
        spans = np.ptp(curve.q, axis=0)
        assert spans[:4].max() <= 1e-9
        assert spans[4] > 6.0


def test_of_several_joints_to_spare_those_at_the_tool_are_held() -> None:
    spec = planar(5)
    q = np.array([0.3, 0.4, -0.6, 0.5, 0.2])
    answer = solved(spec, q)
    assert answer.notes == ("2 joints to spare: j3, j4 are held where a solution near the start has them.",)
    assert not answer.complete
    assert answer.q[0] == pytest.approx(q, abs=1e-9)
    assert len(answer) == 2  # elbow up and down


def test_a_joint_that_no_self_motion_moves_is_not_locked() -> None:
    # with its elbow locked, an arm of two spherical joints cannot hold most poses
    spec = robot("kuka_iiwa14")
    arm = build_arm(build_chain(spec), [row.limits.position for row in spec.moving_rows])
    ranges = np.array([[-math.pi, math.pi]] * 7)
    assert joints_to_lock(arm, np.ones(7, dtype=np.bool_), ranges, 1) == (6,)


def circle(count: int = 100) -> Path:
    angles = np.linspace(0.0, 2.0 * math.pi, count, endpoint=False)
    return Path(q=np.stack([angles, np.cos(angles)], axis=1), closed=True)


def test_a_curve_inside_limits_stays_whole_and_one_outside_vanishes() -> None:
    turns, near = np.array([True, False]), np.zeros(2)
    wide = np.array([-10.0, -2.0]), np.array([10.0, 2.0])
    [whole] = inside(circle(), *wide, turns, near)
    assert (len(whole.q), whole.closed) == (100, True)
    assert inside(circle(), np.array([-10.0, 1.5]), np.array([10.0, 2.0]), turns, near) == []


def test_a_part_that_crosses_the_point_where_a_curve_begins_is_one() -> None:
    turns, near = np.array([True, False]), np.zeros(2)
    [part] = inside(circle(), np.array([-1.0, -2.0]), np.array([1.0, 2.0]), turns, near)
    assert not part.closed
    assert part.q[:, 0] == pytest.approx(np.sort(part.q[:, 0]))
    assert part.q[:, 0].min() < -0.9
    assert part.q[:, 0].max() > 0.9
    [turn] = inside(circle(), np.array([-math.pi, -2.0]), np.array([math.pi, 2.0]), turns, near)
    assert np.abs(np.diff(turn.q[:, 0])).max() < 0.1


def test_a_slide_at_its_limit_ends_a_curve() -> None:
    rows = (row("x", "prismatic"), row("turn"), row("z", "prismatic"))
    spec = RobotSpec(name="twice", rows=rows)  # both slides move along one axis
    answer = inverse_kinematics(spec, np.eye(4), np.zeros(3), limits=False)
    [curve] = answer.curves
    assert not curve.closed
    assert curve.q[:, 0] == pytest.approx(-curve.q[:, 2])


@pytest.mark.slow
def test_axes_all_in_line_leave_one_closed_curve_of_two_joints() -> None:
    iiwa = robot("kuka_iiwa14")
    q = np.zeros(7)
    solutions = inverse_kinematics(iiwa, table_tool_pose(iiwa, q), q, limits=False)
    [curve] = solutions.curves
    assert curve.closed
    assert (np.ptp(curve.q, axis=0) > 1e-6).sum() == 2
    assert np.abs(table_tool_pose(iiwa, curve.q) - table_tool_pose(iiwa, q)).max() < 1e-12


@pytest.mark.slow
def test_an_arm_stretched_to_one_point_has_no_curve() -> None:
    kinova = robot("kinova_gen3")
    q = np.zeros(7)
    solutions = inverse_kinematics(kinova, table_tool_pose(kinova, q), q)
    assert solutions.curves == ()
    assert solutions.q == pytest.approx(q[None], abs=1e-6)
