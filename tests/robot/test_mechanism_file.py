"""Branches, closures, actuated joints and assemblies in robot files."""

from __future__ import annotations

import json
from typing import Any

import jsonschema
import numpy as np
import pytest

from dh2sim.errors import RobotError, RobotFileError
from dh2sim.robot.catalog import builtin_mechanisms, builtin_path
from dh2sim.robot.links import Pose
from dh2sim.robot.mechanism import AssemblySpec, BranchSpec, ClosureSpec, ClosureType
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.row import ActuatorType, Row
from dh2sim.robot.schema import json_schema
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.write import robot_file_text
from dh2sim.robot.yaml_tree import Report, compose
from tests.refusals import refusal

FOUR_BAR = """\
name: four_bar
convention: standard
units: {angle: deg, length: mm}
parameters: {ground: 2000}
joints:
  - {type: revolute, a: 600}
  - {type: revolute, a: 1800}
branches:
  rocker: {from: base_link, pose: {xyz: [ground, 0, 0], rpy: [0, 0, 10]}, joints: [{type: revolute, a: 1400}]}
closures:
  - {name: C, between: [dh_2, rocker/dh_1], type: revolute}
actuated: [joint_1]
assembly: {q: [70, -50, 100]}
"""


def _problems(text: str) -> list[str]:
    return refusal(RobotFileError, parse_robot, text, file="m.yaml").splitlines()


def _changed(old: str, new: str) -> list[str]:
    assert old in FOUR_BAR
    return _problems(FOUR_BAR.replace(old, new))


def test_a_mechanism_is_read_in_si_units() -> None:
    spec = parse_robot(FOUR_BAR)
    branch = spec.branches["rocker"]
    assert branch.origin == "base_link"
    assert branch.pose.xyz.tolist() == [2.0, 0.0, 0.0]
    assert branch.pose.rpy[2] == pytest.approx(np.radians(10))
    assert branch.rows[0].a == 1.4
    assert [row.name for row in spec.moving_rows] == ["joint_1", "joint_2", "rocker_joint_1"]
    [closure] = spec.closures
    assert (closure.name, closure.between, closure.type) == ("C", ("dh_2", "rocker/dh_1"), ClosureType.REVOLUTE)
    assert spec.actuated == ("joint_1",)
    assert spec.assembly is not None
    assert spec.assembly.q == pytest.approx(np.radians([70, -50, 100]), abs=1e-15)
    assert spec.is_mechanism


def test_joints_that_are_not_actuated_have_no_actuator() -> None:
    spec = parse_robot(FOUR_BAR)
    types = [row.actuator.type for row in spec.moving_rows]
    assert types == [ActuatorType.POSITION, ActuatorType.NONE, ActuatorType.NONE]


def test_a_serial_robot_has_none_of_it() -> None:
    spec = parse_robot("name: r\nconvention: standard\njoints: [{type: R, a: 1}]\n")
    assert (dict(spec.branches), spec.closures, spec.actuated, spec.assembly) == ({}, (), None, None)
    assert not spec.is_mechanism


def test_a_mechanism_is_written_and_read_as_the_same_one() -> None:
    spec = parse_robot(FOUR_BAR)
    text = robot_file_text(spec)
    again = parse_robot(text)
    assert robot_file_text(again) == text
    assert again.assembly is not None
    assert spec.assembly is not None
    assert again.assembly.q.tolist() == spec.assembly.q.tolist()
    assert again.actuated == spec.actuated
    assert [row.actuator.type for row in again.moving_rows] == [row.actuator.type for row in spec.moving_rows]
    assert again.branches["rocker"].pose.rpy.tolist() == spec.branches["rocker"].pose.rpy.tolist()
    assert again.closures[0].between == spec.closures[0].between


