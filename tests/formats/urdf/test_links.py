"""Limits and masses."""

from __future__ import annotations

import numpy as np
import pytest

from dh2sim.errors import ImportedFileError
from dh2sim.formats.serial_robot import SerialLink, SerialRobot
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.robot.row import Limits
from tests.formats.urdf.samples import joint, links, read, robot

I_OWN = '<inertia ixx="0.2" ixy="0.01" ixz="0" iyy="0.3" iyz="-0.02" izz="0.25"/>'


def one_joint(inside: str, kind: str = "revolute") -> tuple[Limits, tuple[str, ...]]:
    """Limits of a joint, and the notes less the one on mass."""
    found = read(robot(links("a", "b"), joint("j", "a", "b", kind, inside or " ")))
    return found.limits[0], tuple(note for note in found.notes if "mass" not in note)


def values(limits: Limits) -> tuple[tuple[float, float] | None, float | None, float | None]:
    return limits.position, limits.velocity, limits.effort


@pytest.mark.parametrize(
    ("limit", "expected", "notes"),
    [
        ('<limit lower="-1" upper="2" velocity="3" effort="4"/>', ((-1.0, 2.0), 3.0, 4.0), ()),
        ('<limit lower="-1" upper="2"/>', ((-1.0, 2.0), None, None), ()),
        (" ", (None, None, None), ("No position limits are given for joints 'j'.",)),
        ('<limit velocity="3" effort="4"/>', (None, 3.0, 4.0), ("No position limits are given for joints 'j'.",)),
        (
            '<limit lower="1"/>',
            (None, None, None),
            ("Only one of the position limits is given, so that none is used, for joints 'j'.",),
        ),
        (
            '<limit lower="0" upper="0"/>',
            (None, None, None),
            (
                "The lower position limit is not below the upper one, so that none is used, "
                "for joints 'j' (0.0, 0.0).",
            ),
        ),
        (
            '<limit lower="-inf" upper="1" velocity="inf" effort="INFINITY"/>',
            (None, None, None),
            ("A position limit is infinite, so that none is used, for joints 'j' (-inf, 1.0).",),
        ),
        (
            '<limit lower="-1" upper="1" velocity="0" effort="-2"/>',
            ((-1.0, 1.0), None, None),
            (
                "Limits of velocity that are not positive are left out, of joints 'j'.",
                "Limits of effort that are not positive are left out, of joints 'j'.",
            ),
        ),
    ],
)
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_limits_that_limit_are_read_and_others_noted(
    limit: str, expected: tuple[object, object, object], notes: tuple[str, ...], kind: str
) -> None:
    limits, found = one_joint(limit, kind)
    assert values(limits) == expected
    assert found == notes


def test_position_limits_of_a_continuous_urdf_joint_are_ignored() -> None:
    limits, found = one_joint('<limit lower="-3" upper="3" velocity="2" effort="1"/>', "continuous")
    assert values(limits) == (None, 2.0, 1.0)
    assert found == ("Position limits of continuous joints are left out: 'j' (-3.0, 3.0).",)
    assert one_joint('<limit velocity="2" effort="1" lower="0" upper="0"/>', "continuous")[1] == ()
    assert one_joint(" ", "continuous")[1] == ()


def test_joints_of_one_reason_share_a_note() -> None:
    found = read(robot(links("a", "b", "c"), joint("x", "a", "b", inside=" "), joint("y", "b", "c", inside=" ")))
    assert "No position limits are given for joints 'x', 'y'." in found.notes


def test_negative_damping_and_friction_are_made_zero() -> None:
    inside = '<limit lower="-1" upper="1"/><dynamics damping="-1" friction="-0.5"/>'
    found = read(robot(links("a", "b"), joint("j", "a", "b", inside=inside)))
    assert (found.dynamics[0].damping, found.dynamics[0].friction) == (0.0, 0.0)
    assert found.notes[:2] == (
        "A negative damping was made 0, for joints 'j' (-1.0).",
        "A negative friction was made 0, for joints 'j' (-0.5).",
    )


