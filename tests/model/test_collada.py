"""COLLADA meshes: every kind of primitive, the scene's places, unit and up axis, and what is refused."""

from __future__ import annotations

import io
import math
import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from dh2sim.model import collada
from dh2sim.model.build import build_model
from dh2sim.model.collada import T_read_file, read_collada
from dh2sim.robot.read import parse_robot
from dh2sim.typing import Array
from tests.refusals import refusal

XMLNS = 'xmlns="http://www.collada.org/2005/11/COLLADASchema"'
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0], [0.5, 1, 3]], dtype=float)
"""Of a pyramid."""
SIDES = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
BASE = [0, 3, 2, 1]


def _with_normals(corners: list[int]) -> str:
    """Indices of positions, each with one of a normal behind it."""
    return " ".join(f"{corner} 0" for corner in corners)


INPUTS = '<input semantic="VERTEX" source="#g-v" offset="0"/><input semantic="NORMAL" source="#g-n" offset="1"/>'
FLAT = [corner for side in SIDES for corner in side]
TRIANGLES = f'<triangles count="6">{INPUTS}<p>{_with_normals([*FLAT, 0, 3, 2, 0, 2, 1])}</p></triangles>'
PRIMITIVES = {
    "triangles": TRIANGLES,
    "polylist": f'<polylist count="5">{INPUTS}<vcount>3 3 3 3 4</vcount>'
    f"<p>{_with_normals([*FLAT, *BASE])}</p></polylist>",
    "polygons": f'<polygons count="5">{INPUTS}'
    + "".join(f"<p>{_with_normals(corners)}</p>" for corners in [*SIDES, BASE])
    + "</polygons>",
    "fans and strips": f'<trifans count="1">{INPUTS}<p>{_with_normals([4, 0, 1, 2, 3, 0])}</p></trifans>'
    f'<tristrips count="1">{INPUTS}<p>{_with_normals([0, 3, 1, 2])}</p></tristrips>',
}


def _source(name: str, points: Array) -> str:
    numbers = " ".join(map(repr, points.ravel().tolist()))
    parameters = "".join(f'<param name="{axis}" type="float"/>' for axis in "XYZ")
    return (
        f'<source id="g-{name}"><float_array id="g-{name}-a" count="{points.size}">{numbers}</float_array>'
        f'<technique_common><accessor source="#g-{name}-a" count="{len(points)}" stride="3">{parameters}</accessor>'
        "</technique_common></source>"
    )


def _geometry(primitives: str) -> str:
    return (
        f'<geometry id="g"><mesh>{_source("p", CORNERS)}{_source("n", np.array([[0.0, 0.0, 1.0]]))}'
        '<vertices id="g-v"><input semantic="POSITION" source="#g-p"/></vertices>'
        f"{primitives}<lines count='1'><p>0 1</p></lines></mesh></geometry>"
    )


def _document(
    nodes: str | None = '<node><instance_geometry url="#g"/></node>',
    primitives: str = TRIANGLES,
    asset: str = "<up_axis>Z_UP</up_axis>",
    more: str = "",
) -> bytes:
    scene = (
        ""
        if nodes is None
        else f'<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>'
    )
    shown = "" if nodes is None else '<scene><instance_visual_scene url="#s"/></scene>'
    return (
        f'<?xml version="1.0" encoding="utf-8"?>\n<COLLADA {XMLNS} version="1.4.1"><asset>{asset}</asset>'
        f"<library_geometries>{_geometry(primitives)}</library_geometries>{more}{scene}{shown}</COLLADA>"
    ).encode()


def _points(data: bytes) -> Array:
    """Corners of all triangles, sorted, shape (n, 3)."""
    vertices, faces = read_collada(data)
    return np.unique(np.round(vertices[faces.ravel()], 12), axis=0)


def _sorted(points: Array) -> Array:
    return np.unique(np.round(points, 12) + 0.0, axis=0)