def test_a_mechanism_can_be_made_in_code() -> None:
    spec = RobotSpec(
        name="made",
        rows=(Row(type="revolute", a=0.6), Row(type="revolute", a=1.8)),  # type: ignore[arg-type]
        branches={
            "rocker": BranchSpec(
                origin="base_link",
                pose=Pose(xyz=np.array([2.0, 0, 0])),
                rows=(
                    Row(type="revolute", a=1.4),  # type: ignore[arg-type]
                ),
            )
        },
        closures=(ClosureSpec(between=("dh_2", "rocker/dh_1"), type="revolute"),),  # type: ignore[arg-type]
        actuated=("joint_1",),
        assembly=AssemblySpec(q=np.array([1.2, -0.9, 1.9])),
    )
    assert spec.closures[0].name == "closure_1"
    assert spec.moving_rows[2].name == "rocker_joint_1"
    with pytest.raises(RobotError, match=r"^closures\[0\].between\[1\]: unknown frame 'rocker/dh_7'"):
        RobotSpec(
            name="made",
            rows=spec.rows,
            branches=spec.branches,
            closures=(ClosureSpec(between=("dh_2", "rocker/dh_7"), type=ClosureType.FIXED),),
        )


def test_the_schema_takes_the_mechanisms_and_refuses_what_the_reader_refuses() -> None:
    schema = json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    assert builtin_mechanisms()
    for name in builtin_mechanisms():
        path = builtin_path(name)
        assert path is not None
        assert not list(validator.iter_errors(_plain(path.read_text(encoding="utf-8"))))
    wrong = _plain(FOUR_BAR)
    wrong["closures"][0]["between"] = ["dh_2"]
    wrong["closures"][0]["type"] = "ball"
    wrong["branches"]["rocker"]["from"] = 3
    assert len(list(validator.iter_errors(wrong))) == 3


def _plain(text: str) -> Any:
    from ruamel.yaml import YAML

    assert compose(text, Report("")) is not None
    return json.loads(json.dumps(YAML(typ="safe", pure=True).load(text)))


@pytest.mark.parametrize("name", builtin_mechanisms())
def test_mechanisms_that_come_with_dh2sim_are_found_by_name(name: str) -> None:
    assert load_robot(name).name == name


def test_an_unknown_frame_is_named_with_its_place() -> None:
    [problem] = _changed("dh_2, rocker", "dh_3, rocker")
    assert problem.startswith("m.yaml:11:25: closures[0].between[0]: unknown frame 'dh_3'. Did you mean 'dh_2'?")
    [problem] = _changed("from: base_link", "from: base")
    assert problem.startswith("m.yaml:9:18: branches.rocker.from: unknown frame 'base'. Did you mean 'base_link'?")


def test_branches_start_from_what_comes_before_them() -> None:
    later = (
        FOUR_BAR.replace("from: base_link", "from: next/dh_1")
        .replace("closures:", "  next: {from: dh_1, joints: [{type: revolute}]}\nclosures:")
        .replace("-50, 100", "-50, 100, 0")
    )
    assert _problems(later) == [
        "m.yaml:9:18: branches.rocker.from: 'next/dh_1' is of a branch that comes later; put 'next' before 'rocker'"
    ]
    circle = later.replace("from: dh_1", "from: rocker/dh_1")
    assert _problems(circle) == [
        "m.yaml:9:18: branches.rocker.from: branches start from each other in a circle: rocker -> next -> rocker"
    ]
    itself = FOUR_BAR.replace("from: base_link", "from: rocker/dh_1")
    assert _problems(itself) == [
        "m.yaml:9:18: branches.rocker.from: branches start from each other in a circle: rocker -> rocker"
    ]


def test_a_closure_is_between_two_frames_that_move_against_each_other() -> None:
    assert _changed("[dh_2, rocker/dh_1]", "[dh_2]") == [
        "m.yaml:11:24: closures[0].between: expected a list of 2 frames, found a list of 1"
    ]
    assert _changed("[dh_2, rocker/dh_1]", "[rocker/dh_0, dh_0]") == [
        "m.yaml:11:24: closures[0].between: no joint moves between 'rocker/dh_0' and 'dh_0': they close no loop"
    ]
    assert _changed("type: revolute}\nactuated", "type: ball}\nactuated") == [
        "m.yaml:11:51: closures[0].type: found 'ball'. Allowed: revolute, spherical, universal, cylindrical, "
        "prismatic, fixed"
    ]


