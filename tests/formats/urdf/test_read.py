from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.errors import ImportedFileError
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.kinematics.serial_chain import serial_link_poses
from dh2sim.robot.row import JointType
from tests.formats.urdf.samples import joint, links, read, robot
from tests.refusals import refusal
from tests.sample_robots import NAMES, model


def problems(text: str, *, base: str | None = None, tip: str | None = None) -> list[str]:
    return refusal(ImportedFileError, read, text, base=base, tip=tip).split("\n")


TYPES = "revolute, continuous, prismatic, fixed, floating, planar"


def test_an_arm_is_read_with_its_names_poses_axes_and_limits() -> None:
    found = read(
        robot(
            links("base", "a", "b", "c", "tool"),
            joint(
                "turn",
                "base",
                "a",
                inside='<origin xyz="1 2 3"/><axis xyz="0 0 -2"/><dynamics damping="0.1" friction="0.2"/>'
                '<limit lower="-1.5" upper="2" velocity="3" effort="4"/>',
            ),
            joint("weld", "a", "b", "fixed", '<origin rpy="0 0 1.5707963267948966" xyz="0 1 0"/>'),
            joint(
                "slide",
                "b",
                "c",
                "prismatic",
                '<origin xyz="1 0 0"/><limit lower="0" upper="1" velocity="1" effort="1"/>',
            ),
            joint("end", "c", "tool", "fixed", '<origin xyz="0 0 0.25"/>'),
            name="my arm",
        )
    )
    assert (found.name, found.description) == ("my arm", "URDF arm.urdf, from base to tool")
    turn, slide = found.chain.joints
    assert [(turn.name, turn.type), (slide.name, slide.type)] == [
        ("turn", JointType.REVOLUTE),
        ("slide", JointType.PRISMATIC),
    ]
    np.testing.assert_array_equal(turn.T_parent_link, [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
    np.testing.assert_array_equal(turn.axis, [0, 0, -1])
    np.testing.assert_array_equal(turn.point, [0, 0, 0])
    np.testing.assert_array_equal(slide.T_parent_link, [[0, -1, 0, 0], [1, 0, 0, 2], [0, 0, 1, 0], [0, 0, 0, 1]])
    np.testing.assert_array_equal(slide.axis, [1, 0, 0])
    np.testing.assert_array_equal(found.chain.T_link_tip[:3, 3], [0, 0, 0.25])
    assert [found.base.name, *(link.name for link in found.links)] == ["base", "a", "c"]
    assert (found.limits[0].position, found.limits[0].velocity, found.limits[0].effort) == ((-1.5, 2.0), 3.0, 4.0)
    assert (found.dynamics[0].damping, found.dynamics[0].friction) == (0.1, 0.2)
    assert (found.dynamics[1].damping, found.dynamics[1].friction) == (0.0, 0.0)
    assert found.actuators is None
    np.testing.assert_array_equal(found.gravity, [0, 0, -9.81])
    assert found.notes == (
        "Axes that are not of length 1 were made so, of joints 'turn' (2).",
        "The file gives no mass for links 'a', 'c'.",
        "Links that are fixed to a link of the arm were merged into it: 'a' (with 'b'), 'c' (with 'tool').",
    )


@pytest.mark.parametrize("name", NAMES)
def test_what_dh2sim_writes_it_reads_again(name: str) -> None:
    written = model(name)
    found = read(to_urdf(written))
    spec = written.spec
    assert found.name == spec.name
    assert found.description == "URDF arm.urdf, from base_link to tool0"
    assert [one.name for one in found.chain.joints] == [row.name for row in spec.moving_rows]
    q = np.random.default_rng(0).uniform(-3, 3, size=(50, found.chain.n))
    expected = forward_kinematics(written.chain, q)
    reach = float(np.abs(expected).max())
    np.testing.assert_allclose(serial_link_poses(found.chain, q)[:, -1], expected, rtol=0, atol=1e-13 * reach)
    masses = [link.inertial.mass for link in written.links if link.inertial is not None]
    assert sum(link.mass or 0.0 for link in found.links) == pytest.approx(sum(masses), rel=1e-14)


def test_a_robot_without_a_name_is_called_after_its_file() -> None:
    assert read(robot(links("a", "b"), joint("j", "a", "b"), name="")).name == "arm"


def test_axes_are_made_unit_vectors_however_small_or_great_they_are() -> None:
    for xyz, axis in [
        ("0 3e-324 4e-324", (0, 1, 1)),
        ("3e-200 0 4e-200", (0.6, 0, 0.8)),
        ("3e29 0 -4e29", (0.6, 0, -0.8)),
        ("0 0.6 0.8", (0, 0.6, 0.8)),
    ]:
        found = read(robot(links("a", "b"), joint("j", "a", "b", inside=f'<axis xyz="{xyz}"/>'))).chain.joints[0].axis
        np.testing.assert_allclose(found, np.array(axis) / math.hypot(*axis), rtol=1e-15, atol=0)


def test_the_default_axis_is_x() -> None:
    np.testing.assert_array_equal(read(robot(links("a", "b"), joint("j", "a", "b"))).chain.joints[0].axis, [1, 0, 0])


def test_what_is_no_urdf_is_named() -> None:
    assert problems("<mujoco/>") == ["arm.urdf:1:1: expected <robot>, found <mujoco>: this is an MJCF, not a URDF"]
    assert problems("<sdf/>") == ["arm.urdf:1:1: expected <robot>, found <sdf>: this is an SDF, not a URDF"]
    assert problems("<html/>") == ["arm.urdf:1:1: expected <robot>, found <html>"]
    assert problems("<robot/>") == ["arm.urdf:1:1: the file has no <link>"]
    assert problems("joints: []") == ["arm.urdf:1:1: not well-formed XML: syntax error"]


def test_every_error_in_the_structure_is_reported_with_its_place() -> None:
    text = robot(
        links("base", "elbow", "hand"),
        "<link/>",
        links("elbow"),
        joint("a", "base", "elbo"),
        joint("b", "base", "hand", "revolut"),
        joint("a", "base", "elbow"),
        joint("c", "base", "elbow"),
        joint("c", "elbow", "hand"),
        '<joint type="fixed"><parent/><parent link="base"/></joint>',
        '<joint name="e"><parent link="base"/><child link="hand"/></joint>',
        joint("d", "hand", "elbow"),
    )
    assert problems(text) == [
        "arm.urdf:3:1: link: <link> has no name",
        "arm.urdf:4:1: link[elbow]: a second link of this name; the first is on line 2",
        "arm.urdf:5:54: joint[a].child: the file has no link 'elbo'. Did you mean 'elbow'?",
        f"arm.urdf:6:1: joint[b].type: found 'revolut'. Did you mean 'revolute'? Allowed: {TYPES}",
        "arm.urdf:8:1: joint[c].child: link 'elbow' is the child of joint 'a' already (line 7); "
        "a link of a URDF has one parent",
        "arm.urdf:9:1: joint[c]: a second joint of this name; the first is on line 8",
        "arm.urdf:10:1: joint: <joint> has no name",
        "arm.urdf:10:1: joint: the joint has no <child>",
        "arm.urdf:10:21: joint: the joint has a <parent> without the attribute 'link'",
        "arm.urdf:10:30: joint.parent: a second <parent>; the first is on line 10",
        f"arm.urdf:11:1: joint[e]: <joint> has no type. Allowed: {TYPES}",
        "arm.urdf:12:1: joint[d].child: link 'elbow' is the child of joint 'a' already (line 7); "
        "a link of a URDF has one parent",
    ]


def test_loops_and_several_roots_are_refused() -> None:
    text = robot(
        links("a", "b", "c", "d", "e", "f"),
        joint("ab", "a", "b"),
        joint("cd", "c", "d"),
        joint("de", "d", "e"),
        joint("ec", "e", "c"),
        joint("ff", "f", "f"),
    )
    assert problems(text) == [
        "arm.urdf:4:1: joint[cd]: these joints form a loop: 'cd', 'de', 'ec'; a URDF is a tree",
        "arm.urdf:7:1: joint[ff]: the joint joins a link to itself: 'ff'; a URDF is a tree",
    ]
    assert problems(robot(links("a", "b"), links("c"), joint("ab", "a", "b"))) == [
        "arm.urdf:3:1: link[c]: several links have no parent: 'a', 'c'; a URDF has one root"
    ]
    assert problems(robot(links("a", "b"), joint("ab", "a", "b"), joint("ba", "b", "a"))) == [
        "arm.urdf:3:1: joint[ab]: these joints form a loop: 'ab', 'ba'; a URDF is a tree"
    ]


def test_every_wrong_number_of_the_arm_is_reported_with_its_place() -> None:
    text = robot(
        links("a", "b", "c", "d"),
        '<joint name="ab" type="revolute"><parent link="a"/><child link="b"/>',
        '<origin xyz="0 nan 0" rpy="0 0"/><axis xyz="0 0 0"/>',
        '<limit lower="low" upper="1" velocity="nan" effort="1,5"/><dynamics damping="inf"/></joint>',
        joint("bc", "b", "c", "fixed", '<origin xyz="1e999 0 0" rpy="0,5 0 0"/>'),
        joint("cd", "c", "d", inside='<origin xzy="1 2 3" quat_xyzw="0 0 0 1"/><axis rpy="1 0 0"/><origin/>'),
    )
    assert problems(text) == [
        "arm.urdf:4:1: joint[ab].origin.rpy: expected 3 numbers, found '0 0'",
        "arm.urdf:4:1: joint[ab].origin.xyz: expected 3 numbers, found '0 nan 0'",
        "arm.urdf:4:34: joint[ab].axis.xyz: the axis of a joint that moves cannot be '0 0 0'",
        "arm.urdf:5:1: joint[ab].limit.effort: expected a number, found '1,5'; decimals are set off with a point",
        "arm.urdf:5:1: joint[ab].limit.lower: expected a number, found 'low'",
        "arm.urdf:5:1: joint[ab].limit.velocity: expected a number, found 'nan'",
        "arm.urdf:5:59: joint[ab].dynamics.damping: expected a number, found 'inf'",
        "arm.urdf:6:66: joint[bc].origin.rpy: expected 3 numbers, found '0,5 0 0'; decimals are set off with a point",
        "arm.urdf:6:66: joint[bc].origin.xyz: expected 3 numbers no greater than 1e+60, found '1e999 0 0'",
        "arm.urdf:7:69: joint[cd].origin: unknown attribute 'quat_xyzw'. Allowed: xyz, rpy",
        "arm.urdf:7:69: joint[cd].origin: unknown attribute 'xzy'. Did you mean 'xyz'? Allowed: xyz, rpy",
        "arm.urdf:7:110: joint[cd].axis: unknown attribute 'rpy'. Allowed: xyz",
        "arm.urdf:7:129: joint[cd].origin: a second <origin>; the first is on line 7",
    ]


@pytest.mark.parametrize(
    ("word", "number"),
    [("1", 1.0), ("+1.", 1.0), (".5", 0.5), ("-0.5E+1", -5.0), ("1e-320", 1e-320), ("\t1\n", 1.0)],
)
def test_a_number_as_xml_writes_it_is_read(word: str, number: float) -> None:
    found = read(robot(links("a", "b"), joint("j", "a", "b", inside=f'<origin xyz="{word} 0 0"/>')))
    assert found.chain.joints[0].T_parent_link[0, 3] == number


@pytest.mark.parametrize(
    "word", ["nan", "inf", "-inf", "1e999", "1e61", "1_0", "0x1", "١", "1,0", ".", "e5", "--1", ""]
)
def test_a_word_that_only_some_readers_take_for_a_number_is_refused(word: str) -> None:
    text = robot(links("a", "b"), joint("j", "a", "b", inside=f'<origin xyz="{word} 0 0"/>'))
    [problem] = problems(text)
    assert problem.startswith("arm.urdf:3:68: joint[j].origin.xyz: expected 3 numbers")


def test_a_misspelt_element_or_attribute_of_a_joint_is_refused() -> None:
    inside = '<orgin xyz="1 0 0"/><axes xyz="0 0 1"/><Limit/><limit lowr="-1" uper="1"/><dynamics dampening="1"/>'
    assert problems(robot(links("a", "b"), joint("j", "a", "b", inside=inside))) == [
        "arm.urdf:3:68: joint[j]: unknown element <orgin>. Did you mean <origin>?",
        "arm.urdf:3:88: joint[j]: unknown element <axes>. Did you mean <axis>?",
        "arm.urdf:3:115: joint[j].limit: unknown attribute 'lowr'. Did you mean 'lower'?",
        "arm.urdf:3:115: joint[j].limit: unknown attribute 'uper'. Did you mean 'upper'?",
        "arm.urdf:3:142: joint[j].dynamics: unknown attribute 'dampening'. Did you mean 'damping'?",
    ]


@pytest.mark.parametrize(
    ("kind", "inside"),
    [
        ("revolute", '<limit lower="-1" upper="1" velocity="2" effort="3" k_velocity="4" lower_soft="1"/>'),
        ("revolute", '<limit lower="-1" upper="1" velocity="2" effort="3"/><Limit/><limits/><joint_limits/>'),
        ("revolute", '<limit lower="-1" upper="1" velocity="2" effort="3"/><traits/><controller_gains kp="1"/>'),
        ("revolute", '<limit lower="-1" upper="1" velocity="2" effort="3"/><dynamics frictionloss="1" damping="0"/>'),
        ("continuous", '<limit effort="3" velocity="2" lower_bound="1" uper="2"/>'),
        ("continuous", '<origin xyz="0 0 0" rpy="0 0 0" rpyy="1 2 3" name="place"/>'),
        ("continuous", '<origin name="place" unit="m"/><axis xyz="1 0 0" rpy="1 2 3" name="x"/>'),
        ("fixed", "<axes/><Limit/><dynamic/>"),
    ],
)
def test_names_of_other_programs_are_no_slips_where_nothing_is_missing(kind: str, inside: str) -> None:
    arm = robot(links("a", "b", "c"), joint("j", "a", "b", kind, inside), joint("k", "b", "c"))
    plain = robot(links("a", "b", "c"), joint("j", "a", "b", kind), joint("k", "b", "c"))
    found, expected = read(arm, tip="c"), read(plain, tip="c")
    q = np.full(found.chain.n, 0.3)
    assert np.array_equal(serial_link_poses(found.chain, q), serial_link_poses(expected.chain, q))
    assert any("are ignored" in note or "not carried over" in note for note in found.notes)


@pytest.mark.parametrize(
    ("kind", "inside", "problem"),
    [
        ("revolute", '<limit lower="-1" upper="1" k_velocity="4" effort="3"/>', "Did you mean 'velocity'?"),
        ("continuous", '<limit efort="3" velocity="2"/>', "Did you mean 'effort'?"),
        ("continuous", '<axis rpy="1 2 3"/>', "unknown attribute 'rpy'. Allowed: xyz"),
        (
            "continuous",
            '<origin xyz="1 2 3" quat_xyzw="0 0 0 1"/>',
            "unknown attribute 'quat_xyzw'. Allowed: xyz, rpy",
        ),
        ("continuous", '<limits effort="1"/>', "Did you mean <limit>?"),
        ("fixed", '<orign xyz="1 2 3"/>', "Did you mean <origin>?"),
    ],
)
def test_a_name_in_place_of_a_missing_one_is_a_slip(kind: str, inside: str, problem: str) -> None:
    [found] = problems(robot(links("a", "b", "c"), joint("j", "a", "b", kind, inside), joint("k", "b", "c")))
    assert problem in found


def test_definitions_that_xacro_left_behind_are_noted() -> None:
    xacro = 'r" xmlns:xacro="http://www.ros.org/wiki/xacro'
    left = '<xacro:property name="w" value="${2*pi}"/><xacro:arg name="p" default=""/>'
    macro = '<xacro:macro name="m" params="a"><link name="${a}"/><xacro:n/></xacro:macro>'
    inside = '<xacro:property name="x" value="1"/><limit lower="-1" upper="1" velocity="2" effort="3"/>'
    found = read(robot(left, macro, links("a", "b"), joint("j", "a", "b", inside=inside), name=xacro))
    assert found.chain.n == 1
    assert (
        "Definitions for xacro that nothing needs are left out: 'w' (xacro:property), 'p' (xacro:arg), "
        "'m' (xacro:macro), 'x' (xacro:property)." in found.notes
    )
    [problem] = problems(robot(macro, links("a", "b"), joint("j", "a", "b"), '<m a="c"/>', name=xacro))
    assert "found <m>: this is xacro" in problem


def test_xacro_that_is_not_expanded_is_refused_with_what_to_do() -> None:
    arm = (links("a", "b"), joint("j", "a", "b"))
    hint = "this is xacro. Expand it first: xacro FILE > out.urdf"
    xacro = 'r" xmlns:xacro="http://www.ros.org/wiki/xacro'
    assert problems(robot(*arm, '<xacro:include filename="a.xacro"/>', name=xacro)) == [
        f"arm.urdf:4:1: found <xacro:include>: {hint}"
    ]
    short = 'r" xmlns:x="http://ros.org/wiki/xacro'
    assert problems(robot("<gazebo><x:if/></gazebo>", *arm, name=short)) == [f"arm.urdf:2:9: found <x:if>: {hint}"]
    assert problems(robot(links("${prefix}a"), name=xacro)) == [f"arm.urdf:2:1: found '${{prefix}}a': {hint}"]
    assert problems(robot(*arm, joint("k", "a", "$(arg tool)"))) == [f"arm.urdf:4:51: found '$(arg tool)': {hint}"]
    assert read(robot(*arm, '<gazebo config="$(find pkg)/a.yaml"/>', name=xacro)).name == "r"