@pytest.mark.parametrize("kind", PRIMITIVES)
def test_every_primitive_makes_the_same_closed_body_facing_outwards(kind: str) -> None:
    vertices, faces = read_collada(_document(primitives=PRIMITIVES[kind]))
    body = trimesh.Trimesh(vertices, faces, process=False)
    assert body.is_watertight
    assert body.volume == pytest.approx(1.0 * 2.0 * 3.0 / 3.0)
    np.testing.assert_array_equal(_points(_document(primitives=PRIMITIVES[kind])), _sorted(CORNERS))


def test_nodes_in_nodes_are_placed_by_their_transformations_in_order() -> None:
    inner = '<node><rotate>0 0 2 90</rotate><scale>1 1 -2</scale><instance_geometry url="#g"/></node>'
    matrix = "<matrix>0 0 1 5 1 0 0 6 0 1 0 7 0 0 0 1</matrix>"
    data = _document(f"<node><translate>10 20 30</translate>{matrix}{inner}</node>")
    x, y, z = CORNERS.T
    a = np.stack([-y, x, -2 * z], axis=1)  # scaled, then turned
    b = np.stack([a[:, 2] + 5, a[:, 0] + 6, a[:, 1] + 7], axis=1)
    np.testing.assert_allclose(_points(data), _sorted(b + np.array([10, 20, 30])), atol=1e-12)
    body = trimesh.Trimesh(*read_collada(data), process=False)
    assert body.volume == pytest.approx(4.0)  # and not -4: the mirrored faces were turned round


def test_a_node_of_the_library_may_be_shown_several_times() -> None:
    library = (
        '<library_nodes><node id="n"><translate>0 0 1</translate><instance_geometry url="#g"/></node></library_nodes>'
    )
    nodes = '<node><translate>1 0 0</translate><instance_node url="#n"/></node><node><instance_node url="#n"/></node>'
    found = _points(_document(nodes, more=library))
    np.testing.assert_array_equal(
        found, _sorted(np.concatenate([CORNERS + np.array([1, 0, 1]), CORNERS + np.array([0, 0, 1])]))
    )


def test_a_skin_is_shown_as_it_was_bound() -> None:
    skin = '<skin source="#g"><bind_shape_matrix>1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1</bind_shape_matrix></skin>'
    library = f'<library_controllers><controller id="c">{skin}</controller></library_controllers>'
    found = _points(_document('<node><instance_controller url="#c"/></node>', more=library))
    np.testing.assert_array_equal(found, _sorted(CORNERS + np.array([1, 2, 3])))


def test_without_a_scene_all_geometries_are_shown() -> None:
    np.testing.assert_array_equal(_points(_document(None)), _sorted(CORNERS))


