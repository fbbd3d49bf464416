from __future__ import annotations

import io
import math
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.kinematics.table_oracle import table_frame_poses
from dh2sim.model.build import build_model
from dh2sim.model.meshes import STL_FACE, STL_HEADER
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.read import parse_robot
from dh2sim.typing import Array

FORMATS = ["stl", "stl_ascii", "obj", "ply", "glb"]
Q = [0.7, -1.2]


def wedge() -> trimesh.Trimesh:
    """A box with one corner pulled out, so that no symmetry hides a wrong pose."""
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    box.apply_translation([0.05, 0.3, -0.1])
    vertices = np.array(box.vertices)
    vertices[np.argmax(vertices.sum(axis=1))] += [0.2, 0.1, 0.4]
    return trimesh.Trimesh(vertices, box.faces, process=False)


def text(file: str, scale: float = 1.0, base: str = "", pose: str = "") -> str:
    return f"""
name: shown
convention: standard
{base}
joints:
  - {{type: revolute, a: 0.3, alpha: 0.6511, d: 0.1, theta: 0.4}}
  - {{type: revolute, a: 0.2, alpha: -1.1, d: 0.2, link: {{mesh: {{file: {file}, scale: {scale!r}{pose}}}}}}}
"""


def write(folder: Path, kind: str, surface: trimesh.Trimesh) -> str:
    data = surface.export(file_type=kind)
    name = f"part.{kind.removesuffix('_ascii')}"
    (folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())
    return name


def built(folder: Path, source: str) -> RobotModel:
    return build_model(parse_robot(source, file="robot.yaml", directory=folder))


def in_mujoco(model: RobotModel, folder: Path) -> tuple[mujoco.MjModel, mujoco.MjData]:
    (folder / "meshes").mkdir()
    for link in model.all_links:
        if link.mesh is not None:
            (folder / "meshes" / link.mesh.file_name).write_bytes(link.mesh.data)
    (folder / "robot.xml").write_text(to_mjcf(model))
    mj = mujoco.MjModel.from_xml_path(str(folder / "robot.xml"))
    data = mujoco.MjData(mj)
    data.qpos[:] = Q
    mujoco.mj_kinematics(mj, data)
    return mj, data


def shown_vertices(mj: mujoco.MjModel, data: mujoco.MjData, name: str) -> Array:
    """The vertices of a mesh in the world, sorted; MuJoCo moves them to the mesh's own centre and axes."""
    mesh = mj.mesh(name).id
    (geom,) = (g for g in range(mj.ngeom) if mj.geom_dataid[g] == mesh)
    start = mj.mesh_vertadr[mesh]
    own = mj.mesh_vert[start : start + mj.mesh_vertnum[mesh]]
    return in_order(own @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])


def in_order(vertices: Array) -> Array:
    rounded = np.round(vertices, 4)
    order: Array = vertices[np.lexsort(rounded.T)]
    return order


def placed(vertices: Array, T: Array) -> Array:
    return in_order(vertices @ T[:3, :3].T + T[:3, 3])


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("scale", [1.0, 0.001])
def test_a_mesh_is_shown_in_the_dh_frame_of_its_link(tmp_path: Path, kind: str, scale: float) -> None:
    surface = wedge()
    large = surface.copy()
    large.apply_scale(1 / scale)
    model = built(tmp_path, text(write(tmp_path, kind, large), scale))
    found = shown_vertices(*in_mujoco(model, tmp_path), "link_2")
    expected = placed(np.array(surface.vertices), table_frame_poses(model.spec, Q)[2])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


def test_a_mesh_of_the_base_is_shown_in_dh_frame_zero(tmp_path: Path) -> None:
    surface = wedge()
    base = f"base: {{xyz: [0.1, 0.2, -0.3], rpy: [0.4, 0.5, 0.6], mesh: {{file: {write(tmp_path, 'stl', surface)}}}}}"
    model = built(tmp_path, text("part.stl", base=base))
    assert model.base.mesh is not None
    assert model.base.mesh.file_name == "base_link.stl"
    found = shown_vertices(*in_mujoco(model, tmp_path), "base_link")
    expected = placed(np.array(surface.vertices), table_frame_poses(model.spec, Q)[0])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


