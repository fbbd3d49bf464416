from __future__ import annotations

import json
import os
import struct
import sys
import zlib
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from dh2sim import limited_process
from dh2sim.errors import MeshError, RobotFileError
from dh2sim.model.build import build_model
from dh2sim.model.mesh_worker import answer
from dh2sim.model.meshes import MAX_BYTES, MAX_FACES
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


BOX = bytes(trimesh.creation.box().export(file_type="stl"))
BOX_PLY = bytes(trimesh.creation.box().export(file_type="ply"))


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("header.stl", bytes(84)),
        ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"),
    ],
    ids=["STL header", "points"],
)
def test_a_file_without_faces_is_refused(tmp_path: Path, name: str, data: bytes) -> None:
    (tmp_path / name).write_bytes(data)
    assert refused(tmp_path, name) == f"{WHERE}: the mesh '{tmp_path / name}' has no faces"


@pytest.mark.parametrize(
    ("name", "data", "reason"),
    [
        ("cut.ply", BOX_PLY[:-9], "it is not a valid PLY file, or only a part of one: copy or export it again"),
        (
            "beyond.ply",
            b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            b"element face 1\nproperty list uchar int vertex_indices\nend_header\n"
            b"0 0 0\n1 0 0\n0 1 0\n3 0 1 77\n",
            "a face refers to a corner that is not there",
        ),
    ],
)
def test_a_mesh_file_that_is_malformed_is_refused_in_plain_words(
    tmp_path: Path, name: str, data: bytes, reason: str
) -> None:
    file = tmp_path / name
    file.write_bytes(data)
    assert refused(tmp_path, name) == f"{WHERE}: cannot read the mesh '{file}': {reason}"


@pytest.mark.parametrize(
    ("suffix", "data", "reason"),
    [
        (".stl", b"", "it is empty"),
        (".stl", b"hello world", "it has 11 bytes, and is not an STL file: a binary one has at least 84"),
        (
            ".stl",
            BOX[:300],
            "as an STL file it announces 12 faces in 684 bytes, but has 300 bytes: it is only a part of an STL file, "
            "or none; copy or export it again",
        ),
        (
            ".stl",
            b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n",
            "it ends in line 4 without 'endsolid', so that a part is missing: copy or export it again",
        ),
        (
            ".stl",
            b"solid\nfacet normal 0 0 1\nouter loop\nvertex 0 zork 0\nendsolid\n",
            "line 4: a corner needs three numbers, found 'zork'",
        ),
        (".stl", b"glTF12345", "it is a GLB file: name it *.glb"),
        (".stl", b"<!DOCTYPE html><html>", "it is a web page, not a mesh: download the file itself"),
        (
            ".obj",
            b"version https://git-lfs.github.com/spec/v1\n",
            "it is a pointer of Git LFS, not the mesh: run 'git lfs pull'",
        ),
        (".obj", b"v 0 0 0\nv 1 0\nf 1 2 1\n", "line 2: a corner needs three numbers, found 2 of them"),
        (".obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "line 4: a face refers to corner 9; the file has 3"),
        (
            ".obj",
            b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n",
            "line 4: a face refers to corner 0; corners count from 1",
        ),
        (".ply", b"hello", "it does not begin with 'ply', and is not a PLY file"),
        (
            ".ply",
            b"ply\nformat ascii 1.0\nelement vertex 8\n",
            "it has no line 'end_header', so that a part is missing: copy or export it again",
        ),
        (
            ".ply",
            b"ply\nformat zork 1.0\nend_header\n",
            "its format is 'zork'; it must be ascii, binary_little_endian or binary_big_endian",
        ),
        (
            ".ply",
            b"ply\nformat ascii 1.0\nelement vertex 2\nend_header\n0 0 0\n",
            "it announces 2 elements, one line each, but has 1 lines behind 'end_header', so that a part is missing: "
            "copy or export it again",
        ),
        (".glb", b"glTF1234", "it has 8 bytes, so that a part is missing: copy or export it again"),
        (
            ".glb",
            b"glTF" + struct.pack("<III", 2, 900, 40) + b"JSON{}",
            "it should have 900 bytes, but has 22, so that a part is missing: copy or export it again",
        ),
        (
            ".glb",
            b'{"asset": {}}',
            "it is a glTF file in text, which keeps its corners in other files: export it as GLB",
        ),
    ],
)
def test_a_file_that_is_no_mesh_is_refused_with_what_to_do(suffix: str, data: bytes, reason: str) -> None:
    facts = json.loads(answer(suffix.encode() + b"\n" + data).partition(b"\n")[0])
    assert facts == {"refused": reason}


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


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        (3e38, "has a coordinate of 3e+38; MuJoCo reads at most 1.07e+09"),
        (2e6, "has a coordinate of 2e+06 m with scale 1.0; at most 1e6 m is allowed"),
    ],
)
def test_coordinates_that_are_too_large_are_refused(tmp_path: Path, value: float, reason: str) -> None:
    file = tmp_path / "part.obj"
    file.write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 {value}\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n")
    assert refused(tmp_path, file.name) == f"{WHERE}: the mesh '{file}' {reason}"


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


