"""A robot made in code is checked as a file is, and holds what one that was read holds."""

from __future__ import annotations

import dataclasses
import math
from fractions import Fraction
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from dh2sim.errors import Dh2simError, RobotError
from dh2sim.robot.links import BaseSpec, LinkSpec, MeshSpec, Pose
from dh2sim.robot.row import ActuatorSpec, ActuatorType, Convention, Dynamics, JointType, Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import Units
from tests.robot.files import FULL, robot


def make(*rows: Any, **more: Any) -> RobotSpec:
    return RobotSpec(**{"name": "r", "rows": rows, **more})


def row(**values: Any) -> Row:
    return Row(**{"type": "revolute", **values})


def problems(*rows: Any, **more: Any) -> list[str]:
    """Return what is wrong with a robot, as a user sees it."""
    try:
        make(*rows, **more)
    except RobotError as error:
        return str(error).split("\n")
    return []


def test_a_robot_needs_a_name_and_rows_alone() -> None:
    spec = make(row(), Row(type="fixed"), name="small")  # type: ignore[arg-type]
    assert [one.name for one in spec.rows] == ["joint_1", "joint_2"]
    assert [one.type for one in spec.rows] == [JointType.REVOLUTE, JointType.FIXED]
    assert {one.convention for one in spec.rows} == {Convention.STANDARD}
    assert [one.actuator.type for one in spec.rows] == [ActuatorType.POSITION, ActuatorType.NONE]


def test_rows_have_the_convention_of_the_robot_unless_they_name_one() -> None:
    spec = make(row(), row(convention="standard"), convention="modified")
    assert [one.convention for one in spec.rows] == [Convention.MODIFIED, Convention.STANDARD]


def test_any_real_numbers_and_sequences_are_taken() -> None:
    first = row(a=1, alpha=np.float32(0.5), d=Fraction(1, 4), theta=np.int64(2), limits=Limits(position=[-1, 2]))  # type: ignore[arg-type]
    link = LinkSpec(mass=np.float64(2), com=[1, 2, 3], inertia=np.eye(3), color=[1, 0, 0])  # type: ignore[arg-type]
    spec = make(first, row(link=link, flip=np.True_), tool=Pose(xyz=(0, 0, 1)), configurations={"home": [0, 1]})  # type: ignore[arg-type]
    one, other = spec.rows
    assert [one.a, one.alpha, one.d, one.theta] == [1.0, 0.5, 0.25, 2.0]
    assert all(type(number) is float for number in (one.a, one.alpha, one.d, one.theta, other.link.mass))
    assert one.limits.position == (-1.0, 2.0)
    assert other.link.color == (1.0, 0.0, 0.0, 1.0)
    assert other.flip is True
    assert other.link.com is not None
    arrays = [other.link.com, spec.tool.xyz, spec.configurations["home"]]
    assert all(array.dtype == np.float64 and not array.flags.writeable for array in arrays)


def test_a_robot_that_was_read_is_right_when_it_is_made_again() -> None:
    spec = robot(FULL)
    again = dataclasses.replace(spec, name="again")
    assert all(one is other for one, other in zip(spec.rows, again.rows, strict=True))
    assert again.configurations is spec.configurations


def test_all_problems_are_reported_at_once_with_their_paths() -> None:
    wrong = problems(
        row(alpha=math.nan, name="2nd"),
        row(type="screw", limits=Limits(position=(2, 1), velocity=0)),
        row(link=LinkSpec(mass=-1, com=np.zeros(2), mesh=MeshSpec(file=Path("b.txt")))),
        base=BaseSpec(pose=Pose(xyz=np.array([0, 0, math.inf]))),
        name="a b",
    )
    name = "a name is made of letters, digits, '_' and '-', starting with a letter; found"
    assert wrong == [
        f"name: {name} 'a b'",
        "base.xyz[2]: expected a finite number, found inf",
        f"joints[0].name: {name} '2nd'",
        "joints[0].alpha: expected a finite number, found nan",
        "joints[1].type: found 'screw'. Allowed: revolute, continuous, prismatic, fixed",
        "joints[1].limits.position: the lower limit 2.0 is not below the upper limit 1.0",
        "joints[1].limits.velocity: must be greater than 0, found 0",
        "joints[2].link.mass: must not be negative, found -1",
        "joints[2].link.com: expected a list of 3 numbers (x, y, z), found a list of 2",
        "joints[2].link.mesh.file: 'b.txt' is not a mesh file that can be read; "
        "allowed: .stl, .obj, .ply, .glb, .dae",
    ]