def weighed(*inertials: str) -> SerialRobot:
    """An arm whose only link has the first inertial; the others are fixed to it, each 1 m further along x."""
    elements = [links("base"), joint("j", "base", "link_0")]
    for i, inertial in enumerate(inertials):
        elements.append(f'<link name="link_{i}"><inertial>{inertial}</inertial></link>')
        if i:
            elements.append(joint(f"f{i}", f"link_{i - 1}", f"link_{i}", "fixed", '<origin xyz="1 0 0"/>'))
    return read(robot(*elements))


def mass_notes(found: SerialRobot) -> list[str]:
    return [note for note in found.notes if "mass" in note or "nertia" in note]


def test_an_inertia_is_turned_into_the_axes_of_its_link() -> None:
    rpy = (0.3, -0.7, 1.1)
    found = weighed(f'<origin xyz="1 2 3" rpy="{" ".join(map(str, rpy))}"/><mass value="2"/>{I_OWN}')
    link = found.links[0]
    R = pose_from_rpy([0, 0, 0], rpy)[:3, :3]
    I = np.array([[0.2, 0.01, 0], [0.01, 0.3, -0.02], [0, -0.02, 0.25]])  # noqa: E741
    assert link.mass == 2.0
    assert link.com is not None
    assert link.inertia is not None
    np.testing.assert_array_equal(link.com, [1, 2, 3])
    np.testing.assert_allclose(link.inertia, R @ I @ R.T, rtol=0, atol=1e-15)
    assert mass_notes(found) == []


def test_products_of_inertia_that_are_not_given_are_zero() -> None:
    found = weighed('<mass value="2"/><inertia ixx="1" iyy="1.5" izz="1.2"/>')
    np.testing.assert_array_equal(np.asarray(found.links[0].inertia), np.diag([1, 1.5, 1.2]))


def test_masses_fixed_to_each_other_are_one() -> None:
    ball = '<mass value="2"/><inertia ixx="1" iyy="1" izz="1"/>'
    link = weighed(ball, ball).links[0]
    assert link.mass == 4.0
    np.testing.assert_array_equal(np.asarray(link.com), [0.5, 0, 0])
    np.testing.assert_allclose(np.asarray(link.inertia), np.diag([2, 3, 3]), rtol=1e-15)


def no_mass(link: SerialLink) -> bool:
    return (link.mass, link.com, link.inertia) == (None, None, None)


@pytest.mark.parametrize(
    ("inertial", "notes"),
    [
        ("", ["The file gives no mass for links 'link_0'."]),
        (
            I_OWN,
            [
                "Inertias without a mass are left out, of links 'link_0'.",
                "The file gives no mass for links 'link_0'.",
            ],
        ),
        ('<mass value="0"/>', ["The file gives no mass for links 'link_0'."]),
        (
            f'<mass value="-1"/>{I_OWN}',
            ["Negative masses are left out, of links 'link_0'.", "The file gives no mass for links 'link_0'."],
        ),
    ],
)
def test_a_link_without_a_positive_mass_has_none(inertial: str, notes: list[str]) -> None:
    found = weighed(inertial)
    assert no_mass(found.links[0])
    assert mass_notes(found) == notes


@pytest.mark.parametrize(
    "inertia",
    [
        '<inertia ixx="0" iyy="0" izz="0"/>',
        '<inertia ixx="1" iyy="1" izz="2.1"/>',
        '<inertia ixx="1" iyy="1" izz="1" ixy="1"/>',
        '<inertia ixx="-1" iyy="1" izz="1"/>',
        '<inertia ixx="1e-9" iyy="1e-9" izz="2.00001e-9"/>',
    ],
)
def test_an_inertia_that_no_body_has_is_left_out_and_the_mass_kept(inertia: str) -> None:
    found = weighed(f'<origin xyz="1 0 0"/><mass value="2"/>{inertia}')
    assert (found.links[0].mass, found.links[0].inertia) == (2.0, None)
    np.testing.assert_array_equal(np.asarray(found.links[0].com), [1, 0, 0])
    assert mass_notes(found) == ["Impossible inertias are left out, of links 'link_0'."]


def test_the_inertia_of_a_flat_body_is_kept() -> None:
    assert weighed('<mass value="2"/><inertia ixx="1" iyy="1" izz="2"/>').links[0].inertia is not None


