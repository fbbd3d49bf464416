"""A compact table: the same arm, and every frame within its reach."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.kinematics.arm_path import arm_path
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.compaction import compact_rows
from dh2sim.kinematics.conversion import convert_rows
from dh2sim.kinematics.far_frames import far_frames
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_errors
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.robot.links import BaseSpec, LinkSpec, MeshSpec, PayloadSpec, Pose, ToolSpec
from dh2sim.robot.read import load_robot
from dh2sim.robot.row import Dynamics, Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.kinematics.arms import table
from tests.kinematics.perturbed_arms import KINDS, REACHES, perturbed, textbook_table
from tests.sample_robots import HAYATI, MODIFIED, NAMES, PRISMATIC, REVOLUTE, STANDARD
from tests.strategies import robot_specs

UR5 = (  # theta, a, d, alpha; calibrated at the factory, published by its owner
    (-9.62699668632896e-06, 0.000279332356195598, 0.0888794492754001, 1.57033858830411),
    (-1.43707039992005, -0.0566854832098269, 574.241384579456, -0.000733893428160216),
    (2.02543119975016, -0.32646702272051, -507.363402098168, 0.00325607356326439),
    (-0.588254688694989, 1.49388687216263e-05, -66.7676839353205, 1.57040005185553),
    (4.13647390228702e-05, 2.23692592990586e-07, 0.0949734691141216, -1.57101000328584),
    (8.1737464953645e-06, 0.0, 0.0825625014554953, 0.0),
)
SIZES = (8e-6, 1e-5, 1e-3, 1e-2, 1e-1)
"""Angles between axes, rad. Smaller ones put frames farther away than a table may."""


def calibrated_ur5() -> RobotSpec:
    rows = tuple(Row(type=REVOLUTE, theta=theta, a=a, d=d, alpha=alpha) for theta, a, d, alpha in UR5)
    return RobotSpec(name="ur5", rows=rows)


def drawn(spec: RobotSpec, count: int, seed: int = 3) -> Array:
    """Joint vectors; prismatic joints within 10 cm."""
    rng = np.random.default_rng(seed)
    bound = np.array([math.pi if row.type.turns else 0.1 for row in spec.moving_rows])
    return np.asarray(rng.uniform(-bound, bound, (count, len(bound))))


def assert_the_same_arm(spec: RobotSpec, compact: RobotSpec, scale: float = 1.0) -> None:
    position, rotation = table_tool_errors(compact, spec, drawn(spec, 10))
    assert position <= 2e-15 * scale
    assert rotation <= 2e-15


def farthest(spec: RobotSpec) -> float:
    """The greatest distance of a DH frame from base_link, m."""
    origins = table_frame_poses(spec, drawn(spec, 200))[..., :3, 3]
    return float(np.linalg.norm(origins, axis=-1).max())


def test_a_calibrated_ur5_is_a_ur5_again() -> None:
    spec = calibrated_ur5()
    compact = compact_rows(spec).spec
    assert [row.convention for row in compact.rows] == [STANDARD, HAYATI, HAYATI, STANDARD, STANDARD, STANDARD]
    nominal = [(0, 0.089159), (-0.425, 0), (-0.39225, 0), (0, 0.10915), (0, 0.09465), (0, 0.0823)]
    for row, (a, d) in zip(compact.rows, nominal, strict=True):
        assert row.a == pytest.approx(a, abs=2e-3)
        assert row.d == pytest.approx(d, abs=2e-3)
        assert abs(row.theta) < 2e-4
    assert table(compact)[0] == table(spec)[0]
    assert table(compact)[4:] == table(spec)[4:]
    assert_the_same_arm(spec, compact)
    assert farthest(compact) < 1.1


def test_what_stood_where_is_reported() -> None:
    spec = calibrated_ur5()
    far = far_frames(spec)
    assert [one.frame for one in far.frames] == [2, 3]
    assert far.sentence == "DH frames 2 and 3 are 574.1 and 66.77 m away from the arm, which is 1.19 m long."
    assert compact_rows(spec).notes == (
        "joint_2 is a Hayati row now: frame 2 was 574.1 m away from the arm, which is 1.19 m long, because its axis "
        "and that of joint_3 are nearly parallel, 7.34e-04 rad apart.",
        "joint_3 is a Hayati row now: frame 3 was 66.77 m away from the arm, which is 1.19 m long, because its axis "
        "and that of joint_4 are nearly parallel, 3.26e-03 rad apart.",
        "joint_4 begins at the frame that was moved: its theta and d changed.",
    )


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("kind", KINDS)
def test_frames_of_arms_with_axes_not_quite_parallel_come_within_reach(kind: str, size: float) -> None:
    for seed in range(3):
        spec = textbook_table(*perturbed(kind, size, seed))
        compact = compact_rows(spec).spec
        assert farthest(compact) < REACHES[kind]
        assert not far_frames(compact).frames
        assert compact_rows(compact).spec is compact
        assert_the_same_arm(spec, compact)


@pytest.mark.parametrize("kind", KINDS)
def test_a_modified_table_stays_modified_behind_its_last_hayati_row(kind: str) -> None:
    spec = convert_rows(textbook_table(*perturbed(kind, 1e-3, 0)), MODIFIED).spec
    compact = compact_rows(spec).spec
    kinds = [row.convention for row in compact.rows]
    last = max(i for i, one in enumerate(kinds) if one is HAYATI)
    assert MODIFIED not in kinds[: last + 1]
    assert set(kinds[last + 1 :]) <= {MODIFIED}
    assert compact.convention is MODIFIED
    assert farthest(compact) < REACHES[kind]
    assert_the_same_arm(spec, compact)


@pytest.mark.parametrize("name", NAMES)
def test_a_compact_table_comes_back_as_it_is(name: str) -> None:
    spec = load_robot(name)
    conversion = compact_rows(spec)
    assert conversion.spec is spec
    assert conversion.notes == ()


@settings(max_examples=min(50, settings().max_examples))
@given(spec=robot_specs(max_rows=8))
def test_any_table_becomes_compact_at_once(spec: RobotSpec) -> None:
    compact = compact_rows(spec).spec
    assert not far_frames(compact).frames
    if compact is not spec:
        assert_the_same_arm(spec, compact, max(1.0, arm_path(build_chain(compact)).reach) * 5)


@pytest.mark.parametrize("convention", [STANDARD, MODIFIED])
@pytest.mark.parametrize("antiparallel", [False, True])
def test_frames_slide_back_along_parallel_axes_without_hayati_rows(convention: str, antiparallel: bool) -> None:
    odd, sign = math.radians(37.3), -1.0 if antiparallel else 1.0
    twist = math.pi if antiparallel else 0.0
    spec = RobotSpec(
        name="slid",
        rows=(
            Row(type=REVOLUTE, d=0.1, alpha=odd, theta=0.3),
            Row(type=REVOLUTE, d=700.0, a=0.4, alpha=twist, theta=-0.2),
            Row(type=REVOLUTE, d=-650.0 * sign, a=0.3, alpha=0.0, theta=0.5),
            Row(type=REVOLUTE, d=-49.9 * sign, a=0.0, alpha=-odd, theta=0.7),
            Row(type=REVOLUTE, d=0.1, alpha=0.0, theta=0.7),
        ),
    )
    spec = convert_rows(spec, MODIFIED).spec if convention == MODIFIED else spec
    conversion = compact_rows(spec)
    compact = conversion.spec
    assert {row.convention for row in compact.rows} == {convention}
    assert [(row.a, row.alpha) for row in compact.rows] == [(row.a, row.alpha) for row in spec.rows]
    assert [row.theta for row in compact.rows] == [row.theta for row in spec.rows]
    assert sum(abs(row.d) for row in compact.rows) < 1.0
    assert_the_same_arm(spec, compact)
    assert "along parallel axes" in conversion.notes[0]


def test_the_first_and_the_last_frame_come_to_the_arm() -> None:
    at_base: Array = read_only(np.linalg.inv(pose_from_rpy([40.0, 0, -200.0], [0.9, 0, 0]))[:3, 3])
    spec = RobotSpec(
        name="ends",
        rows=(
            Row(type=REVOLUTE, d=300.2, alpha=1.1),
            Row(type=REVOLUTE, a=0.5, alpha=0.4),
            Row(type=REVOLUTE, d=-200.0, a=40.0, alpha=0.9, theta=0.2),
        ),
        base=BaseSpec(
            pose=Pose(xyz=read_only([0.1, 0.0, -300.0])),
            mesh=MeshSpec(file=Path("base.stl"), pose=Pose(xyz=read_only([0, 0, 300]))),
        ),
        tool=ToolSpec(xyz=at_base + np.array([0, 0, 0.1]), mass=0.5, com=at_base + np.array([0, 0.02, 0.05])),
        payload=PayloadSpec(mass=1.0, com=at_base),
    )
    conversion = compact_rows(spec)
    compact = conversion.spec
    assert table(compact)[1] == table(spec)[1]
    assert farthest(compact) < 1.5
    assert np.linalg.norm(compact.base.pose.xyz) < 0.2
    assert np.linalg.norm(compact.tool.xyz) < 1.0
    assert compact.base.mesh is not None
    assert np.allclose(compact.base.pose.xyz + compact.base.mesh.pose.xyz, [0.1, 0.0, 0.0], atol=1e-13)
    q = drawn(spec, 5)
    old, new = table_frame_poses(spec, q)[:, -1], table_frame_poses(compact, q)[:, -1]
    for before, after in ((spec.tool.com, compact.tool.com), (spec.payload.com, compact.payload.com)):
        assert before is not None
        assert after is not None
        assert np.abs(after).max() < 1.0
        place = old[:, :3, :3] @ before + old[:, :3, 3]
        assert np.allclose(new[:, :3, :3] @ after + new[:, :3, 3], place, atol=1e-11)
    assert_the_same_arm(spec, compact)


def test_the_axis_of_a_prismatic_joint_is_put_through_the_arm() -> None:
    odd = math.radians(37.3)
    spec = RobotSpec(
        name="beside",
        rows=(
            Row(type=REVOLUTE, d=0.3, a=500.0, alpha=odd),
            Row(type=PRISMATIC, d=0.1, a=-500.0, alpha=0.2, limits=Limits(position=(-0.1, 0.2))),
            Row(type=REVOLUTE, d=0.2, a=0.1),
        ),
    )
    # the way there and back along x, turned only about x in between, ends beside the arm
    conversion = compact_rows(spec)
    assert farthest(conversion.spec) < 1.5
    assert_the_same_arm(spec, conversion.spec)
    assert "the axis of joint_2, which may be anywhere, was out of reach" in conversion.notes[0]


def test_bodies_stay_where_they_are() -> None:
    inertia = np.diag([0.01, 0.02, 0.025])
    spec = calibrated_ur5()
    link = LinkSpec(mass=2.0, com=read_only([0.1, -0.2, -500.0]), inertia=inertia, mesh=MeshSpec(file=Path("m.stl")))
    spec = dataclasses.replace(spec, rows=tuple(dataclasses.replace(row, link=link) for row in spec.rows))
    compact = compact_rows(spec).spec
    q = drawn(spec, 5)
    old, new = table_frame_poses(spec, q)[:, 1:], table_frame_poses(compact, q)[:, 1:]
    for i, (before, after) in enumerate(zip(spec.rows, compact.rows, strict=True)):
        assert after.link.mass == before.link.mass
        assert before.link.com is not None
        assert after.link.com is not None
        R, R_new = old[:, i, :3, :3], new[:, i, :3, :3]
        place = R @ before.link.com + old[:, i, :3, 3]
        assert np.allclose(R_new @ after.link.com + new[:, i, :3, 3], place, atol=1e-11)
        assert before.link.inertia is not None
        assert after.link.inertia is not None
        turned = R @ before.link.inertia @ R.transpose(0, 2, 1)
        assert np.allclose(R_new @ after.link.inertia @ R_new.transpose(0, 2, 1), turned, atol=1e-15)
        mesh = after.link.mesh
        assert mesh is not None
        T = new[:, i] @ pose_from_rpy(mesh.pose.xyz, mesh.pose.rpy)
        assert np.allclose(T, old[:, i], atol=1e-11)
    assert all(compact.rows[i].link is spec.rows[i].link for i in (0, 3, 4, 5))


def test_everything_else_of_a_robot_is_kept() -> None:
    plain = calibrated_ur5()
    rows = tuple(
        dataclasses.replace(
            row,
            name=f"j{i}",
            flip=i % 2 == 0,
            limits=Limits(position=(-1.0, 2.0), velocity=3.0, effort=4.0),
            dynamics=Dynamics(damping=0.1 * i),
        )
        for i, row in enumerate(plain.rows)
    )
    home = read_only([0.1, -0.2, 0.3, -0.4, 0.5, -0.6])
    spec = dataclasses.replace(
        plain,
        rows=rows,
        configurations={"home": home},
        description="mine",
        source="its owner",
        gravity=read_only([0, 0, 9.81]),
    )
    compact = compact_rows(spec).spec
    assert [(row.name, row.type, row.flip, row.limits, row.dynamics) for row in compact.rows] == [
        (row.name, row.type, row.flip, row.limits, row.dynamics) for row in spec.rows
    ]
    assert compact.configurations["home"].tolist() == home.tolist()
    assert (compact.description, compact.source) == ("mine", "its owner")
    assert compact.gravity.tolist() == spec.gravity.tolist()
    assert_the_same_arm(spec, compact)


def test_an_arm_without_reach_is_left_alone() -> None:
    spec = RobotSpec(name="point", rows=(Row(type=REVOLUTE, alpha=0.5), Row(type=REVOLUTE)))
    assert far_frames(spec).length == 0.0
    assert compact_rows(spec).spec is spec