def glb(tree: dict[str, Any], binary: bytes = b"") -> bytes:
    """A GLB file of a description and a buffer."""
    text = json.dumps({"asset": {"version": "2.0"}, "buffers": [{"byteLength": len(binary)}], **tree}).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def tetrahedra(count: int, nodes: list[dict[str, Any]], picture: bytes = b"") -> bytes:
    """A GLB file with a mesh of some tetrahedra, nodes that show it, and a picture on it."""
    corners = np.tile(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float32), (count, 1))
    one = np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])
    faces = (one + 4 * np.arange(count)[:, None, None]).astype(np.uint32)
    parts = [corners.tobytes(), faces.tobytes(), picture + b"\0" * (-len(picture) % 4)]
    starts = [0, len(parts[0]), len(parts[0]) + len(parts[1])]
    views = [{"buffer": 0, "byteOffset": a, "byteLength": len(part)} for a, part in zip(starts, parts, strict=True)]
    primitive = {"attributes": {"POSITION": 0}, "indices": 1, "material": 0}
    return glb(
        {
            "scene": 0,
            "scenes": [{"nodes": list(range(len(nodes)))}],
            "nodes": nodes,
            "meshes": [{"primitives": [primitive]}],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 4 * count, "type": "VEC3"},
                {"bufferView": 1, "componentType": 5125, "count": 12 * count, "type": "SCALAR"},
            ],
            "bufferViews": views if picture else views[:2],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}} if picture else {}}],
            "textures": [{"source": 0}] if picture else [],
            "images": [{"bufferView": 2, "mimeType": "image/png"}] if picture else [],
        },
        b"".join(parts),
    )


@cache
def white(side: int) -> bytes:
    """A PNG file of a white square."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = zlib.compressobj(1)
    data = b"".join(rows.compress(b"\0" + b"\xff" * (3 * side)) for _ in range(side)) + rows.flush()
    head = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


SCENE = [{"mesh": 0}]
HUGE = {"componentType": 5126, "count": 2**31, "type": "VEC3"}


@pytest.mark.parametrize(
    ("name", "data", "reason"),
    [
        ("zeros.glb", glb({"accessors": [HUGE]}), "its accessors hold 2147483648 items; at most 8000000 are read"),
        ("many.glb", glb({"nodes": [{}] * 10_001}), "it has 10001 nodes; at most 10000 are read"),
        ("copies.glb", tetrahedra(1000, SCENE * 1000), "its scene has more than 10000 nodes, or 2000000 faces"),
        (
            "tree.glb",
            tetrahedra(1, [*({"children": [i + 1, i + 1]} for i in range(40)), {"mesh": 0}]),
            "its scene has more than 10000 nodes, or 2000000 faces",
        ),
        (
            "short.ply",
            b"ply\nformat binary_little_endian 1.0\nelement vertex 999999999999\nproperty float x\nend_header\n",
            "it announces 999999999999 of element 'vertex'; the file has 92 bytes, and at most 2000000 are read",
        ),
    ],
    ids=["zeros", "nodes", "copies", "doubling", "PLY"],
)
def test_a_mesh_that_would_become_huge_is_refused_before_it_is_read(
    tmp_path: Path, name: str, data: bytes, reason: str
) -> None:
    (tmp_path / name).write_bytes(data)
    assert refused(tmp_path, name) == f"{WHERE}: cannot read the mesh '{tmp_path / name}': {reason}"


def test_a_mesh_file_that_is_too_large_or_no_file_is_not_opened(tmp_path: Path) -> None:
    with (tmp_path / "large.stl").open("wb") as stream:
        stream.truncate(MAX_BYTES + 1)
    reason = f"is larger than {MAX_BYTES} bytes"
    assert refused(tmp_path, "large.stl") == f"{WHERE}: cannot read the mesh '{tmp_path / 'large.stl'}': {reason}"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_a_pipe_in_place_of_a_mesh_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.stl")
    assert "pipe.stl" in refusal(Exception, build, tmp_path, "pipe.stl")


@pytest.mark.parametrize("kind", ["glb", "obj", "ply"])
def test_pictures_on_a_mesh_are_not_opened(tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """They would take 243 MB."""
    monkeypatch.setattr(limited_process, "MEMORY", 150_000_000)
    (tmp_path / "white.png").write_bytes(white(9_000))
    corners = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
    match kind:
        case "glb":
            (tmp_path / "part.glb").write_bytes(tetrahedra(1, SCENE, white(9_000)))
        case "obj":
            (tmp_path / "part.mtl").write_text("newmtl m\nmap_Kd white.png\n")
            faces = "f 1/1 2/1 3/1\nf 1/1 2/1 4/1\nf 1/1 3/1 4/1\nf 2/1 3/1 4/1\n"
            vertices = "".join(f"v {line}\n" for line in corners.splitlines())
            (tmp_path / "part.obj").write_text(f"mtllib part.mtl\n{vertices}vt 0 0\nusemtl m\n{faces}")
        case _:
            (tmp_path / "part.ply").write_text(
                "ply\nformat ascii 1.0\ncomment TextureFile white.png\nelement vertex 4\nproperty float x\n"
                "property float y\nproperty float z\nelement face 4\nproperty list uchar int vertex_indices\n"
                f"end_header\n{corners}3 0 1 2\n3 0 1 3\n3 0 2 3\n3 1 2 3\n"
            )
    build(tmp_path, f"part.{kind}")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux only")
def test_a_mesh_that_takes_too_much_memory_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "part.obj").write_text("v 0 0 0\n" * 300_000 + "f 1 2 3\n" * 300_000)
    monkeypatch.setattr(limited_process, "MEMORY", 40_000_000)
    reason = "it needs more than 40 MB of memory"
    assert refused(tmp_path, "part.obj") == f"{WHERE}: cannot read the mesh '{tmp_path / 'part.obj'}': {reason}"
