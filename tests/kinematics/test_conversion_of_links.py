"""What a file gives in DH frames: a conversion moves the frames, and every body stays where it is."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.conversion import convert_rows
from dh2sim.kinematics.forward import reference_joint_poses
from dh2sim.kinematics.table_oracle import table_frame_poses
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.model.build import build_model
from dh2sim.robot.links import BaseSpec, LinkSpec, MeshSpec
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.sample_robots import HAYATI, MODIFIED, ODD, STANDARD, row
from tests.strategies import inertias, lengths, poses, robots_with_joint_vectors, vectors

KINDS = (STANDARD, MODIFIED)
MESH = MeshSpec(file=Path("part.stl"), scale=0.5, location="r.yaml:3:1: base.mesh.file")


@st.composite
def weighed_robots(draw: DrawFn) -> tuple[RobotSpec, Array]:
    """Robots of which every link has mass, centre of mass, inertia and a mesh, and a joint vector, shape (n,)."""
    spec, q = draw(robots_with_joint_vectors(max_rows=8, must_move=False))
    rows = tuple(
        dataclasses.replace(
            one,
            link=LinkSpec(
                mass=draw(st.floats(0.1, 30.0)),
                com=draw(vectors(lengths)),
                inertia=draw(inertias()),
                radius=0.05,
                mesh=dataclasses.replace(MESH, pose=draw(poses)),
            ),
        )
        for one in spec.rows
    )
    base = dataclasses.replace(spec.base, mesh=dataclasses.replace(MESH, pose=draw(poses)))
    return dataclasses.replace(spec, rows=rows, base=base), q[0]


def without_meshes(spec: RobotSpec) -> RobotSpec:
    rows = tuple(dataclasses.replace(one, link=dataclasses.replace(one.link, mesh=None)) for one in spec.rows)
    return dataclasses.replace(spec, rows=rows, base=dataclasses.replace(spec.base, mesh=None))


@pytest.mark.parametrize("to", KINDS)
@given(robot=weighed_robots())
def test_every_body_stays_where_it_is(to: Convention, robot: tuple[RobotSpec, Array]) -> None:
    """The old robot's bodies straight from its table, the new robot's by way of its model."""
    spec, q = robot
    built = build_model(without_meshes(convert_rows(spec, to).spec))
    frames = table_frame_poses(spec, q)
    joints = reference_joint_poses(build_chain(built.spec), q)
    for old, T_dh, new, T_joint in zip(spec.rows, frames[1:], built.links, joints, strict=True):
        assert new.inertial is not None
        assert old.link.com is not None
        assert old.link.inertia is not None
        assert new.inertial.mass == old.link.mass
        assert new.estimated == ()
        found, expected = (
            T_joint[:3, :3] @ new.inertial.com + T_joint[:3, 3],
            T_dh[:3, :3] @ old.link.com + T_dh[:3, 3],
        )
        np.testing.assert_allclose(found, expected, rtol=0, atol=2e-13)
        R, R_dh = T_joint[:3, :3], T_dh[:3, :3]
        found, expected = R @ new.inertial.inertia @ R.T, R_dh @ old.link.inertia @ R_dh.T
        np.testing.assert_allclose(found, expected, rtol=0, atol=2e-13)


@pytest.mark.parametrize("to", KINDS)
@given(robot=weighed_robots())
def test_every_mesh_stays_where_it_is(to: Convention, robot: tuple[RobotSpec, Array]) -> None:
    spec, q = robot
    found, expected = (mesh_poses(one, q) for one in (convert_rows(spec, to).spec, spec))
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-13)


def mesh_poses(spec: RobotSpec, q: Array) -> list[Array]:
    """Poses of the meshes' own frames in base_link, base first."""
    meshes = [spec.base.mesh, *(one.link.mesh for one in spec.rows)]
    found = []
    for mesh, T in zip(meshes, table_frame_poses(spec, q), strict=True):
        assert mesh is not None
        assert (mesh.file, mesh.scale, mesh.location) == (MESH.file, MESH.scale, MESH.location)
        found.append(T @ pose_from_rpy(mesh.pose.xyz, mesh.pose.rpy))
    return found


def test_a_body_in_a_standard_frame_is_seen_from_behind_the_link_part() -> None:
    one = dataclasses.replace(
        row("one", a=0.3, alpha=np.pi / 2), link=LinkSpec(mass=1.0, com=read_only([-0.1, 0.2, 0]))
    )
    spec = RobotSpec(name="r", rows=(one, row("two")))
    moved = convert_rows(spec, MODIFIED).spec.rows[0].link.com
    assert moved is not None
    assert moved.tolist() == [0.3 - 0.1, 0.0, 0.2]


def test_what_is_in_a_frame_that_does_not_move_keeps_every_bit() -> None:
    link = LinkSpec(mass=1.0, com=read_only([0.1, 0.2, 0.3]), inertia=read_only(np.diag([0.1, 0.2, 0.25])), mesh=MESH)
    rows = tuple(
        dataclasses.replace(one, link=link)
        for one in (row("one"), row("two", a=0.2, alpha=ODD), row("three", "revolute", HAYATI, a=0.3, beta=0.1))
    )
    converted = convert_rows(RobotSpec(name="r", rows=rows, base=BaseSpec(mesh=MESH)), MODIFIED).spec
    assert [one.convention for one in converted.rows] == [MODIFIED, STANDARD, HAYATI]
    assert all(one.link is link for one in converted.rows)
    assert converted.base.mesh is MESH


@pytest.mark.parametrize("kind", KINDS)
def test_a_mesh_without_a_pose_comes_back_without_one(kind: Convention) -> None:
    rows = tuple(
        dataclasses.replace(row(name, "revolute", kind, a=0.3, alpha=ODD), link=LinkSpec(mesh=MESH)) for name in "xy"
    )
    spec = RobotSpec(name="r", rows=rows, base=BaseSpec(mesh=MESH))
    there = convert_rows(spec, KINDS[1 - KINDS.index(kind)]).spec
    assert not any(one.link.mesh is None or one.link.mesh.pose.xyz[0] == 0.0 for one in there.rows[:1])
    back = convert_rows(there, kind).spec
    for mesh in (back.base.mesh, *(one.link.mesh for one in back.rows)):
        assert mesh is not None
        assert [*mesh.pose.xyz.tolist(), *mesh.pose.rpy.tolist()] == [0.0] * 6


def test_a_link_of_which_nothing_is_said_stays_so() -> None:
    spec = RobotSpec(name="r", rows=(row("one", a=0.3, alpha=ODD), row("two", a=0.2, alpha=0.1)))
    for one in convert_rows(spec, MODIFIED).spec.rows:
        assert all(getattr(one.link, field.name) is None for field in dataclasses.fields(one.link))
