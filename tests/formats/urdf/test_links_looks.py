"""Meshes and colours."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dh2sim.formats.serial_robot import SerialMesh, SerialRobot
from dh2sim.formats.urdf.read import read_urdf
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.model.collada import read_collada
from tests.formats.urdf.samples import joint, links, nowhere, robot

I_OWN = '<inertia ixx="0.2" ixy="0.01" ixz="0" iyy="0.3" iyz="-0.02" izz="0.25"/>'


def mesh(uri: str, rest: str = "", scale: str = "") -> str:
    size = f' scale="{scale}"' if scale else ""
    return f'<visual>{rest}<geometry><mesh filename="{uri}"{size}/></geometry></visual>'


def looking(*visuals: str, tail: str = "", materials: str = "") -> SerialRobot:
    """An arm whose link ``b`` has these visuals, and a part ``c`` fixed to it; only ``found`` meshes are found."""
    text = robot(
        materials,
        links("a"),
        f'<link name="b"><inertial><mass value="1"/>{I_OWN}</inertial>{"".join(visuals)}</link>',
        f'<link name="c">{tail}</link>',
        joint("j", "a", "b"),
        joint("f", "b", "c", "fixed", '<origin xyz="0 0 1"/>'),
    )
    return read_urdf(
        text.encode(), file="arm.urdf", find_mesh=lambda uri: Path("/m", uri) if uri.startswith("found") else None
    )


def notes(found: SerialRobot) -> list[str]:
    return [note for note in found.notes if "merged" not in note]


def the_mesh(found: SerialRobot) -> SerialMesh:
    assert found.links[0].mesh is not None
    return found.links[0].mesh


def test_the_first_mesh_that_can_be_used_is_carried_over() -> None:
    pose = '<origin xyz="1 2 3" rpy="0 0 0.5"/>'
    found = looking(
        '<visual><geometry><box size="1 1 1"/></geometry></visual>',
        mesh("found/a.step"),
        mesh("package://pkg/meshes/a.stl"),
        mesh("meshes/a.stl"),
        mesh("a.stl"),
        mesh("found/a.stl", scale="1 1 -1"),
        mesh("found/a.stl", scale="1 2 1"),
        mesh("found/b.STL", rest=pose, scale="0.001 0.001 0.001"),
        mesh("found/c.stl"),
        mesh("d.step"),
        tail=mesh("found/e.stl"),
    )
    chosen = the_mesh(found)
    assert (chosen.uri, chosen.path, chosen.scale) == ("found/b.STL", Path("/m/found/b.STL"), 0.001)
    np.testing.assert_array_equal(chosen.T_link_mesh, pose_from_rpy([1, 2, 3], [0, 0, 0.5]))
    assert notes(found) == [
        "Shapes other than meshes are not carried over: 'b' (box).",
        "Meshes in formats other than .stl, .obj, .ply, .glb, .dae are not carried over, of links 'b' (.step).",
        "Meshes were not found in 'package://pkg', of links 'b'.",
        "Meshes were not found in 'meshes', of links 'b'.",
        "Meshes were not found in the file's folder, of links 'b'.",
        "Meshes that are mirrored or scaled unevenly are not carried over: 'b' (1 1 -1), 'b' (1 2 1).",
        "A link shows one mesh; further ones are not carried over, of links 'b', 'c'.",
    ]


def test_a_mesh_of_a_fixed_part_is_shown_where_the_part_is() -> None:
    found = looking(tail=mesh("found/e.stl", rest='<origin xyz="1 0 0"/>'))
    np.testing.assert_array_equal(the_mesh(found).T_link_mesh[:3, 3], [1, 0, 1])
    assert notes(found) == []


RED, BLUE = (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.5)
NAMED = '<material name="red"><color rgba="1 0 0 1"/></material>'


def test_colours_are_read_in_place_or_by_their_name() -> None:
    own = '<material name=""><color rgba="0 0 1 0.5"/></material>'
    by_name = '<material name="red"/>'
    assert looking(mesh("found/a.stl", own)).links[0].color == BLUE
    assert looking(mesh("found/a.stl", by_name), materials=NAMED).links[0].color == RED
    assert looking(mesh("found/a.stl", by_name), tail=mesh("x.stl", NAMED)).links[0].color == RED
    assert looking(mesh("found/a.stl", by_name)).links[0].color is None
    assert looking(mesh("x.stl", own), mesh("found/a.stl", NAMED)).links[0].color == RED
    assert looking(mesh("x.stl", own), mesh("y.stl", NAMED)).links[0].color == BLUE


def test_looks_that_cannot_be_read_are_left_out_and_noted() -> None:
    found = looking(
        mesh("found/a.stl", '<material name="red"><color rgba="255 0 0 1"/></material>'),
        mesh("found/b.stl", '<origin xyz="a b c"/>'),
        "<visual/>",
    )
    assert the_mesh(found).uri == "found/a.stl"
    assert found.links[0].color is None
    assert notes(found) == [
        "Visuals that cannot be read are left out, of links "
        "'b' (line 4: expected 4 numbers from 0 to 1, found '255 0 0 1'), "
        "'b' (line 4: expected 3 numbers, found 'a b c')."
    ]


def test_collision_shapes_are_noted_once() -> None:
    text = robot(
        '<link name="a"><collision/></link>', '<link name="b"><collision/><collision/></link>', joint("j", "a", "b")
    )
    found = read_urdf(text.encode(), file="arm.urdf", find_mesh=nowhere)
    assert [note for note in found.notes if "ollision" in note] == ["Collision shapes are not carried over."]


@pytest.mark.parametrize(("axis", "turned"), [("Z_UP", False), ("Y_UP", True), ("X_UP", True)])
def test_the_up_axis_of_a_collada_mesh_is_not_applied_as_in_other_readers(
    tmp_path: Path, axis: str, turned: bool
) -> None:
    header = f"<COLLADA><asset><up_axis>{axis}</up_axis></asset>"
    positions = '<source id="p"><float_array>1 2 3 4 5 6 7 8 10</float_array></source>'
    vertices = '<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>'
    part = '<triangles><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>'
    geometry = (
        f"<library_geometries><geometry><mesh>{positions}{vertices}{part}</mesh></geometry></library_geometries>"
    )
    path = tmp_path / "part.dae"
    path.write_text(f"{header}{geometry}</COLLADA>", encoding="utf-8")
    text = robot(links("a"), f'<link name="b">{mesh("part.dae")}</link>', joint("j", "a", "b"))
    found = read_urdf(text.encode(), file="arm.urdf", find_mesh=lambda _: path)
    T = the_mesh(found).T_link_mesh
    corner = T[:3, :3] @ read_collada(path.read_bytes()).vertices[0] + T[:3, 3]
    np.testing.assert_allclose(corner, [1, 2, 3], atol=1e-15)
    assert ("The up axis of COLLADA meshes is not applied, as URDF has it, of links 'b'." in found.notes) == turned