def turned(roll: float, pitch: float, yaw: float) -> Array:
    """Turns about fixed x, y and z, one after the other, shape (3, 3)."""
    cr, sr, cp, sp, cy, sy = (f(x) for x in (roll, pitch, yaw) for f in (math.cos, math.sin))
    Rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    Ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    Rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    R: Array = Rz @ Ry @ Rx
    return R


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("scale", [1.0, 0.001])
def test_a_mesh_is_shown_where_its_pose_puts_it(tmp_path: Path, kind: str, scale: float) -> None:
    surface = wedge()
    large = surface.copy()
    large.apply_scale(1 / scale)
    pose = ", xyz: [0.3, -0.2, 0.15], rpy: [0.4, -0.7, 2.1]"
    model = built(tmp_path, text(write(tmp_path, kind, large), scale, pose=pose))
    found = shown_vertices(*in_mujoco(model, tmp_path), "link_2")
    in_dh = np.array(surface.vertices) @ turned(0.4, -0.7, 2.1).T + [0.3, -0.2, 0.15]
    expected = placed(in_dh, table_frame_poses(model.spec, Q)[2])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


def test_a_mesh_of_the_base_has_a_pose_too(tmp_path: Path) -> None:
    surface = wedge()
    file = write(tmp_path, "stl", surface)
    mesh = f"{{file: {file}, xyz: [100, 0, -50], rpy: [90, 0, 30]}}"
    base = f"units: {{length: mm, angle: deg}}\nbase: {{xyz: [10, 20, 30], rpy: [40, 50, 60], mesh: {mesh}}}"
    model = built(tmp_path, text("part.stl", base=base))
    found = shown_vertices(*in_mujoco(model, tmp_path), "base_link")
    in_dh = np.array(surface.vertices) @ turned(*np.radians([90, 0, 30])).T + [0.1, 0, -0.05]
    expected = placed(in_dh, table_frame_poses(model.spec, Q)[0])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


def test_a_binary_stl_file_is_handed_on_as_it_is(tmp_path: Path) -> None:
    name = write(tmp_path, "stl", wedge())
    mesh = built(tmp_path, text(name, 0.25)).links[1].mesh
    assert mesh is not None
    assert mesh.data == (tmp_path / name).read_bytes()
    assert (mesh.file_name, mesh.scale, mesh.converted_from) == ("link_2.stl", 0.25, None)


@pytest.mark.parametrize("kind", FORMATS[1:])
def test_every_other_file_becomes_a_binary_stl_file(tmp_path: Path, kind: str) -> None:
    name = write(tmp_path, kind, wedge())
    mesh = built(tmp_path, text(name)).links[1].mesh
    assert mesh is not None
    assert mesh.converted_from == f".{kind.removesuffix('_ascii')}"
    assert len(mesh.data) == STL_HEADER + STL_FACE * 12
    again = trimesh.load_mesh(io.BytesIO(mesh.data), file_type="stl")
    assert again.volume == pytest.approx(wedge().volume, rel=1e-5)


def test_all_parts_of_a_scene_are_shown_where_the_scene_has_them(tmp_path: Path) -> None:
    box, ball = trimesh.creation.box((0.1, 0.1, 0.1)), trimesh.creation.icosphere(1, 0.05)
    scene = trimesh.Scene()
    scene.add_geometry(box, transform=trimesh.transformations.translation_matrix([1, 2, 3]))
    scene.add_geometry(ball)
    (tmp_path / "scene.glb").write_bytes(scene.export(file_type="glb"))
    mesh = built(tmp_path, text("scene.glb")).links[1].mesh
    assert mesh is not None
    again = trimesh.load_mesh(io.BytesIO(mesh.data), file_type="stl")
    np.testing.assert_allclose(again.bounds, [[-0.05, -0.05, -0.05], [1.05, 2.05, 3.05]], rtol=0, atol=1e-6)


def test_a_mesh_leaves_mass_and_collision_to_the_shapes(tmp_path: Path) -> None:
    plain = built(tmp_path, text("none.stl").replace(", link: {mesh: {file: none.stl, scale: 1.0}}", ""))
    shown = built(tmp_path, text(write(tmp_path, "stl", wedge())))
    assert shown.mass == plain.mass
    mj, _ = in_mujoco(shown, tmp_path)
    geoms = [mj.geom(g) for g in range(mj.ngeom) if mj.geom_bodyid[g] == mj.body("link_2").id]
    meshes = [geom for geom in geoms if geom.type[0] == mujoco.mjtGeom.mjGEOM_MESH]
    shapes = [geom for geom in geoms if geom.type[0] != mujoco.mjtGeom.mjGEOM_MESH]
    assert [(geom.contype[0], geom.conaffinity[0], geom.group[0]) for geom in meshes] == [(0, 0, 2)]
    assert len(shapes) == sum(shape.solid for shape in shown.links[1].shapes)
    assert {(geom.contype[0], geom.conaffinity[0], geom.group[0]) for geom in shapes} == {(1, 1, 3)}
