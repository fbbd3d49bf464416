"""Every value that is wrong by itself is reported with its place, what was found and what is allowed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dh2sim.robot.parts import inertia_problem
from tests.robot.files import MINIMAL, complaints, with_joint, with_keys

TOP = (
    "name, description, source, convention, units, parameters, base, tool, payload, gravity, joints, configurations, "
    "branches, closures, actuated, assembly, actuators"
)
JOINT = "name, type, convention, a, alpha, d, theta, beta, flip, limits, dynamics, link, actuator"
NUMBER = "expected a number or an expression in a string"
NAME = "a name is made of letters, digits, '_' and '-', starting with a letter"


def test_unknown_key_is_named_with_a_suggestion() -> None:
    assert complaints(with_joint("{type: revolute, alfa: 90}")) == [
        f"r.yaml:4:20: joints[0]: unknown key 'alfa'. Did you mean 'alpha'? Allowed keys: {JOINT}"
    ]


def test_unknown_key_without_a_likeness_lists_the_keys() -> None:
    assert complaints(with_keys("units: {foo: 1}\n")) == [
        "r.yaml:5:9: units: unknown key 'foo'. Allowed keys: angle, length"
    ]


def test_unknown_key_at_the_top_has_no_path() -> None:
    assert complaints(with_keys("configuration: {}\n")) == [
        f"r.yaml:5:1: unknown key 'configuration'. Did you mean 'configurations'? Allowed keys: {TOP}"
    ]


def test_a_misspelt_required_key_is_reported_once() -> None:
    assert complaints("nam: r\nconvention: standard\njoint:\n- {typ: revolute}\n") == [
        f"r.yaml:1:1: unknown key 'nam'. Did you mean 'name'? Allowed keys: {TOP}",
        f"r.yaml:3:1: unknown key 'joint'. Did you mean 'joints'? Allowed keys: {TOP}",
    ]


def test_missing_keys_are_reported_at_their_mapping() -> None:
    assert complaints("# a comment\ndescription: x\n") == [
        "r.yaml:2:1: missing key 'convention'",
        "r.yaml:2:1: missing key 'joints'",
        "r.yaml:2:1: missing key 'name'",
    ]
    assert complaints(with_joint("{a: 1, link: {inertia: {ixx: 1}, mesh: {scale: 1}}}")) == [
        "r.yaml:4:3: joints[0]: missing key 'type'",
        "r.yaml:4:26: joints[0].link.inertia: missing key 'iyy'",
        "r.yaml:4:26: joints[0].link.inertia: missing key 'izz'",
        "r.yaml:4:42: joints[0].link.mesh: missing key 'file'",
    ]


@pytest.mark.parametrize(("text", "found"), [("hello", "'hello'"), ("[1, 2]", "a list"), ("12", "12")])
def test_the_error_of_a_file_without_a_mapping_says_what_belongs_there(text: str, found: str) -> None:
    assert complaints(text) == [f"r.yaml:1:1: expected a mapping with the keys {TOP}, found {found}"]


@pytest.mark.parametrize(
    ("joint", "message"),
    [
        ("[1]", f"4:3: joints[0]: expected a mapping with the keys {JOINT}, found a list"),
        (
            "{type: revolut}",
            "4:10: joints[0].type: found 'revolut'. Did you mean 'revolute'? "
            "Allowed: revolute, continuous, prismatic, fixed",
        ),
        ("{type: 3}", "4:10: joints[0].type: found 3. Allowed: revolute, continuous, prismatic, fixed"),
        ("{type: }", "4:4: joints[0].type: found nothing. Allowed: revolute, continuous, prismatic, fixed"),
        (
            "{type: fixed, convention: craig}",
            "4:29: joints[0].convention: found 'craig', which is called 'modified' here. "
            "Allowed: standard, modified, hayati",
        ),
        ("{type: fixed, name: 2nd}", f"4:23: joints[0].name: {NAME}; found '2nd'"),
        ("{type: fixed, name: a b}", f"4:23: joints[0].name: {NAME}; found 'a b'"),
        ('{type: fixed, name: "a\\n"}', f"4:23: joints[0].name: {NAME}; found 'a\\n'"),
        ("{type: fixed, name: 12}", f"4:23: joints[0].name: {NAME}; found 12"),
        ("{type: fixed, name: ''}", f"4:23: joints[0].name: {NAME}; found ''"),
        ("{type: fixed, name: }", f"4:17: joints[0].name: {NAME}; found nothing"),
        (
            "{type: fixed, name: %s}" % ("a" * 101),
            "4:23: joints[0].name: a name has at most 100 characters, found 101",
        ),
        ("{type: fixed, a: true}", f"4:20: joints[0].a: {NUMBER}, found true"),
        ("{type: fixed, a: }", f"4:17: joints[0].a: {NUMBER}, found nothing"),
        ("{type: fixed, a: [1]}", f"4:20: joints[0].a: {NUMBER}, found a list"),
        ("{type: fixed, a: {b: 1}}", f"4:20: joints[0].a: {NUMBER}, found a mapping"),
        ("{type: fixed, a: .inf}", "4:20: joints[0].a: expected a finite number, found inf"),
        ("{type: fixed, a: -.inf}", "4:20: joints[0].a: expected a finite number, found -inf"),
        ("{type: fixed, a: .nan}", "4:20: joints[0].a: expected a finite number, found nan"),
        ("{type: fixed, a: nan}", "4:20: joints[0].a: 'nan' is not a finite number"),
        ("{type: fixed, a: 1 / 0}", "4:20: joints[0].a: in '1 / 0': division by zero"),
        ("{type: revolute, flip: 'yes'}", "4:26: joints[0].flip: expected true or false, found 'yes'"),
        ("{type: revolute, flip: 1}", "4:26: joints[0].flip: expected true or false, found 1"),
        (
            "{type: revolute, limits: 2}",
            "4:28: joints[0].limits: expected a mapping with the keys position, velocity, effort, "
            "acceleration, jerk, found 2",
        ),
        (
            "{type: revolute, limits: }",
            "4:20: joints[0].limits: expected a mapping with the keys position, velocity, effort, "
            "acceleration, jerk, found nothing",
        ),
        (
            "{type: revolute, limits: {position: 3}}",
            "4:39: joints[0].limits.position: expected a list of 2 numbers (lower, upper), found 3",
        ),
        (
            "{type: revolute, limits: {position: [1, 2, 3]}}",
            "4:39: joints[0].limits.position: expected a list of 2 numbers (lower, upper), found a list of 3",
        ),
        (
            "{type: revolute, limits: {position: [1, -1]}}",
            "4:39: joints[0].limits.position: the lower limit 1.0 is not below the upper limit -1.0",
        ),
        (
            "{type: revolute, limits: {position: [1, 1]}}",
            "4:39: joints[0].limits.position: the lower limit 1.0 is not below the upper limit 1.0",
        ),
        (
            "{type: revolute, limits: {velocity: 0}}",
            "4:39: joints[0].limits.velocity: must be greater than 0, found 0",
        ),
        ("{type: revolute, limits: {effort: -3}}", "4:37: joints[0].limits.effort: must be greater than 0, found -3"),
        (
            "{type: revolute, limits: {effort: 1 - 3}}",
            "4:37: joints[0].limits.effort: must be greater than 0, found '1 - 3' = -2.0",
        ),
        (
            "{type: revolute, dynamics: {damping: -1}}",
            "4:40: joints[0].dynamics.damping: must not be negative, found -1",
        ),
        (
            "{type: revolute, dynamics: {friction: -1}}",
            "4:41: joints[0].dynamics.friction: must not be negative, found -1",
        ),
        (
            "{type: revolute, dynamics: {armature: -0.1}}",
            "4:41: joints[0].dynamics.armature: must not be negative, found -0.1",
        ),
        ("{type: fixed, link: {mass: -1}}", "4:30: joints[0].link.mass: must not be negative, found -1"),
        (
            "{type: revolute, link: {mass: 0}}",
            "4:33: joints[0].link.mass: joint_1 would move nothing that has mass; 0 is for links between others, "
            "or before a tool that has a mass",
        ),
        (
            "{type: fixed, link: {mass: 0, com: [0, 0, 1]}}",
            "4:33: joints[0].link.com: what has a mass of 0 has no 'com'",
        ),
        ("{type: fixed, link: {density: -1}}", "4:33: joints[0].link.density: must be greater than 0, found -1"),
        ("{type: fixed, link: {radius: 0}}", "4:32: joints[0].link.radius: must be greater than 0, found 0"),
        (
            "{type: fixed, link: {com: [0, 0]}}",
            "4:29: joints[0].link.com: expected a list of 3 numbers (x, y, z), found a list of 2",
        ),
        ("{type: fixed, link: {com: [0, 0, ~]}}", f"4:36: joints[0].link.com[2]: {NUMBER}, found nothing"),
        (
            "{type: fixed, link: {color: [1, 1]}}",
            "4:31: joints[0].link.color: expected a list of 3 or 4 numbers (red, green, blue, alpha), "
            "found a list of 2",
        ),
        (
            "{type: fixed, link: {color: [1, 255, 0]}}",
            "4:35: joints[0].link.color[1]: must be from 0 to 1, found 255",
        ),
        (
            "{type: fixed, link: {color: [1, -0.5, 0]}}",
            "4:35: joints[0].link.color[1]: must be from 0 to 1, found -0.5",
        ),
        (
            "{type: fixed, link: {inertia: {ixx: 1, iyy: 1, izz: -1}}}",
            "4:33: joints[0].link.inertia: not positive definite: the principal moments are -1, 1, 1",
        ),
        (
            "{type: fixed, link: {inertia: {ixx: 0, iyy: 0, izz: 0}}}",
            "4:33: joints[0].link.inertia: not positive definite: the principal moments are 0, 0, 0",
        ),
        (
            "{type: fixed, link: {inertia: {ixx: 1, iyy: 1, izz: 1, ixy: 2}}}",
            "4:33: joints[0].link.inertia: not positive definite: the principal moments are -1, 1, 3",
        ),
        (
            "{type: fixed, link: {inertia: {ixx: 1, iyy: 1, izz: 2.1}}}",
            "4:33: joints[0].link.inertia: no body has the principal moments 1, 1, 2.1: two make less than the third",
        ),
        ("{type: revolute, actuator: {kp: 0}}", "4:35: joints[0].actuator.kp: must be greater than 0, found 0"),
        ("{type: revolute, actuator: {kv: -1}}", "4:35: joints[0].actuator.kv: must not be negative, found -1"),
        (
            "{type: revolute, actuator: {type: pid}}",
            "4:37: joints[0].actuator.type: found 'pid'. Allowed: position, velocity, motor, none",
        ),
    ],
)
def test_a_wrong_value_in_a_row_is_reported(joint: str, message: str) -> None:
    assert complaints(with_joint(joint)) == [f"r.yaml:{message}"]


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("description: 12\n", "5:14: description: expected text, found 12; put it in quotes"),
        ("source: [a]\n", "5:9: source: expected text, found a list"),
        ("description:\n", "5:1: description: expected text, found nothing"),
        ("units: {angle: degrees}\n", "5:16: units.angle: found 'degrees'. Did you mean 'deg'? Allowed: rad, deg"),
        ("units: {length: km}\n", "5:17: units.length: found 'km'. Did you mean 'm'? Allowed: m, mm, cm, in"),
        ("base: {xyz: [1, 2]}\n", "5:13: base.xyz: expected a list of 3 numbers (x, y, z), found a list of 2"),
        ("tool: {rpy: 3}\n", "5:13: tool.rpy: expected a list of 3 numbers (roll, pitch, yaw), found 3"),
        (
            "tool: {colour: [1, 1, 1]}\n",
            "5:8: tool: unknown key 'colour'. Did you mean 'color'? Allowed keys: xyz, rpy, mass, com, inertia, "
            "color, shape, mesh",
        ),
        (
            "tool: {com: [0, 0, 1]}\n",
            "5:8: tool.com: a tool that has a 'com' needs a 'mass', or a 'shape' to estimate it from",
        ),
        ("tool: {mass: 0, com: [0, 0, 1]}\n", "5:17: tool.com: what has a mass of 0 has no 'com'"),
        ("tool: {shape: {radius: 1}}\n", "5:15: tool.shape: missing key 'type'"),
        ("tool: {shape: {type: sphere}}\n", "5:15: tool.shape: missing key 'radius', of a sphere"),
        (
            "tool: {shape: {type: box, size: [1, 2, 3], radius: 1}}\n",
            "5:44: tool.shape.radius: a box takes no 'radius'; its sizes: size",
        ),
        (
            "tool: {shape: {type: box, size: [1, 0, 3]}}\n",
            "5:37: tool.shape.size[1]: must be greater than 0, found 0",
        ),
        ("payload: -1\n", "5:10: payload.mass: must not be negative, found -1"),
        ("payload: {mass: 1, com: 2}\n", "5:25: payload.com: expected a list of 3 numbers (x, y, z), found 2"),
        ("payload: [1]\n", "5:10: payload: expected a mapping with the keys mass, com, found a list"),
        ("gravity: [0, 0, x]\n", "5:17: gravity[2]: unknown name 'x'. Known names: pi"),
        ("gravity:\n", "5:1: gravity: expected a list of 3 numbers (x, y, z), found nothing"),
        ("configurations: [1]\n", "5:17: configurations: expected a mapping, found a list"),
        ("configurations: {home: 1}\n", "5:24: configurations.home: expected a list, found 1"),
        ("actuators: position\n", "5:12: actuators: expected a mapping with the keys type, kp, kv, found 'position'"),
    ],
)
def test_a_wrong_value_at_the_top_of_a_robot_file_is_reported(keys: str, message: str) -> None:
    assert complaints(with_keys(keys)) == [f"r.yaml:{message}"]


def test_joints_must_be_a_list_that_is_not_empty() -> None:
    head = "name: r\nconvention: standard\n"
    assert complaints(head + "joints: []\n") == [
        "r.yaml:3:9: joints: the list is empty; at least one entry is needed"
    ]
    assert complaints(head + "joints: {a: 1}\n") == ["r.yaml:3:9: joints: expected a list, found a mapping"]
    assert complaints(head + "joints:\n") == ["r.yaml:3:1: joints: expected a list, found nothing"]


def test_odd_keys_stand_in_quotes_in_a_path() -> None:
    assert complaints(with_keys("configurations: {'x y': 1}\n"))[1:] == [
        "r.yaml:5:25: configurations['x y']: expected a list, found 1"
    ]


def test_a_flat_plate_has_an_inertia_that_a_body_can_have() -> None:
    assert complaints(with_joint("{type: fixed, link: {inertia: {ixx: 0.1, iyy: 0.2, izz: 0.3}}}")) == []


def test_inertias_of_any_size_are_checked_without_overflow() -> None:
    huge = "{type: fixed, link: {inertia: {ixx: 1e50, iyy: 1e50, izz: 1e50, ixy: 1e49}}}"
    assert complaints(with_joint(huge)) == []
    tiny = huge.replace("e50", "e-13").replace("e49", "e-14")
    assert complaints(with_joint(tiny)) == []
    assert complaints(with_joint(tiny.replace("1e-13", "1e-20").replace("1e-14", "0"))) == [
        "r.yaml:4:33: joints[0].link.inertia: the principal moments must be at least 2e-14 kg·m², "
        "found 1e-20, 1e-20, 1e-20"
    ]


def test_the_least_moment_may_be_rounded_where_the_others_are_far_greater() -> None:
    for seed in range(20):
        turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
        matrix = turn @ np.diag([2e-14, 8e-5, 8e-5]) @ turn.T
        assert inertia_problem((matrix + matrix.T) / 2) is None
    assert inertia_problem(np.diag([0.9e-14, 1e9, 1e9])) is not None
    assert inertia_problem(np.diag([1.9e-14, 1e-13, 1e-13])) is not None


def test_mesh_files_are_looked_for_beside_the_robot_file(tmp_path: Path) -> None:
    (tmp_path / "b.stl").write_bytes(b"")
    (tmp_path / "b.txt").write_bytes(b"")
    (tmp_path / "d.stl").mkdir()
    assert complaints(with_joint("{type: fixed, link: {mesh: {file: b.stl}}}"), tmp_path) == []
    place = "r.yaml:4:37: joints[0].link.mesh.file"
    for name, message in {
        "c.stl": f"file 'c.stl' not found in {tmp_path}",
        "d.stl": f"file 'd.stl' not found in {tmp_path}",
        "b.txt": "'b.txt' is not a mesh file that can be read; allowed: .stl, .obj, .ply, .glb, .dae",
        "12": "expected text, found 12; put it in quotes",
        "package://x/b.stl": f"file 'package://x/b.stl' not found in {tmp_path}",
    }.items():
        joint = f"{{type: fixed, link: {{mesh: {{file: {name}}}}}}}"
        assert complaints(with_joint(joint), tmp_path) == [f"{place}: {message}"]


def test_mesh_of_the_base_is_looked_for_too(tmp_path: Path) -> None:
    assert complaints(with_keys("base: {mesh: {file: b.obj, scale: 0}}\n"), tmp_path) == [
        f"r.yaml:5:21: base.mesh.file: file 'b.obj' not found in {tmp_path}",
        "r.yaml:5:35: base.mesh.scale: must be greater than 0, found 0",
    ]


def test_all_mistakes_of_a_robot_file_are_reported_in_its_order() -> None:
    text = """\
        name: 3r
        convention: standart
        parameters: {a: b, b: a}
        joints:
        - {type: revolute, alfa: a, limits: {position: [2, 1]}}
        - {type: continuous, limits: {position: [0, 1]}, foo: 1}
        - {type: fixed, flip: true, d: x}
        configurations: {home: [1]}
        """
    assert complaints(text) == [
        f"r.yaml:1:7: name: {NAME}; found '3r'",
        "r.yaml:2:13: convention: found 'standart'. Did you mean 'standard'? Allowed: standard, modified, hayati",
        "r.yaml:3:17: parameters.a: parameters need each other in a circle: a -> b -> a",
        f"r.yaml:5:20: joints[0]: unknown key 'alfa'. Did you mean 'alpha'? Allowed keys: {JOINT}",
        "r.yaml:5:48: joints[0].limits.position: the lower limit 2.0 is not below the upper limit 1.0",
        "r.yaml:6:31: joints[1].limits.position: a continuous joint has no position limits; "
        "make it revolute or remove them",
        f"r.yaml:6:50: joints[1]: unknown key 'foo'. Allowed keys: {JOINT}",
        "r.yaml:7:17: joints[2].flip: a fixed row does not move: it takes no 'flip'",
        "r.yaml:7:32: joints[2].d: unknown name 'x'. Known names: pi, a, b",
        "r.yaml:8:24: configurations.home: expected 2 numbers, one for each moving row (joint_1, joint_2), "
        "found a list of 1",
    ]


def test_the_smallest_file_is_right() -> None:
    assert complaints(MINIMAL) == []
