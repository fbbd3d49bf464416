from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
import yourdfpy

from dh2sim.formats.urdf.write import to_urdf
from dh2sim.kinematics.table_oracle import table_frame_poses
from dh2sim.model.build import build_model
from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.formats.readers import floats, in_check_urdf, parsed

TEXT = """
name: shown
convention: standard
base: {xyz: [0.1, 0.2, 0.3], rpy: [0.3, -0.4, 0.5], mesh: {file: part.stl, scale: 0.5}}
joints:
  - {type: revolute, a: 0.3, alpha: 0.6511, d: 0.1}
  - {type: revolute, a: 0.2, alpha: -1.1, d: 0.2, theta: 0.4, link: {mesh: {file: part.stl, scale: 0.001}}}
"""


@pytest.fixture
def exported(tmp_path: Path) -> tuple[RobotSpec, Path]:
    """A robot with two meshes, and its URDF beside them."""
    (tmp_path / "part.stl").write_bytes(trimesh.creation.box((100, 200, 300)).export(file_type="stl"))
    return written(tmp_path, TEXT)


def written(folder: Path, text: str) -> tuple[RobotSpec, Path]:
    built = build_model(parse_robot(text, file="robot.yaml", directory=folder))
    (folder / "meshes").mkdir()
    for link in built.all_links:
        if link.mesh is not None:
            (folder / "meshes" / link.mesh.file_name).write_bytes(link.mesh.data)
    path = folder / "shown.urdf"
    path.write_text(to_urdf(built))
    return built.spec, path


def vertices_in_yourdfpy(path: Path, q: Array) -> Array:
    """All vertices that yourdfpy shows, in base_link."""
    robot = yourdfpy.URDF.load(str(path), load_meshes=True)
    robot.update_cfg(q)
    shown = []
    for node in robot.scene.graph.nodes_geometry:
        T, geometry = robot.scene.graph.get(node)
        shown.append(robot.scene.geometry[geometry].vertices @ T[:3, :3].T + T[:3, 3])
    return np.concatenate(shown)


def test_a_mesh_is_the_only_visual_of_its_link_and_the_shapes_collide(exported: tuple[RobotSpec, Path]) -> None:
    text = exported[1].read_text()
    in_check_urdf(text)
    links = {link.attrib["name"]: link for link in parsed(text).findall("link")}
    for name, scale in (("base_link", 0.5), ("link_2", 0.001)):
        (visual,) = links[name].findall("visual")
        mesh = visual.find("geometry/mesh")
        assert mesh is not None
        assert mesh.attrib["filename"] == f"meshes/{name}.stl"
        assert floats(mesh, "scale") == [scale] * 3
        assert links[name].findall("collision")
    assert all(link.find("collision/geometry/mesh") is None for link in links.values())


def test_meshes_are_shown_in_the_dh_frames_of_their_links(exported: tuple[RobotSpec, Path]) -> None:
    spec, path = exported
    q = np.array([0.7, -1.2])
    vertices = vertices_in_yourdfpy(path, q)
    frames = table_frame_poses(spec, q)
    for scale, T in ((0.5, frames[0]), (0.001, frames[2])):
        corners = scale * trimesh.creation.box((100, 200, 300)).vertices @ T[:3, :3].T + T[:3, 3]
        gaps = np.linalg.norm(corners[:, None] - vertices[None], axis=-1).min(axis=1)
        assert gaps.max() < 1e-6 * scale * 300


def test_meshes_are_shown_where_their_poses_put_them(tmp_path: Path) -> None:
    part = trimesh.creation.box((100, 200, 300))
    part.apply_translation([40, 150, -20])
    (tmp_path / "part.stl").write_bytes(part.export(file_type="stl"))
    text = TEXT.replace("scale: 0.5", "scale: 0.5, xyz: [0.3, 0, 0.1], rpy: [0, 0, 0.5]").replace(
        "scale: 0.001", "scale: 0.001, xyz: [-0.1, 0.2, 0.05], rpy: [0.7, 0, 0]"
    )
    spec, path = written(tmp_path, text)
    q = np.array([0.7, -1.2])
    vertices = vertices_in_yourdfpy(path, q)
    frames = table_frame_poses(spec, q)
    c, s, k, h = math.cos(0.5), math.sin(0.5), math.cos(0.7), math.sin(0.7)
    about_z, about_x = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.array([[1, 0, 0], [0, k, -h], [0, h, k]])
    for scale, R, xyz, T in (
        (0.5, about_z, [0.3, 0, 0.1], frames[0]),
        (0.001, about_x, [-0.1, 0.2, 0.05], frames[2]),
    ):
        corners = (scale * part.vertices @ R.T + xyz) @ T[:3, :3].T + T[:3, 3]
        gaps = np.linalg.norm(corners[:, None] - vertices[None], axis=-1).min(axis=1)
        assert gaps.max() < 1e-6 * scale * 300


def test_mujoco_reads_a_urdf_with_meshes(exported: tuple[RobotSpec, Path]) -> None:
    mj = mujoco.MjModel.from_xml_path(str(exported[1]))
    assert mj.njnt == 2
