from __future__ import annotations

import math
import struct
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from dh2sim.kinematics.forward import joint_poses
from dh2sim.kinematics.transforms import identity, pose_from_rpy
from dh2sim.model.build import build_model
from dh2sim.model.meshes import MeshAsset
from dh2sim.model.shapes import Shape, ShapeKind, ShapePart
from dh2sim.robot.read import load_robot
from dh2sim.view.scene.items import Item, Placed, Scene, Solid
from dh2sim.view.scene.solids import (
    link_solids,
    mesh_triangles,
    orientation_of,
    position_of,
    robot_solids,
    shape_triangles,
)
from tests.sample_robots import NAMES, ODD_ROBOT, robot


def shape(kind: ShapeKind, radius: float, length: float) -> Shape:
    size = (radius, 2 * radius, length) if kind is ShapeKind.BOX else None
    length = 0.0 if kind is ShapeKind.SPHERE else length
    return Shape(kind=kind, part=ShapePart.LINK, radius=radius, length=length, T_link_shape=identity(), size=size)


def surface(made: Shape) -> trimesh.Trimesh:
    """The triangles, with points that coincide merged."""
    vertices, faces = shape_triangles(made)
    return trimesh.Trimesh(vertices=np.array(vertices), faces=np.array(faces), process=True)


SIZES = [(0.05, 0.3), (0.2, 0.01), (0.003, 1.0)]


@pytest.mark.parametrize(("radius", "length"), SIZES)
@pytest.mark.parametrize("kind", list(ShapeKind))
def test_a_shape_is_a_closed_surface_of_the_right_volume_seen_from_outside(
    kind: ShapeKind, radius: float, length: float
) -> None:
    solid = surface(shape(kind, radius, length))
    ball, cylinder = 4 / 3 * math.pi * radius**3, math.pi * radius**2 * length
    volume = {
        ShapeKind.CYLINDER: cylinder,
        ShapeKind.CAPSULE: cylinder + ball,
        ShapeKind.SPHERE: ball,
        ShapeKind.BOX: radius * 2 * radius * length,
    }[kind]
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert volume * 0.98 < solid.volume < volume * (1 + 1e-12)  # positive: the faces look outwards
    assert len(solid.faces) < 1200


@pytest.mark.parametrize(("radius", "length"), SIZES)
def test_the_points_of_a_capsule_lie_on_the_capsule(radius: float, length: float) -> None:
    points = np.array(shape_triangles(shape(ShapeKind.CAPSULE, radius, length))[0])
    nearest = np.clip(points[:, 2], -length / 2, length / 2)
    distances = np.linalg.norm(points - np.outer(nearest, [0, 0, 1]), axis=1)
    np.testing.assert_allclose(distances, radius, rtol=1e-12)


@pytest.mark.parametrize(("radius", "length"), SIZES)
def test_a_cylinder_is_as_long_and_as_wide_as_it_should_be_and_its_ends_have_points_of_their_own(
    radius: float, length: float
) -> None:
    vertices, faces = shape_triangles(shape(ShapeKind.CYLINDER, radius, length))
    points = np.array(vertices)
    np.testing.assert_allclose(points.max(axis=0), [radius, radius, length / 2], rtol=1e-12)
    np.testing.assert_allclose(points.min(axis=0), [-radius, -radius, -length / 2], rtol=1e-12)
    corners = points[np.array(faces)]
    flat = np.ptp(corners[:, :, 2], axis=1) == 0.0
    assert not set(np.array(faces)[flat].ravel()) & set(np.array(faces)[~flat].ravel())


def test_triangles_are_made_once_for_each_size_of_a_shape() -> None:
    made = shape(ShapeKind.CAPSULE, 0.1, 0.2)
    assert shape_triangles(made) is shape_triangles(shape(ShapeKind.CAPSULE, 0.1, 0.2))
    others = [
        shape(ShapeKind.CYLINDER, 0.1, 0.2),
        shape(ShapeKind.CAPSULE, 0.2, 0.2),
        shape(ShapeKind.CAPSULE, 0.1, 0.1),
    ]
    assert all(shape_triangles(other) != shape_triangles(made) for other in others)


def test_a_table_that_is_read_again_shares_the_triangles_of_unchanged_shapes() -> None:
    read, again = (build_model(load_robot("stanford")) for _ in range(2))
    before, after = (robot_solids(model, model.home, "/robot") for model in (read, again))
    solids = [name for name, item in before.items() if isinstance(item, Solid)]
    assert solids
    for name in solids:
        here, there = before[name], after[name]
        assert isinstance(here, Solid)
        assert isinstance(there, Solid)
        assert here.vertices is there.vertices