@pytest.mark.parametrize(
    ("rows", "more", "message"),
    [
        ((), {}, "joints: the list is empty; at least one entry is needed"),
        (("x",), {}, "joints[0]: expected a Row, found 'x'"),
        ((row(),), {"rows": 3}, "joints: expected a list, found 3"),
        ((row(a="1"),), {}, "joints[0].a: expected a number, found '1'"),
        ((row(a=True),), {}, "joints[0].a: expected a number, found true"),
        ((row(a=1j),), {}, "joints[0].a: expected a number, found a complex"),
        ((row(limits=3),), {}, "joints[0].limits: expected a Limits, found 3"),
        ((row(link=None),), {}, "joints[0].link: expected a LinkSpec, found nothing"),
        ((row(flip=1),), {}, "joints[0].flip: expected true or false, found 1"),
        ((row(dynamics=Dynamics(armature=-1)),), {}, "joints[0].dynamics.armature: must not be negative, found -1"),
        (
            (row(link=LinkSpec(inertia=np.ones(3))),),
            {},
            "joints[0].link.inertia: expected a 3 × 3 matrix, found a list",
        ),
        (
            (row(link=LinkSpec(inertia=np.triu(np.ones((3, 3))))),),
            {},
            "joints[0].link.inertia: the matrix is not symmetric",
        ),
        (
            (row(link=LinkSpec(inertia=np.diag([1.0, 1.0, 3.0]))),),
            {},
            "joints[0].link.inertia: no body has the principal moments 1, 1, 3: two make less than the third",
        ),
        ((row(link=LinkSpec(color=(1, 2, 0, 1))),), {}, "joints[0].link.color[1]: must be from 0 to 1, found 2"),
        (
            (row(name="a"), row(name="a")),
            {},
            "joints[1].name: duplicate joint name 'a'; joints[0] has it already",
        ),
        (
            (row(name="joint_2"), row()),
            {},
            "joints[1]: duplicate default joint name 'joint_2'; joints[0] has it already",
        ),
        (
            (Row(type=JointType.FIXED, limits=Limits(effort=1.0)),),
            {},
            "joints[0].limits: a fixed row does not move: it takes no 'limits'",
        ),
        (
            (Row(type=JointType.CONTINUOUS, limits=Limits(position=(0.0, 1.0))),),
            {},
            "joints[0].limits.position: a continuous joint has no position limits; make it revolute or remove them",
        ),
        (
            (row(actuator=ActuatorSpec(type="motor", kp=3.0)),),  # type: ignore[arg-type]
            {},
            "joints[0].actuator.kp: an actuator of type 'motor' takes no kp; kp is for position",
        ),
        (
            (row(beta=0.5),),
            {},
            "joints[0].beta: a standard row takes no 'beta', the second twist of a row of 'convention: hayati'",
        ),
        (
            (row(),),
            {"configurations": {"home": [1, 2]}},
            "configurations.home: expected 1 numbers, one for each moving row (joint_1), found a list of 2",
        ),
        (
            (row(limits=Limits(position=(-1.0, 1.0))),),
            {"configurations": {"home": [2]}},
            "configurations.home[0]: 2.0 is outside the limits of joint_1: -1.0 to 1.0",
        ),
        ((row(),), {"base": BaseSpec(pose="x")}, "base.pose: expected a Pose, found 'x'"),  # type: ignore[arg-type]
        ((row(),), {"gravity": None}, "gravity: expected a list of 3 numbers (x, y, z), found nothing"),
        (
            (row(),),
            {"parameters": {"pi": 3}},
            "parameters: a parameter cannot be named 'pi'; expressions know the name already",
        ),
        ((row(),), {"source_file": "r.yaml"}, "source_file: expected a SourceFile, found 'r.yaml'"),
        (
            (row(),),
            {"units": Units(angle=cast("Any", "grad"))},
            "units.angle: found 'grad'. Did you mean 'rad'? Allowed: rad, deg",
        ),
        (
            (row(),),
            {"convention": "craig"},
            "convention: found 'craig', which is called 'modified' here. Allowed: standard, modified, hayati",
        ),
    ],
)
def test_what_is_wrong_is_reported_in_the_words_of_files(rows: Any, more: Any, message: str) -> None:
    assert problems(*rows, **more) == [message]


def test_the_error_is_one_of_dh2sim_and_of_values() -> None:
    with pytest.raises(ValueError, match=r"joints: the list is empty") as error:
        make()
    assert isinstance(error.value, Dh2simError)


def test_a_number_that_is_wrong_in_si_units_alone_is_reported_at_its_place() -> None:
    limits = "[1004, 1004.0000000000001]"  # two numbers of millimetres that are one of metres
    text = (
        "name: r\nconvention: standard\nunits: {length: mm}\n"
        f"joints: [{{type: prismatic, a: 1, limits: {{position: {limits}}}}}]\n"
    )
    with pytest.raises(RobotError) as error:
        robot(text)
    assert str(error.value) == (
        "r.yaml:4:53: joints[0].limits.position: the lower limit 1.004 is not below the upper limit 1.004 "
        "once converted to SI units"
    )


def test_every_robot_has_the_configurations_zero_and_home() -> None:
    spec = make(row(limits=Limits(position=(0.5, 1.0))), row())
    named = {name: q.tolist() for name, q in spec.named_configurations.items()}
    assert named == {"home": [0.5, 0.0], "zero": [0.0, 0.0]}
    given = dataclasses.replace(spec, configurations={"home": np.array([0.75, 0.1]), "bent": np.array([0.6, 1])})
    named = {name: q.tolist() for name, q in given.named_configurations.items()}
    assert named == {"home": [0.75, 0.1], "zero": [0.0, 0.0], "bent": [0.6, 1.0]}
