"""Which joints of a tree are the arm."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from dh2sim.errors import ImportedFileError
from tests.formats.urdf.samples import joint, links, read, robot
from tests.refusals import refusal

refused = partial(refusal, ImportedFileError, read)


def ends(text: str, *, base: str | None = None, tip: str | None = None) -> str:
    return read(text, base=base, tip=tip).description.removeprefix("URDF arm.urdf, ")


THREE = (joint("j1", "l0", "l1"), joint("j2", "l1", "l2"), joint("j3", "l2", "l3"))


def test_the_arm_goes_from_the_root_to_the_end_of_the_only_way() -> None:
    text = robot(
        links("world", "l0", "l1", "l2", "l3", "flange", "tip"),
        joint("mount", "world", "l0", "fixed"),
        *THREE,
        joint("f", "l3", "flange", "fixed"),
        joint("t", "flange", "tip", "fixed"),
    )
    assert ends(text) == "from world to tip"
    assert ends(text, base="l1") == "from l1 to tip"
    assert ends(text, base="l0", tip="l2") == "from l0 to l2"


def test_a_branch_that_does_not_move_is_not_the_way() -> None:
    text = robot(
        links("l0", "l1", "l2", "l3", "camera", "lens"),
        joint("c", "l1", "camera", "fixed"),
        joint("d", "camera", "lens", "fixed"),
        *THREE,
    )
    assert ends(text) == "from l0 to l3"


def test_tool0_is_the_tip_wherever_the_tree_goes_on() -> None:
    text = robot(
        links("l0", "l1", "l2", "l3", "tool0", "gripper", "finger", "other"),
        *THREE,
        joint("t", "l3", "tool0", "fixed"),
        joint("g", "tool0", "gripper", "fixed"),
        joint("f", "gripper", "finger"),
        joint("o", "l1", "other"),
    )
    assert ends(text) == "from l0 to tool0"
    assert ends(text.replace("tool0", "left_tool0")) == "from l0 to left_tool0"


def test_tool0_is_not_the_tip_where_there_are_two_or_nothing_moves_it() -> None:
    arms = robot(
        links("l0", "a", "b", "a_tool0", "b_tool0"),
        joint("ja", "l0", "a"),
        joint("jb", "l0", "b"),
        joint("ta", "a", "a_tool0", "fixed"),
        joint("tb", "b", "b_tool0", "fixed"),
    )
    assert refused(arms) == (
        "arm.urdf:2:1: the robot forks at 'l0'; choose one arm: tip='a_tool0' (1 joint), tip='b_tool0' (1 joint)"
    )
    assert ends(arms.replace("b_tool0", "tool0")) == "from l0 to tool0"
    assert ends(robot(links("l0", "tool0", "l1", "l2", "l3"), joint("t", "l0", "tool0", "fixed"), *THREE)) == (
        "from l0 to l3"
    )


def test_the_chain_of_a_urdf_ends_at_the_hand() -> None:
    text = robot(
        links("l0", "l1", "l2", "l3", "hand", "left", "right", "nail", "grasp"),
        *THREE,
        joint("h", "l3", "hand", "fixed"),
        joint("left_joint", "hand", "left", "prismatic"),
        joint("right_joint", "hand", "right", "prismatic", '<mimic joint="left_joint"/>'),
        joint("nail_joint", "right", "nail"),
        joint("g", "hand", "grasp", "fixed"),
    )
    found = read(text)
    assert found.description == "URDF arm.urdf, from l0 to hand"
    assert [note for note in found.notes if "hand" in note] == [
        "The arm of 3 joints ends at 'hand', where it forks; taken for a hand and left out: 'left' (1 joint), "
        "'right' (2 joints). Another tip can be chosen.",
        "Links that are fixed to a link of the arm were merged into it: 'l3' (with 'hand', 'grasp').",
        "Left out with joint 'left_joint' (prismatic) on 'hand': link 'left'.",
        "Left out with joint 'right_joint' (prismatic, mimics 'left_joint') on 'hand': 2 links from 'right' on.",
    ]


def test_a_fork_behind_two_joints_or_into_a_branch_as_long_as_the_arm_is_no_hand() -> None:
    short = robot(
        links("l0", "l1", "l2", "x", "y"),
        joint("j1", "l0", "l1"),
        joint("j2", "l1", "l2"),
        joint("jx", "l2", "x"),
        joint("jy", "l2", "y"),
    )
    assert refused(short) == (
        "arm.urdf:2:35: the robot forks at 'l2'; choose one arm: tip='x' (3 joints), tip='y' (3 joints)"
    )
    long = robot(
        links("l0", "l1", "l2", "l3", "x", "y", "y1", "y2", "y3", "f", "g"),
        *THREE,
        joint("jx", "l3", "x"),
        joint("jy", "l3", "y"),
        joint("jy1", "y", "y1"),
        joint("jy2", "y1", "y2"),
        joint("jf", "y2", "f"),
        joint("jg", "y2", "g"),
        joint("jy3", "y2", "y3", "fixed"),
    )
    assert refused(long) == (
        "arm.urdf:2:52: the robot forks at 'l3'; choose one arm: tip='x' (4 joints), tip='y2' (6 joints)"
    )
    assert ends(long, tip="y2") == "from l0 to y2"


def test_a_branch_of_as_many_joints_as_the_arm_is_no_finger() -> None:
    tree = [joint("jx", "l3", "x"), joint("jy", "l3", "y"), joint("jy1", "y", "y1")]
    text = robot(links("l0", "l1", "l2", "l3", "x", "y", "y1"), *THREE, *tree)
    assert ends(text) == "from l0 to l3"
    text = robot(links("l0", "l1", "l2", "l3", "x", "y", "y1", "y2"), *THREE, *tree, joint("jy2", "y1", "y2"))
    assert refused(text) == (
        "arm.urdf:2:52: the robot forks at 'l3'; choose one arm: tip='x' (4 joints), tip='y2' (6 joints)"
    )


def test_where_several_frames_are_fixed_to_the_last_link_that_link_is_the_tip_and_a_note_says_so() -> None:
    text = robot(
        links("l0", "l1", "l2", "l3", "flange", "camera"),
        *THREE,
        joint("f", "l3", "flange", "fixed"),
        joint("c", "l3", "camera", "fixed"),
    )
    found = read(text)
    assert found.description == "URDF arm.urdf, from l0 to l3"
    assert found.notes[0] == (
        "The tip is 'l3'; 2 frames are fixed to it and can be chosen instead: 'flange', 'camera'."
    )
    assert not any("The tip is" in note for note in read(text, tip="camera").notes)


def test_a_base_and_a_tip_that_do_not_exist_are_reported_with_those_that_do() -> None:
    text = robot(links("l0", "l1", "l2", "l3"), *THREE)
    known = "Its links: 'l0', 'l1', 'l2', 'l3'"
    assert refused(text, base="l9", tip="L3") == (
        f"arm.urdf:1:1: base: the file has no link 'l9'. {known}\n"
        f"arm.urdf:1:1: tip: the file has no link 'L3'. Did you mean 'l3'? {known}"
    )


def test_a_tip_that_is_not_below_the_base_is_refused() -> None:
    text = robot(links("l0", "l1", "l2", "l3"), links("other"), *THREE, joint("o", "l1", "other"))
    assert refused(text, base="l2", tip="other") == "arm.urdf:3:1: the tip 'other' is not below the base 'l2'"
    assert refused(text, base="l3", tip="l1") == (
        "arm.urdf:2:18: the tip 'l1' is not below the base 'l3'; 'l3' is below 'l1': exchange base and tip"
    )


def test_an_arm_without_a_joint_that_moves_is_refused() -> None:
    text = robot(links("l0", "l1", "l2"), joint("j1", "l0", "l1", "fixed"), joint("j2", "l1", "l2"))
    assert refused(text, tip="l1") == "arm.urdf:2:18: no joint moves between the base 'l0' and the tip 'l1'"
    assert (
        refused(text, base="l1", tip="l1") == "arm.urdf:2:18: no joint moves between the base 'l1' and the tip 'l1'"
    )
    assert refused(text, base="l2") == "arm.urdf:2:35: no joint moves below the base 'l2'"
    assert refused(robot(links("box"))) == "arm.urdf:2:1: no joint moves below the base 'box'"


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_a_joint_of_several_coordinates_is_refused_on_the_arm_and_noted_off_it(kind: str) -> None:
    on = robot(links("world", "l0", "l1", "l2", "l3"), joint("free", "world", "l0", kind), *THREE)
    assert refused(on) == (
        f"arm.urdf:3:1: joint[free].type: a {kind} joint has no row in a table; "
        "choose a base or tip that leaves it out"
    )
    assert ends(on, base="l0") == "from l0 to l3"
    off = robot(links("l0", "l1", "l2", "l3", "kite"), *THREE, joint("free", "l1", "kite", kind))
    found = read(off, tip="l3")
    assert f"Left out with joint 'free' ({kind}) on 'l1': link 'kite'." in found.notes


def test_a_joint_that_mimics_another_is_refused_on_the_arm() -> None:
    text = robot(
        links("l0", "l1", "l2"), joint("a", "l0", "l1"), joint("b", "l1", "l2", inside='\n<mimic joint="a"/>')
    )
    assert refused(text) == (
        "arm.urdf:5:1: joint[b].mimic: the joint mimics joint 'a', which no table can; "
        "choose a base or tip that leaves it out"
    )
    assert ends(text, tip="l1") == "from l0 to l1"


def test_broken_numbers_off_the_arm_are_noted_and_harm_nothing() -> None:
    text = robot(
        links("l0", "l1", "l2", "l3"),
        *THREE,
        '<link name="camera"><inertial><mass value="?"/></inertial><visual><origin xyz="?"/></visual></link>',
        links("mount", "on_mount", "finger"),
        joint("c", "l3", "camera", "fixed"),
        joint("m", "l3", "mount", "fixed", '<origin xyz="1 2"/>'),
        joint("o", "mount", "on_mount", "fixed"),
        joint("f", "l2", "finger", inside='<origin xyz="a b c"/><axis xyz="0 0 0"/><limit lower="x"/>'),
    )
    found = read(text, tip="l3")
    assert found.chain.n == 3
    assert [note for note in found.notes if "read" in note] == [
        "Joints that cannot be read are left out with all that they carry: "
        "'m' (line 9: expected 3 numbers, found '1 2').",
        "Masses that cannot be read are left out, of links 'camera' (line 6: expected a number, found '?').",
    ]


def test_what_is_above_another_base_is_noted_and_gravity_turns_with_the_base() -> None:
    mount = '<origin rpy="0 1.5707963267948966 0"/>'
    text = robot(
        links("world", "torso", "l0", "l1", "l2", "l3"),
        '<link name="head"><inertial><mass value="2.5"/></inertial></link>',
        joint("t", "world", "torso", "fixed"),
        joint("h", "torso", "head"),
        joint("s", "torso", "l0", "fixed", mount),
        *THREE,
    )
    found = read(text, base="l0")
    np.testing.assert_array_equal(found.gravity, [9.81, 0, 0])
    assert "What is not below the base 'l0' is left out: 3 links from 'world' on (2.5 kg)." in found.notes
    assert "Gravity is (9.81, 0, 0) m/s² in the base 'l0', which is turned in 'world'." in found.notes
    straight = read(text.replace(mount, ""), base="l0")
    np.testing.assert_array_equal(straight.gravity, [0, 0, -9.81])
    assert not any("Gravity" in note for note in straight.notes)


def test_of_many_branches_the_first_are_noted_one_by_one() -> None:
    text = robot(
        links("l0", "l1", "l2", "l3", *(f"b{i}" for i in range(25))),
        *THREE,
        *(joint(f"jb{i}", "l1", f"b{i}") for i in range(25)),
    )
    left_out = [note for note in read(text, tip="l3").notes if note.startswith("Left out")]
    assert len(left_out) == 21
    assert left_out[19] == "Left out with joint 'jb19' (revolute) on 'l1': link 'b19'."
    assert left_out[20] == "Left out: 5 more branches."


def test_elements_that_have_no_place_are_noted_in_one_sentence() -> None:
    text = robot(
        links("l0", "l1", "l2", "l3"),
        *THREE[:2],
        joint("j3", "l2", "l3", inside='<safety_controller k_velocity="1"/><calibration rising="0"/>'),
        "<gazebo/>",
        "<gazebo/>",
        "<transmission/>",
        "<mujoco/>",
        "<loop_joint/>",
    )
    notes = read(text).notes
    assert notes[-2:] == (
        "The file closes loops with 1 <loop_joint>; the arm is read as if it were open.",
        "Elements that a robot file has no place for are not carried over: <calibration>, 2 <gazebo>, "
        "<safety_controller>, <transmission>.",
    )