def test_a_mesh_read_again_is_not_cut_up_again() -> None:
    data = b"\0" * 80 + struct.pack("<I", 1) + struct.pack("<12fH", 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)

    def asset(scale: float) -> MeshAsset:
        own = bytes(bytearray(data))  # another object
        return MeshAsset(file_name="m.stl", data=own, scale=scale, T_dh_mesh=identity(), converted_from=None)

    assert mesh_triangles(asset(1.0)) is mesh_triangles(asset(1.0))
    assert mesh_triangles(asset(2.0))[0][1] == (0.0, 2.0, 0.0)


def test_a_mesh_is_read_with_its_scale_and_corners_that_coincide_become_one() -> None:
    corners = [(0.0, 0.0, 0.0), (1000.0, 0.0, 0.0), (0.0, 1000.0, 0.0), (0.0, 0.0, 1000.0)]
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    data = b"\0" * 80 + struct.pack("<I", len(faces))
    for face in faces:
        data += struct.pack("<12fH", 0, 0, 0, *(value for k in face for value in corners[k]), 0)
    mesh = MeshAsset(file_name="m.stl", data=data, scale=0.001, T_dh_mesh=identity(), converted_from=None)
    vertices, triangles = mesh_triangles(mesh)
    assert len(vertices) == 4
    solid = trimesh.Trimesh(vertices=np.array(vertices), faces=np.array(triangles), process=False)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(1 / 6, rel=1e-6)


def matrix(item: Item) -> np.ndarray:
    w, x, y, z = item.orientation
    T = trimesh.transformations.quaternion_matrix([w, x, y, z])
    T[:3, 3] = item.position
    return np.asarray(T)


def pose_in_scene(scene: Scene, name: str) -> np.ndarray:
    """The pose of an item, with those of all that carry it, shape (4, 4)."""
    carrier, T = name.rpartition("/")[0], matrix(scene[name])
    return T if carrier not in scene else np.asarray(pose_in_scene(scene, carrier) @ T)


def test_a_pose_becomes_position_and_quaternion_and_back() -> None:
    T = pose_from_rpy([0.1, -0.2, 0.3], [0.4, -1.1, 2.9])
    item = Placed(position=position_of(T), orientation=orientation_of(T))
    np.testing.assert_allclose(matrix(item), T, rtol=0, atol=1e-15)


@pytest.mark.parametrize("name", NAMES)
def test_every_built_in_robot_has_one_solid_for_every_shape_in_its_place(name: str) -> None:
    model = build_model(robot(name))
    items = robot_solids(model, model.home, "/robot")
    assert items["/robot"] == items["/robot/base_link"] == Placed()
    for link, T in zip(model.links, joint_poses(model.chain, model.home), strict=True):
        np.testing.assert_allclose(matrix(items[f"/robot/{link.name}"]), T, rtol=0, atol=1e-14)
    for link in model.all_links:
        for number, part in enumerate(link.shapes):
            solid = items[f"/robot/{link.name}/shape_{number}"]
            assert isinstance(solid, Solid)
            np.testing.assert_allclose(matrix(solid), part.T_link_shape, rtol=0, atol=1e-14)
            own = link.color if part.part is ShapePart.LINK else link.joint_color
            assert (*solid.color, solid.opacity) == own
    assert len(items) == 2 + len(model.links) + sum(len(link.shapes) for link in model.all_links)


def test_only_poses_of_links_change_with_the_configuration() -> None:
    model = build_model(ODD_ROBOT)
    before, after = (robot_solids(model, model.home + step, "/ghost") for step in (0.0, 0.1))
    changed = {name for name in before if before[name] != after[name]}
    assert before.keys() == after.keys()
    assert changed == {f"/ghost/link_{i}" for i in range(1, len(model.links) + 1)}


def test_a_mesh_in_the_dh_frame_of_its_link_replaces_the_shapes() -> None:
    model = build_model(ODD_ROBOT)
    link, joint = model.links[0], model.chain.joints[0]
    T_dh_mesh = pose_from_rpy([0.1, 0.2, -0.3], [0.3, 0.2, 0.1])
    data = b"\0" * 80 + struct.pack("<I", 1) + struct.pack("<12fH", 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    mesh = MeshAsset(file_name="m.stl", data=data, scale=1.0, T_dh_mesh=T_dh_mesh, converted_from=None)
    shown = replace(link, mesh=mesh)
    solids = link_solids(shown, joint.T_joint_dh, color=(0.1, 0.2, 0.3), opacity=0.5)
    assert list(solids) == ["mesh"]
    np.testing.assert_allclose(matrix(solids["mesh"]), joint.T_joint_dh @ T_dh_mesh, rtol=0, atol=1e-14)
    assert (solids["mesh"].color, solids["mesh"].opacity) == ((0.1, 0.2, 0.3), 0.5)
