"""Paths of meshes lead from the robot file to the mesh, wherever the two stand."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from dh2sim.errors import ModelError
from dh2sim.robot.links import LinkSpec, MeshSpec
from dh2sim.robot.read import parse_robot
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.write import robot_file_text


def _shown_by(file: Path) -> RobotSpec:
    """Return a robot whose only link is shown by a mesh file."""
    link = LinkSpec(mesh=MeshSpec(file=file))
    row = Row(name="joint_1", type=JointType.REVOLUTE, convention=Convention.STANDARD, link=link)
    return RobotSpec(name="r", rows=(row,))


def _mesh_path(file: Path, folder: Path | None) -> str:
    text = robot_file_text(_shown_by(file), folder=folder)
    mesh = parse_robot(text, directory=folder).rows[0].link.mesh
    assert mesh is not None
    assert mesh.file.samefile(file)
    return text.partition("file: ")[2].partition("}")[0]


def test_paths_of_meshes_start_in_the_folder_of_the_file_or_at_the_root(tmp_path: Path) -> None:
    folder = tmp_path / "robots"
    for path in ("sub", "../beside"):
        (folder / path).mkdir(parents=True)
    for path in ("a.stl", "../beside/c 1.ply"):
        (folder / path).write_bytes(b"")
    file = folder / "../beside/c 1.ply"
    assert _mesh_path(file, folder) == '"../beside/c 1.ply"'
    assert _mesh_path(file, folder / "sub") == '"../../beside/c 1.ply"'
    assert _mesh_path(folder / "a.stl", folder) == "a.stl"
    assert _mesh_path(folder / "a.stl", None).strip().strip('"') == os.path.abspath(folder / "a.stl")


def test_paths_of_meshes_lead_out_of_a_folder_that_is_a_link(tmp_path: Path) -> None:
    (tmp_path / "real/robots").mkdir(parents=True)
    (tmp_path / "real/b.stl").write_bytes(b"")
    (tmp_path / "linked").symlink_to(tmp_path / "real/robots", target_is_directory=True)
    assert _mesh_path(tmp_path / "real/b.stl", tmp_path / "linked") == "../b.stl"


def test_paths_of_meshes_stay_inside_a_folder_that_is_reached_by_a_link(tmp_path: Path) -> None:
    (tmp_path / "deep/real/robots").mkdir(parents=True)
    (tmp_path / "deep/real/b.stl").write_bytes(b"")
    (tmp_path / "linked").symlink_to(tmp_path / "deep/real", target_is_directory=True)
    assert _mesh_path(tmp_path / "linked/b.stl", tmp_path / "linked/robots") == "../b.stl"


def test_a_mesh_that_is_a_link_keeps_its_own_name(tmp_path: Path) -> None:
    (tmp_path / "stored").write_bytes(b"")
    (tmp_path / "b.stl").symlink_to(tmp_path / "stored")
    assert _mesh_path(tmp_path / "b.stl", tmp_path) == "b.stl"


def test_a_mesh_whose_name_yaml_cannot_hold_is_refused() -> None:
    with pytest.raises(ModelError) as error:
        robot_file_text(_shown_by(Path("/meshes/a\x07.stl")))
    assert str(error.value) == "a robot file cannot name the mesh file '/meshes/a\\x07.stl'; rename it"
