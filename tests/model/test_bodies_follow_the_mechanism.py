"""The same arm in another table has the same bodies: where a table puts its frames is its own affair."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from dh2sim.kinematics.conversion import convert_rows
from dh2sim.kinematics.forward import reference_joint_poses
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import link_part, pose_from_rpy, rpy_from_rotation, second_twist
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.links import BaseSpec, LinkSpec, Pose, ToolSpec
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.sample_robots import HAYATI, MODIFIED, NAMES, REVOLUTE, STANDARD, model, robot
from tests.strategies import robot_specs

SAME = 1e-9
"""Of the reach, and of every mass, inertia, limit and gain."""


def assert_same_bodies(one: RobotModel, other: RobotModel) -> None:
    size = max(one.reach, 1e-3)
    assert other.reach == pytest.approx(one.reach, rel=0, abs=SAME * size)
    q = one.home
    poses = [[np.eye(4), *reference_joint_poses(built.chain, q)] for built in (one, other)]
    for built, own in zip((one, other), poses, strict=True):
        own += [own[-1] @ built.joints[-1].T_joint_dh] if built.tool else []
    for a, b, T_a, T_b in zip(one.all_links, other.all_links, *poses, strict=True):
        assert [(s.kind, s.part, s.radius) for s in a.shapes] == [(s.kind, s.part, s.radius) for s in b.shapes]
        for s, t in zip(a.shapes, b.shapes, strict=True):
            assert t.length == pytest.approx(s.length, rel=0, abs=SAME * size)
            ends = [np.array([T[:3, :3] @ p + T[:3, 3] for p in x.ends]) for x, T in ((s, T_a), (t, T_b))]
            # an axis that runs the other way is the same shape
            gap = min(np.abs(ends[0] - ends[1]).max(), np.abs(ends[0] - ends[1][::-1]).max())
            assert gap <= SAME * size
        if a.inertial is None or b.inertial is None:
            assert a.inertial is b.inertial
            continue
        assert b.inertial.mass == pytest.approx(a.inertial.mass, rel=SAME)
        coms = [T[:3, :3] @ body.com + T[:3, 3] for body, T in ((a.inertial, T_a), (b.inertial, T_b))]
        np.testing.assert_allclose(coms[1], coms[0], rtol=0, atol=SAME * size)
        tensors = [T[:3, :3] @ body.inertia @ T[:3, :3].T for body, T in ((a.inertial, T_a), (b.inertial, T_b))]
        np.testing.assert_allclose(tensors[1], tensors[0], rtol=0, atol=SAME * np.trace(tensors[0]))
    for joint, again in zip(one.joints, other.joints, strict=True):
        spans = [built.limits.position or (0.0, 0.0) for built in (joint, again)]
        assert spans[1] == pytest.approx(spans[0], rel=SAME, abs=SAME * size)
        assert again.limits.velocity == joint.limits.velocity
        assert again.limits.effort == pytest.approx(joint.limits.effort, rel=SAME)
        assert (again.actuator.kp, again.actuator.kv) == pytest.approx(
            (joint.actuator.kp, joint.actuator.kv), rel=SAME
        )
    assert other.excluded == one.excluded


def turn(angle: float, along: float = 0.0) -> Array:
    return pose_from_rpy([0.0, 0.0, along], [0.0, 0.0, angle])


def head(row: Row) -> Array:
    """What of a row is before its Z."""
    return link_part(row.a, row.alpha) if row.convention is MODIFIED else np.eye(4)


def tail(row: Row) -> Array:
    """What of a row is behind its Z."""
    if row.convention is MODIFIED:
        return np.eye(4)
    return link_part(row.a, row.alpha) @ second_twist(row.beta)


def as_pose(T: Array) -> Pose:
    return Pose(xyz=read_only(T[:3, 3]), rpy=rpy_from_rotation(read_only(T[:3, :3])))


def recut(spec: RobotSpec, slides: list[float]) -> RobotSpec:
    """The same arm in standard rows: frames on common normals, however far; slid along axes that are parallel.

    Written with textbook lines alone. Links keep their mass, radius and density, and lose what is given in frames.
    """
    rows, before = list(spec.rows), turn(0.3, slides[0])
    base = pose_from_rpy(spec.base.pose.xyz, spec.base.pose.rpy) @ head(rows[0]) @ np.linalg.inv(before)
    cut = []
    for i, row in enumerate(rows):
        L = tail(row) @ (head(rows[i + 1]) if i + 1 < len(rows) else pose_from_rpy(spec.tool.xyz, spec.tool.rpy))
        z, p = L[:3, 2], L[:3, 3]
        tilt = math.hypot(z[0], z[1])
        if i + 1 == len(rows):  # all of it goes into the tool
            phi, s, a, alpha = 0.7, slides[i + 1], 0.0, 0.0
        elif tilt < 1e-12:
            phi = math.atan2(p[1], p[0])
            s, a, alpha = slides[i + 1], math.hypot(p[0], p[1]), 0.0 if z[2] > 0 else math.pi
        else:
            assume(tilt > 1e-4)
            phi = math.atan2(z[0], -z[1])
            normal = np.array([math.cos(phi), math.sin(phi), 0.0])
            a, alpha = float(p @ normal), math.atan2(tilt, z[2])
            # the foot on the next axis: p - run z with no part across the normal
            run = float(p[0] * z[0] + p[1] * z[1]) / tilt**2
            s = float((p - run * z)[2])
        X = turn(phi, s) @ link_part(a, alpha)
        rest = np.linalg.inv(X) @ L  # a Z, but behind the last row
        theta, d = math.atan2(before[1, 0], before[0, 0]), before[2, 3]
        link = LinkSpec(mass=row.link.mass, density=row.link.density, radius=row.link.radius)
        cut.append(
            replace(
                row,
                convention=STANDARD,
                a=a,
                alpha=alpha,
                beta=0.0,
                theta=row.theta + theta + phi,
                d=row.d + d + s,
                link=link,
            )
        )
        before = rest
    return replace(
        spec, rows=tuple(cut), base=replace(spec.base, pose=as_pose(base)), tool=ToolSpec.at(as_pose(before))
    )


@st.composite
def parallel_axes(draw: DrawFn) -> RobotSpec:
    """Arms many of whose axes are parallel, or nearly so, in rows of all conventions."""
    spec = draw(robot_specs(max_rows=7))
    tilts = st.sampled_from([0.0, math.pi, 7.3e-4, -2.9e-3, math.pi - 1.1e-3])
    rows = []
    for row in spec.rows:
        row = replace(row, link=replace(row.link, com=None, inertia=None))
        if draw(st.booleans()):
            small = draw(st.sampled_from([0.0, 4.1e-4, -1.7e-3])) if row.convention is HAYATI else 0.0
            row = replace(row, alpha=draw(tilts), beta=small)
        rows.append(row)
    tool, payload = ToolSpec.at(spec.tool.pose), replace(spec.payload, com=None)
    return replace(spec, rows=tuple(rows), tool=tool, payload=payload)


@settings(max_examples=min(80, settings().max_examples))
@given(parallel_axes(), st.lists(st.floats(-600.0, 600.0), min_size=8, max_size=8))
def test_slid_frames_and_recut_rows_have_the_same_bodies(spec: RobotSpec, slides: list[float]) -> None:
    other = recut(spec, slides)
    q = read_only(np.linspace(-0.4, 0.5, len(spec.moving_rows)))
    built, again = build_model(spec), build_model(other)
    assume(again.extent < 1e5)
    # the same arm indeed
    np.testing.assert_allclose(
        table_tool_pose(other, q), table_tool_pose(spec, q), rtol=0, atol=1e-11 + 1e-14 * again.extent
    )
    assert_same_bodies(built, again)


@settings(max_examples=min(60, settings().max_examples))
@given(robot_specs(max_rows=7), st.sampled_from([STANDARD, MODIFIED]))
def test_a_converted_table_has_the_same_bodies(spec: RobotSpec, to: Convention) -> None:
    assert_same_bodies(build_model(spec), build_model(convert_rows(spec, to).spec))


@pytest.mark.parametrize("name", NAMES)
def test_every_robot_in_another_convention_has_the_same_bodies(name: str) -> None:
    for to in (STANDARD, MODIFIED):
        assert_same_bodies(model(name), build_model(convert_rows(robot(name), to).spec))


def ur5(name: str, rows: list[tuple[float, float, float, float]]) -> RobotModel:
    table = [
        Row(name=f"joint_{i}", type=REVOLUTE, convention=STANDARD, theta=theta, a=a, d=d, alpha=alpha)
        for i, (theta, a, d, alpha) in enumerate(rows, start=1)
    ]
    return build_model(RobotSpec(name=name, rows=tuple(table)))


NOMINAL = ur5(
    "ur5",
    [
        (0, 0, 0.089159, math.pi / 2),
        (0, -0.425, 0, 0),
        (0, -0.39225, 0, 0),
        (0, 0, 0.10915, math.pi / 2),
        (0, 0, 0.09465, -math.pi / 2),
        (0, 0, 0.0823, 0),
    ],
)
CALIBRATED = ur5(
    "ur5_calibrated",
    [
        (-9.62699668632896e-06, 0.000279332356195598, 0.0888794492754001, 1.57033858830411),
        (-1.43707039992005, -0.0566854832098269, 574.241384579456, -0.000733893428160216),
        (2.02543119975016, -0.32646702272051, -507.363402098168, 0.00325607356326439),
        (-0.588254688694989, 1.49388687216263e-05, -66.7676839353205, 1.57040005185553),
        (4.13647390228702e-05, 2.23692592990586e-07, 0.0949734691141216, -1.57101000328584),
        (8.1737464953645e-06, 0, 0.0825625014554953, 0),
    ],
)


def test_a_calibrated_ur5_has_the_bodies_of_the_nominal_one() -> None:
    assert CALIBRATED.extent > 1000.0
    assert CALIBRATED.reach == pytest.approx(NOMINAL.reach, rel=0.02)
    assert CALIBRATED.mass == pytest.approx(NOMINAL.mass, rel=0.2)
    for link, nominal in zip(CALIBRATED.all_links, NOMINAL.all_links, strict=True):
        assert len(link.shapes) == len(nominal.shapes)
        for shape, expected in zip(link.shapes, nominal.shapes, strict=True):
            assert shape.radius == pytest.approx(expected.radius, rel=0.02)
            assert shape.length == pytest.approx(expected.length, abs=0.002)
    for joint, same in zip(CALIBRATED.joints, NOMINAL.joints, strict=True):
        assert joint.effort == pytest.approx(same.effort, rel=0.1)
        assert joint.actuator.kp == pytest.approx(same.actuator.kp, rel=0.1)


def test_a_slide_without_limits_is_assumed_to_move_as_far_wherever_frames_are() -> None:
    turning = Row(name="turn", type=REVOLUTE, convention=STANDARD, a=0.4, d=500.0)
    sliding = Row(name="slide", type=JointType.PRISMATIC, convention=STANDARD, a=0.1, d=-500.0)
    built = build_model(RobotSpec(name="slid", rows=(turning, sliding), base=BaseSpec()))
    assert built.joints[1].position_range == pytest.approx((-0.5, 0.5))
