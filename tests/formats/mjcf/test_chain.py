"""Which part of an MJCF is the arm."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import mujoco
import numpy as np
import pytest

from dh2sim.errors import ImportedFileError
from dh2sim.formats.serial_robot import SerialRobot
from tests.formats.mjcf.reading import BALL, arm_text, model_text, read_text, residual
from tests.refusals import refusal


def ends(robot: SerialRobot) -> str:
    return robot.description.removeprefix("MJCF robot.xml, from ")


refused = partial(refusal, ImportedFileError, read_text)


def body(name: str, inside: str = "", joint: str = "hinge") -> str:
    """A body with a joint of its name, capitalised."""
    moves = f'<joint name="{name.upper()}" type="{joint}"/>' if joint else ""
    return f'<body name="{name}" pos="0.1 0 0.3">{moves}{BALL}{inside}</body>'


FINGERS = body("f1", joint="slide") + body("f2", joint="slide")


def test_the_base_is_the_topmost_body_without_a_joint(tmp_path: Path) -> None:
    text = model_text(f'<body name="table"><body name="mount">{body("a", body("b"))}</body></body>')
    assert ends(read_text(tmp_path, text)) == "table to b"
    assert ends(read_text(tmp_path, text, base="mount")) == "mount to b"
    assert ends(read_text(tmp_path, text, base="world")) == "world to b"
    assert ends(read_text(tmp_path, text, base="a")) == "a to b"


def test_the_base_is_the_world_where_the_first_body_has_a_joint(tmp_path: Path) -> None:
    robot = read_text(tmp_path, model_text(f'<geom type="plane" size="1 1 1"/>{body("a", body("b"))}'))
    assert ends(robot) == "world to b"
    assert robot.base.mass is None
    assert robot.base.color is None


def test_a_base_that_floats_is_where_the_table_starts(tmp_path: Path) -> None:
    arm = f'<body name="hull" pos="1 2 3"><freejoint/>{BALL}{body("a", body("b"))}</body>'
    robot = read_text(tmp_path, model_text(arm))
    assert ends(robot) == "hull to b"
    assert "The base 'hull' floats on a free joint; the table starts at the base." in robot.notes
    column = model_text(arm).index("<body") + 1
    assert refused(tmp_path, model_text(arm), base="world") == (
        f"robot.xml:1:{column}: body[hull].joint: a free joint has no row in a table; "
        "choose a base or tip that leaves it out"
    )


def test_bodies_that_only_float_are_no_arm(tmp_path: Path) -> None:
    cube = f'<body name="cube"><freejoint/>{BALL}</body>'
    robot = read_text(tmp_path, model_text(f'{cube}<body name="base">{body("a")}</body>'))
    assert ends(robot) == "base to a"
    assert "What is not below the base 'base' is left out: body 'cube' (4.18879 kg)." in robot.notes
    assert refused(tmp_path, model_text(cube)) == (
        "robot.xml:1:1: the file has no joint that moves: no hinge and no slide"
    )


def test_several_trees_are_a_choice(tmp_path: Path) -> None:
    text = model_text(f'<body name="base">{body("a", body("b"))}</body>{body("door")}')
    assert refused(tmp_path, text) == (
        "robot.xml:1:1: the file has several trees with joints; choose one arm: "
        "tip='b' (2 joints), tip='door' (1 joint)"
    )
    assert ends(read_text(tmp_path, text, tip="door")) == "world to door"
    assert ends(read_text(tmp_path, text, base="base")) == "base to b"


@pytest.mark.parametrize("name", ["tool0", "attachment_site", "ee_site", "end_effector", "tcp"])
def test_a_site_of_a_known_name_is_the_tip(name: str, tmp_path: Path) -> None:
    inner = f'<site name="{name}" pos="0 0 0.1"/><site name="other"/>{body("c")}'
    text = model_text(f'<body name="base"><site name="elsewhere"/>{body("a", body("b", inner))}</body>')
    robot = read_text(tmp_path, text)
    assert ends(robot) == f"base to {name}"
    assert residual(robot, mujoco.MjModel.from_xml_string(text), "base", ["a", "b", name]) < 1e-14


def test_two_sites_of_known_names_are_no_tip_unless_one_is_tool0(tmp_path: Path) -> None:
    inner = '<site name="tcp" pos="0 0 0.1"/><site name="ee_site"/>'
    robot = read_text(tmp_path, model_text(f'<body name="base">{body("a", inner)}</body>'))
    assert ends(robot) == "base to a"
    assert (
        "The tip is the frame of body 'a'; the last link has 2 sites, which can be chosen instead: 'tcp', 'ee_site'."
    ) in robot.notes
    inner += '<site name="tool0"/>'
    assert ends(read_text(tmp_path, model_text(f'<body name="base">{body("a", inner)}</body>'))) == "base to tool0"


def test_a_known_site_that_nothing_moves_is_no_tip(tmp_path: Path) -> None:
    text = model_text(f'<body name="base"><site name="tcp"/>{body("a")}</body>')
    assert ends(read_text(tmp_path, text)) == "base to a"


def test_a_tip_may_be_a_site_or_a_body_and_a_site_wins(tmp_path: Path) -> None:
    inner = f'<site name="b" pos="0 0 1"/>{body("b", body("c"))}'
    text = model_text(f'<body name="base">{body("a", inner)}</body>')
    robot = read_text(tmp_path, text, tip="b")
    assert [joint.name for joint in robot.chain.joints] == ["A"]
    np.testing.assert_array_equal(robot.chain.T_link_tip[:3, 3], [0, 0, 1])
    assert [joint.name for joint in read_text(tmp_path, text, tip="c").chain.joints] == ["A", "B", "C"]


def test_the_chain_of_an_mjcf_ends_at_the_hand(tmp_path: Path) -> None:
    hand = f'<body name="hand" pos="0 0 0.1">{BALL}{FINGERS}</body>'
    text = model_text(f'<body name="base">{body("a", body("b", body("c", hand)))}</body>')
    robot = read_text(tmp_path, text)
    assert ends(robot) == "base to hand"
    assert residual(robot, mujoco.MjModel.from_xml_string(text), "base", ["a", "b", "c", "hand"]) < 1e-14
    assert (
        "The arm of 3 joints ends at 'hand', where it forks; taken for a hand and left out: "
        "'f1' (1 joint), 'f2' (1 joint). Another tip can be chosen."
    ) in robot.notes
    assert "Left out with 'F1' on 'hand': body 'f1' (4.18879 kg)." in robot.notes
    assert ends(read_text(tmp_path, text, tip="f2")) == "base to f2"


def test_the_only_site_of_a_hand_is_the_tip(tmp_path: Path) -> None:
    hand = f'<body name="hand" pos="0 0 0.1">{BALL}{FINGERS}<site name="grip" pos="0 0 0.2"/></body>'
    text = model_text(f'<body name="base">{body("a", body("b", body("c", hand)))}</body>')
    assert ends(read_text(tmp_path, text)) == "base to grip"


@pytest.mark.parametrize(
    ("arm", "tips"),
    [
        (body("a", body("b", FINGERS)), "tip='f1' (3 joints), tip='f2' (3 joints)"),
        (
            body("a", body("b", body("c", body("x", body("y", body("z"))) + body("w")))),
            "tip='z' (6 joints), tip='w' (4 joints)",
        ),
    ],
)
def test_a_fork_that_is_no_hand_is_a_choice(arm: str, tips: str, tmp_path: Path) -> None:
    last = "b" if "FB" not in arm and '"c"' not in arm else "c"
    column = model_text(f'<body name="base">{arm}</body>').index(f'<body name="{last}"') + 1
    assert refused(tmp_path, model_text(f'<body name="base">{arm}</body>')) == (
        f"robot.xml:1:{column}: the robot forks at '{last}'; choose one arm: {tips}"
    )


def test_unknown_names_are_guessed(tmp_path: Path) -> None:
    text = arm_text(2, '<site name="flange"/>')
    assert refused(tmp_path, text, base="bose", tip="flnge") == (
        "robot.xml:1:1: base: the file has no body 'bose'. Did you mean 'base'? "
        "Its bodies: 'world', 'base', 'link_1', 'link_2'\n"
        "robot.xml:1:1: tip: the file has no site or body 'flnge'. Did you mean 'flange'? "
        "Its bodies: 'world', 'base', 'link_1', 'link_2'; its sites: 'flange'"
    )


def test_a_tip_must_be_below_the_base(tmp_path: Path) -> None:
    text = model_text(f'<body name="base">{body("a", body("b"))}</body><body name="shelf"/>')
    assert refused(tmp_path, text, base="b", tip="a").endswith(
        "the tip 'a' is not below the base 'b'; 'b' is below 'a': exchange base and tip"
    )
    assert refused(tmp_path, text, base="base", tip="shelf").endswith("the tip 'shelf' is not below the base 'base'")
    assert refused(tmp_path, text, tip="shelf").endswith(
        "no joint moves between the base 'shelf' and the tip 'shelf'"
    )
    column = text.index('<body name="b"') + 1
    assert refused(tmp_path, text, base="b") == f"robot.xml:1:{column}: no joint moves below the base 'b'"


def test_a_ball_joint_on_the_arm_is_refused_and_one_beside_it_is_not(tmp_path: Path) -> None:
    arm = body("a", body("s", body("b"), joint="ball"))
    text = model_text(f'<body name="base">{arm}</body>')
    column = text.index('<joint name="S"') + 1
    assert refused(tmp_path, text) == (
        f"robot.xml:1:{column}: joint[S]: a ball joint has no row in a table; choose a base or tip that leaves it out"
    )
    assert ends(read_text(tmp_path, text, tip="a")) == "base to a"
    assert ends(read_text(tmp_path, text, base="s")) == "s to b"


def test_a_place_in_an_included_file_is_named(tmp_path: Path) -> None:
    line = body("s", joint="ball")
    (tmp_path / "ball.xml").write_text(f"<x>\n{line}</x>")
    text = model_text('<body name="base"><include file="ball.xml"/></body>')
    assert refused(tmp_path, text) == (
        f"ball.xml:2:{line.index('<joint') + 1}: joint[S]: a ball joint has no row in a table; "
        "choose a base or tip that leaves it out"
    )