@pytest.mark.parametrize(
    ("axis", "turn"),
    [
        ("<up_axis>Z_UP</up_axis>", [[1, 0, 0], [0, 1, 0], [0, 0, 1]]),
        ("<up_axis> Y_UP </up_axis>", [[1, 0, 0], [0, 0, -1], [0, 1, 0]]),
        ("<up_axis>X_UP</up_axis>", [[0, -1, 0], [0, 0, -1], [1, 0, 0]]),
        ("", [[1, 0, 0], [0, 0, -1], [0, 1, 0]]),  # COLLADA's default is y
    ],
)
def test_units_become_metres_and_the_up_axis_z(axis: str, turn: list[list[int]]) -> None:
    R = np.array(turn, dtype=float)
    assert np.linalg.det(R) == 1.0
    data = _document(asset=f'<unit name="inch" meter="0.0254"/>{axis}')
    np.testing.assert_allclose(_points(data), _sorted(0.0254 * CORNERS @ R.T), atol=1e-15)
    np.testing.assert_array_equal(T_read_file(data)[:3, :3], R)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<COLLADA", "<robot", "mismatched tag"),
        ('<?xml version="1.0" encoding="utf-8"?>', "<!DOCTYPE a [<!ENTITY b 'c'>]>", "document type"),
        ("Z_UP", "UP", "the up axis must be X_UP, Y_UP or Z_UP, found 'UP'"),
        ("<asset>", '<asset><unit meter="0"/>', "the unit must be a positive number"),
        ('url="#g"', 'url="#h"', "<instance_geometry> refers to '#h', which is not a <geometry> of the file"),
        ('url="#g"', 'url="#s"', "<instance_geometry> refers to '#s', which is not a <geometry> of the file"),
        ("<p>0 0", "<p>9 0", "<triangles> refers to a vertex that is not there"),
        ("<p>0 0", "<p>-1 0", "<triangles> refers to a vertex that is not there"),
        ("<p>0 0", "<p>0.5 0", "<p> holds what is not an index"),
        ("<p>0 0", "<p>x 0", "<p> contains something that is not a number"),
        ('count="5" stride="3"', 'count="5" stride="4"', "<source> has fewer positions than it says"),
        ('count="5" stride="3"', 'count="5" stride="2"', "of fewer than three numbers"),
        ('semantic="VERTEX"', 'semantic="V"', "<triangles> has no <input> of its vertices"),
        ("<instance_geometry", "<lookat/><instance_geometry", "<lookat> is not read"),
        ("<instance_geometry", "<rotate>1 0 0</rotate><instance_geometry", "<rotate> must have 4 numbers"),
        ('<node><instance', '<node id="n"><instance_node url="#n"/><instance', "nodes are nested more than 200 deep"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_refused_with_what_it_is(old: str, new: str, message: str) -> None:
    data = _document().decode()
    assert data.count(old) == 1
    assert message in refusal(ValueError, read_collada, data.replace(old, new).encode())


def test_a_scene_that_grows_without_bound_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    levels = "".join(
        f'<node id="n{i}">{f"""<instance_node url="#n{i + 1}"/>""" * 10}</node>' if i < 8 else '<node id="n8"/>'
        for i in range(9)
    )
    data = _document('<node><instance_node url="#n0"/></node>', more=f"<library_nodes>{levels}</library_nodes>")
    assert "more than 10000" in refusal(ValueError, read_collada, data)
    monkeypatch.setattr(collada, "MAX_FACES", 5)
    assert "more than 5 faces" in refusal(ValueError, read_collada, _document())


def test_a_collada_mesh_of_a_robot_becomes_an_stl_file(tmp_path: Path) -> None:
    (tmp_path / "part.dae").write_bytes(_document(asset='<unit meter="0.001"/><up_axis>Y_UP</up_axis>'))
    joint = "{type: revolute, a: 0.3, link: {mesh: {file: part.dae, scale: 2}}}"
    text = f"name: r\nconvention: standard\njoints: [{joint}]\n"
    mesh = build_model(parse_robot(text, file="robot.yaml", directory=tmp_path)).links[0].mesh
    assert mesh is not None
    assert (mesh.converted_from, mesh.scale) == (".dae", 2.0)
    again = trimesh.load_mesh(io.BytesIO(mesh.data), file_type="stl")
    np.testing.assert_allclose(again.bounds, [[0, -0.003, 0], [0.001, 0, 0.002]], atol=1e-9)


@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_pycollada_finds_the_same_triangles() -> None:
    library = pytest.importorskip("collada", reason="pycollada is not installed")
    nodes = (
        f"<node><translate>1 2 3</translate><rotate>0.6 0 0.8 {math.degrees(0.7)}</rotate><scale>1 2 3</scale>"
        '<instance_geometry url="#g"/></node>'
    )
    for primitives in (PRIMITIVES["triangles"], PRIMITIVES["polylist"], PRIMITIVES["polygons"]):
        data = _document(nodes, primitives)
        other = library.Collada(io.BytesIO(re.sub(rb"<lines.*?</lines>", b"", data)))
        [bound] = other.scene.objects("geometry")
        [part] = bound.primitives()
        part = part if hasattr(part, "vertex_index") and part.vertex_index.ndim == 2 else part.triangleset()
        expected = part.vertex[part.vertex_index]
        vertices, faces = read_collada(data)
        np.testing.assert_allclose(vertices[faces], expected, atol=1e-5)  # pycollada's are of single precision