def test_names_are_used_once() -> None:
    twice = FOUR_BAR.replace("actuated:", "  - {name: C, between: [dh_1, rocker/dh_1], type: spherical}\nactuated:")
    assert _problems(twice) == [
        "m.yaml:12:12: closures[1].name: duplicate closure name 'C'; closures[0] on line 11 has it already"
    ]
    assert _changed("[{type: revolute, a: 1400}]", "[{type: revolute, a: 1400, name: joint_2}]") == [
        "m.yaml:9:116: branches.rocker.joints[0].name: duplicate joint name 'joint_2'; joints[1] on line 7 has it "
        "already"
    ]
    assert _changed("{name: C,", "{name: joint_1,") == [
        "m.yaml:11:12: closures[0].name: 'joint_1' clashes with the joint 'joint_1'"
    ]
    assert _changed("[{type: revolute, a: 1400}]", "[{type: revolute, a: 1400, name: C_hinge}]") == [
        "m.yaml:11:12: closures[0].name: 'C' clashes with the joint 'C_hinge'; C_hinge is the name of a joint inside "
        "the closure"
    ]
    assert _changed("  rocker:", "  1rocker:")[0].startswith("m.yaml:9:3: branches: the name of a branch is made of")


def test_actuated_are_joints_that_move_each_once() -> None:
    assert _changed("[joint_1]", "[joint_1, joint_9, joint_1]") == [
        "m.yaml:12:21: actuated[1]: unknown joint 'joint_9'. Did you mean 'joint_2'? Joints: joint_1, joint_2, "
        "rocker_joint_1",
        "m.yaml:12:30: actuated[2]: 'joint_1' is named twice",
    ]
    assert _changed("a: 1800}", "a: 1800, actuator: {kp: 3}}") == [
        "m.yaml:7:31: joints[1].actuator: joint_2 is not among 'actuated', and takes no 'actuator'"
    ]


def test_an_assembly_has_a_number_for_each_moving_row_inside_its_limits() -> None:
    assert _changed("[70, -50, 100]", "[70, -50]") == [
        "m.yaml:13:15: assembly.q: expected 3 numbers, one for each moving row (joint_1, joint_2, rocker_joint_1), "
        "found a list of 2"
    ]
    assert _changed("a: 1800}", "a: 1800, limits: [-40, 40]}") == [
        "m.yaml:13:20: assembly.q[1]: -50.0 is outside the limits of joint_2: -40.0 to 40.0"
    ]
    [problem] = _problems("name: r\nconvention: standard\njoints: [{type: R, a: 1}]\nassembly: {q: [1]}\n")
    assert problem == "m.yaml:4:1: assembly: there is nothing to assemble: the robot has no closures"


def test_all_problems_are_reported_at_once() -> None:
    text = FOUR_BAR.replace("from: base_link", "from: base").replace("[joint_1]", "[nobody]").replace("-50, 100", "5")
    assert [problem.split(": ")[1] for problem in _problems(text)] == [
        "branches.rocker.from",
        "actuated[0]",
        "assembly.q",
    ]


def test_a_mechanism_has_no_more_rows_than_formats_hold() -> None:
    rows = ", ".join(["{type: revolute, a: 1}"] * 300)
    branch = f"branches: {{b: {{from: dh_1, joints: [{rows}]}}}}"
    [problem] = _problems(f"name: r\nconvention: standard\njoints: [{rows}]\n{branch}\n")
    assert problem == "m.yaml:4:11: branches: the main chain and the branches have 600 rows; at most 494 are allowed"
