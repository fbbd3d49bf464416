from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest
import trimesh

from dh2sim.errors import MeshError, RobotFileError
from dh2sim.model.build import build_model
from dh2sim.model.meshes import MAX_FACES
from dh2sim.robot.read import parse_robot
from tests.refusals import refusal

WHERE = "robot.yaml:5:58: joints[1].link.mesh.file"


def build(folder: Path, name: str, extra: str = "") -> None:
    text = f"""name: shown
convention: standard
joints:
  - {{type: revolute, a: 0.3, alpha: 0.6511, d: 0.1}}
  - {{type: revolute, a: 0.2, d: 0.2, link: {{mesh: {{file: {name}{extra}}}}}}}
"""
    build_model(parse_robot(text, file="robot.yaml", directory=folder))


refused = partial(refusal, MeshError, build)


def triangles(vertices: list[list[float]], faces: list[list[int]]) -> bytes:
    data = trimesh.Trimesh(vertices, faces, process=False).export(file_type="stl")
    assert isinstance(data, bytes)
    return data


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("empty.stl", b""),
        ("header.stl", bytes(84)),
        ("text.stl", b"hello world"),
        ("cut.stl", triangles([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2], [1, 3, 2]])[:120]),
        ("empty.obj", b""),
        ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"),
    ],
    ids=["empty STL", "STL header", "text", "cut STL", "empty OBJ", "points"],
)
def test_a_file_without_faces_is_refused(tmp_path: Path, name: str, data: bytes) -> None:
    (tmp_path / name).write_bytes(data)
    assert refused(tmp_path, name) == f"{WHERE}: the mesh '{tmp_path / name}' has no faces"


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("empty.ply", b""),
        ("cut.ply", b"ply\nformat ascii 1.0\nelement vertex 8\n"),
        ("cut.glb", b"glTF1234"),
    ],
)
def test_a_mesh_file_that_cannot_be_read_is_refused(tmp_path: Path, name: str, data: bytes) -> None:
    file = tmp_path / name
    file.write_bytes(data)
    with pytest.raises(Exception) as caught:  # noqa: PT011
        trimesh.load_mesh(file, process=False)
    assert str(caught.value)
    assert refused(tmp_path, name) == f"{WHERE}: cannot read the mesh '{file}': {caught.value}"


def test_a_file_that_is_gone_is_named_with_its_place(tmp_path: Path) -> None:
    with pytest.raises(RobotFileError) as caught:
        build(tmp_path, "gone.stl")
    assert str(caught.value) == f"{WHERE}: file 'gone.stl' not found in {tmp_path}"


def test_a_file_that_disappears_after_the_robot_was_read_is_named_with_its_place(tmp_path: Path) -> None:
    file = tmp_path / "part.stl"
    file.write_bytes(trimesh.creation.box().export(file_type="stl"))
    text = f"name: r\nconvention: standard\njoints: [{{type: revolute, link: {{mesh: {{file: {file.name}}}}}}}]\n"
    spec = parse_robot(text, file="robot.yaml", directory=tmp_path)
    file.unlink()
    with pytest.raises(MeshError) as caught:
        build_model(spec)
    assert str(caught.value) == (
        f"robot.yaml:3:47: joints[0].link.mesh.file: cannot read the mesh '{file}': No such file or directory"
    )


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e39])
def test_coordinates_that_are_no_finite_numbers_are_refused(tmp_path: Path, value: float) -> None:
    file = tmp_path / "part.obj"
    file.write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 {value}\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n")
    expected = f"{WHERE}: the mesh '{file}' has coordinates that are not finite"
    assert refused(tmp_path, file.name) == expected


def test_a_single_triangle_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "part.stl"
    file.write_bytes(triangles([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 1]]))
    expected = f"{WHERE}: the mesh '{file}' has fewer than 4 corners; MuJoCo refuses it"
    assert refused(tmp_path, file.name) == expected


def test_a_mesh_without_area_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "part.stl"
    file.write_bytes(triangles([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], [[0, 1, 2], [1, 3, 2]]))
    expected = f"{WHERE}: the mesh '{file}' has an area of 0 m² with scale 1.0; MuJoCo needs at least 1e-12"
    assert refused(tmp_path, file.name) == expected


def test_a_mesh_that_its_scale_makes_too_small_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "part.stl"
    file.write_bytes(trimesh.creation.box((1, 1, 1)).export(file_type="stl"))
    expected = f"{WHERE}: the mesh '{file}' has an area of 6e-14 m² with scale 1e-07; MuJoCo needs at least 1e-12"
    assert refused(tmp_path, file.name, ", scale: 1e-7") == expected


def test_more_faces_than_mujoco_reads_are_refused(tmp_path: Path) -> None:
    vertices = np.random.default_rng(0).uniform(-1, 1, (MAX_FACES + 3, 3))
    faces = np.arange(MAX_FACES + 1)[:, None] + np.arange(3)
    file = tmp_path / "part.ply"
    file.write_bytes(trimesh.Trimesh(vertices, faces, process=False).export(file_type="ply"))
    assert refused(tmp_path, file.name) == (
        f"{WHERE}: the mesh '{file}' has 200001 faces; MuJoCo reads at most 200000. Simplify it, for instance "
        "with Blender's Decimate or trimesh's simplify_quadric_decimation"
    )
