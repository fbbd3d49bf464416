"""Areas, volumes and reaches against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dh2sim import Continuous, Prismatic, Revolute, Robot
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.workspace.workspace import Workspace

SIZE = 0.08
QUICK = {"samples": 4000, "size": SIZE, "threads": 1}


def workspace(robot: Robot, **options: object) -> Workspace:
    given_: dict[str, object] = {**QUICK, **options}
    return robot.workspace(**given_)  # type: ignore[arg-type]


def planar_2r(l1: float, l2: float, first: tuple[float, float], second: tuple[float, float]) -> Robot:
    return Robot([Revolute(a=l1, limits=first), Revolute(a=l2, limits=second)])


def perimeter(found: Workspace) -> float:
    assert found.section is not None
    curves = [curve.points for curve in found.section.curves]
    return sum(float(np.hypot(*(np.roll(p, -1, axis=0) - p).T).sum()) for p in curves)


def test_a_planar_2r_arm_that_turns_all_around_reaches_an_annulus() -> None:
    found = workspace(Robot([Continuous(a=1.0), Continuous(a=0.7)]), section=True)
    assert found.section is not None
    exact = math.pi * (1.7**2 - 0.3**2)
    assert found.area == pytest.approx(exact, rel=1e-3)
    assert [round(curve.area, 1) for curve in found.section.curves] == [
        round(math.pi * 1.7**2, 1),
        -round(math.pi * 0.3**2, 1),
    ]
    radii = [np.hypot(*curve.points.T) for curve in found.section.curves]
    assert np.abs(radii[0] - 1.7).max() < 1e-6
    assert np.abs(radii[1] - 0.3).max() < 1e-6
    assert (found.dimension, len(found.axes), found.volume) == (2, 2, None)


@pytest.mark.slow
@settings(max_examples=min(8, settings().max_examples), deadline=None)
@given(
    l1=st.floats(0.3, 1.0),
    l2=st.floats(0.2, 1.0),
    first=st.tuples(st.floats(-2.5, -0.2), st.floats(0.2, 2.5)),
    second=st.tuples(st.floats(0.3, 1.0), st.floats(1.4, 2.8)),
)
def test_a_2r_arm_with_its_elbow_on_one_side_reaches_a_segment_of_a_ring(
    l1: float, l2: float, first: tuple[float, float], second: tuple[float, float]
) -> None:
    # each point is reached once, so the area is the integral of |det J| = l1 l2 |sin q2|, while no two overlap
    robot = planar_2r(l1, l2, first, second)
    angle = [math.atan2(l2 * math.sin(q), l1 + l2 * math.cos(q)) for q in second]
    if first[1] - first[0] + abs(angle[1] - angle[0]) > 2.0 * math.pi:
        return
    found = workspace(robot, section=True)
    exact = (first[1] - first[0]) * l1 * l2 * (math.cos(second[0]) - math.cos(second[1]))
    assert found.section is not None
    assert found.area == pytest.approx(exact, abs=0.1 * perimeter(found) * found.section.size + 1e-6)


@pytest.mark.slow
@settings(max_examples=min(8, settings().max_examples), deadline=None)
@given(low=st.floats(0.1, 0.5), stroke=st.floats(0.2, 0.8), turn=st.floats(0.5, 5.5))
def test_an_rp_arm_reaches_a_segment_of_a_ring(low: float, stroke: float, turn: float) -> None:
    robot = Robot([Revolute(alpha=math.pi / 2, limits=(-0.5, turn - 0.5)), Prismatic(limits=(low, low + stroke))])
    found = workspace(robot, section=True)
    exact = 0.5 * turn * ((low + stroke) ** 2 - low**2)
    assert found.section is not None
    assert found.area == pytest.approx(exact, abs=0.1 * perimeter(found) * found.section.size)


@pytest.mark.parametrize("turn", [math.tau, 4.0])
def test_a_cylindrical_arm_reaches_a_cylindrical_shell(turn: float) -> None:
    rows = [
        Revolute(limits=(0.0, turn)),
        Prismatic(alpha=-math.pi / 2, limits=(0.1, 0.7)),
        Prismatic(limits=(0.2, 0.5)),
    ]
    found = workspace(Robot(rows, base=(0.3, 0.2, 0.1)), section=True)
    assert found.section is not None
    assert found.section.area == pytest.approx(0.6 * 0.3, rel=1e-6)
    assert found.section.full_turn_volume == pytest.approx(math.pi * (0.5**2 - 0.2**2) * 0.6, rel=1e-6)
    assert found.volume == pytest.approx(0.5 * turn * (0.5**2 - 0.2**2) * 0.6, rel=1e-3)
    assert found.extremes["outermost"].value == pytest.approx(0.5, abs=1e-12)
    assert found.extremes["innermost"].value == pytest.approx(0.2, abs=1e-12)


@pytest.mark.slow
def test_a_spherical_arm_reaches_a_spherical_shell_whatever_way_it_stands() -> None:
    rows = [
        Continuous(alpha=math.pi / 2),
        Revolute(alpha=math.pi / 2, limits=(-math.pi, math.pi)),
        Prismatic(limits=(0.4, 0.9)),
    ]
    lying = np.eye(4)
    lying[:3, :3] = [[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, 0.8, -0.6]]
    for base in (np.eye(4), lying):
        found = workspace(Robot(rows, base=base), section=True)
        assert found.section is not None
        assert found.section.area == pytest.approx(0.5 * math.pi * (0.9**2 - 0.4**2), rel=2e-3)
        assert found.volume == pytest.approx(4.0 / 3.0 * math.pi * (0.9**3 - 0.4**3), rel=2e-3)
        assert found.extremes["farthest"].value == pytest.approx(0.9, abs=1e-9)
        assert found.extremes["nearest"].value == pytest.approx(0.4, abs=1e-9)


def test_a_scara_reaches_ring_segments_times_its_stroke() -> None:
    found = workspace(Robot.load("scara"), section=True, size=0.02)
    elbow, base = math.radians(88), math.radians(100)
    spec = Robot.load("scara").spec
    a1, a2 = spec.rows[0].a, spec.rows[1].a
    inner = math.sqrt(a1 * a1 + a2 * a2 + 2.0 * a1 * a2 * math.cos(elbow))
    assert found.section is not None
    assert found.section.area == pytest.approx((a1 + a2 - inner) * 0.21, rel=1e-5)
    # both elbows: at distance r the angle is ±phi(r), and joint 1 covers its whole range around each
    r = np.linspace(inner, a1 + a2, 20001)
    phi = np.arccos(np.clip((r * r + a1 * a1 - a2 * a2) / (2.0 * a1 * r), -1.0, 1.0))
    exact = float(np.trapezoid(r * np.minimum(base + 2.0 * phi, 2.0 * base), r)) * 0.21
    assert found.volume == pytest.approx(exact, rel=0.05)


def test_what_attains_an_extreme_is_inside_the_limits_and_there() -> None:
    robot = Robot.load("puma560")
    found = workspace(robot)
    lower, upper = robot.limits
    for extreme in found.extremes.values():
        assert (extreme.q >= lower).all()
        assert (extreme.q <= upper).all()
        tool = table_tool_pose(robot.spec, extreme.q)
        np.testing.assert_allclose(tool[:3, 3], extreme.point, atol=1e-12)
    d3, a2, forearm = 0.15005, 0.4318, math.hypot(0.0203, 0.4318)
    assert found.extremes["farthest"].value == pytest.approx(math.hypot(d3, a2 + forearm), abs=1e-9)
    assert found.extremes["innermost"].value == pytest.approx(d3, abs=1e-9)
    assert found.extremes["highest"].value == pytest.approx(a2 + forearm, abs=1e-9)


def test_pumas_manipulability_has_the_factors_of_its_determinant() -> None:
    # |det J| = a2 · |a2 c2 + a3 c23 - d4 s23| · |a3 s3 + d4 c3| · |s5|, in Craig's table; the wrist here at its home
    found = workspace(Robot.load("puma560"))
    a2, a3, d4 = 0.4318, 0.0203, 0.4318
    _, q2, q3, _, q5, _ = found.q.T
    reach = a2 * np.cos(q2) + a3 * np.cos(q2 + q3) - d4 * np.sin(q2 + q3)
    exact = np.abs(a2 * reach * (a3 * np.sin(q3) + d4 * np.cos(q3)) * np.sin(q5))
    np.testing.assert_allclose(found.manipulability, exact, atol=1e-14)
    np.testing.assert_allclose(found.manipulability, Robot.load("puma560").manipulability(found.q), atol=1e-12)
    assert found.measure == "pose"


@pytest.mark.slow
def test_pumas_singular_set_is_its_stretched_elbow_and_its_wrist_above_the_shoulder() -> None:
    found = workspace(Robot.load("puma560"), section=True)
    assert found.section is not None
    _, q2, q3, *_ = found.section.singular_q.T
    a2, a3, d4 = 0.4318, 0.0203, 0.4318
    elbow = a3 * np.sin(q3) + d4 * np.cos(q3)
    shoulder = a2 * np.cos(q2) + a3 * np.cos(q2 + q3) - d4 * np.sin(q2 + q3)
    assert np.minimum(np.abs(elbow), np.abs(shoulder)).max() < 1e-7
    assert np.abs(elbow).min() < 1e-7
    assert np.abs(shoulder).min() < 1e-7


def test_corners_of_a_boundary_are_attained_and_their_limits_named() -> None:
    found = workspace(planar_2r(1.0, 0.7, (-1.0, 2.0), (0.5, 2.0)), section=True)
    assert found.section is not None
    [curve], [held] = found.section.curves, found.section.held_by
    x = np.cos(curve.q[:, 0]) + 0.7 * np.cos(curve.q.sum(axis=1))
    y = np.sin(curve.q[:, 0]) + 0.7 * np.sin(curve.q.sum(axis=1))
    np.testing.assert_allclose(np.stack([x, y], axis=-1), curve.points, atol=1e-9)
    assert set(held.tolist()) == {0, 1}  # no singularity inside these limits