def test_light_parts_of_unknown_inertia_are_points_and_heavy_ones_make_the_whole_unknown() -> None:
    body = '<mass value="3"/><inertia ixx="1" iyy="1" izz="1"/>'
    light = weighed(body, '<mass value="0.3"/>')
    m, o = 0.3 * 3 / 3.3, np.diag([1.0, 1.0, 1.0])
    np.testing.assert_allclose(np.asarray(light.links[0].inertia), o + m * np.diag([0, 1, 1]), rtol=1e-14)
    assert mass_notes(light) == [
        "The file gives a mass without an inertia for links 'link_1'.",
        "Light parts of unknown inertia were counted as point masses, in links 'link_0'.",
    ]
    heavy = weighed(body, '<mass value="1"/>')
    assert (heavy.links[0].mass, heavy.links[0].inertia) == (4.0, None)
    np.testing.assert_array_equal(np.asarray(heavy.links[0].com), [0.25, 0, 0])
    assert mass_notes(heavy) == [
        "The file gives a mass without an inertia for links 'link_1'.",
        "The inertia of a heavy part is unknown, and so that of the whole, for links 'link_0'.",
    ]


def test_two_points_of_which_rounding_has_lost_the_extent_make_a_thin_rod() -> None:
    point = '<mass value="1e20"/><inertia ixx="1" iyy="1" izz="1"/>'
    found = weighed(f'<origin xyz="1 0.3 -0.7"/>{point}', f'<origin xyz="0 1.1 0.9"/>{point}')
    inertia = np.asarray(found.links[0].inertia)
    assert found.links[0].mass == 2e20
    assert np.linalg.eigvalsh(inertia / np.trace(inertia)) == pytest.approx([0.0, 0.5, 0.5], abs=2e-9)
    assert mass_notes(found) == [
        "Inertias of thin rods, zero about the rod, are made greater by 1e-9 of them, of links 'link_0'."
    ]


@pytest.mark.parametrize(
    ("inertia", "note"),
    [
        ('ixx="0" iyy="1e-3" izz="1e-3"', "Inertias of thin rods"),
        ('ixx="-1e-20" iyy="1e-3" izz="1e-3"', "Inertias of thin rods"),
        ('ixx="-1e-8" iyy="1e-3" izz="1e-3"', "Impossible inertias are left out"),
        ('ixx="0" iyy="1e-3" izz="2e-3"', "Impossible inertias are left out"),
        ('ixx="0" iyy="0" izz="0"', "Impossible inertias are left out"),
    ],
)
def test_a_rod_without_thickness_is_a_body_and_less_than_that_is_none(inertia: str, note: str) -> None:
    found = weighed(f'<origin rpy="0.3 0.4 0.5"/><mass value="1"/><inertia {inertia}/>')
    assert any(sentence.startswith(note) for sentence in mass_notes(found))
    assert (found.links[0].inertia is None) == note.startswith("Impossible")


def test_a_mass_that_cannot_be_read_is_an_error_on_the_arm() -> None:
    with pytest.raises(ImportedFileError) as caught:
        weighed('<origin xyz="?"/><mass value="heavy"/><mass value="2"/><inertia ixx="1" iyy="x"/>')
    assert str(caught.value).split("\n") == [
        "arm.urdf:4:31: link[link_0].inertial.origin.xyz: expected 3 numbers, found '?'",
        "arm.urdf:4:48: link[link_0].inertial.mass.value: expected a number, found 'heavy'",
        "arm.urdf:4:69: link[link_0].inertial.mass: a second <mass>; the first is on line 4",
        "arm.urdf:4:86: link[link_0].inertial.inertia: <inertia> has no attribute 'izz'",
        "arm.urdf:4:86: link[link_0].inertial.inertia.iyy: expected a number, found 'x'",
    ]


def test_the_mass_of_the_base_does_not_matter() -> None:
    arm = (links("b"), joint("j", "a", "b"))
    text = robot('<link name="a"><inertial><mass value="heavy"/></inertial></link>', *arm)
    assert no_mass(read(text).base)
    assert read(text.replace("heavy", "3")).base.mass == 3.0
    assert read(text).notes == read(text.replace("heavy", "3")).notes
