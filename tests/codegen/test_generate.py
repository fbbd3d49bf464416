from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim import Dh2simError, Fixed, LinkSpec, Revolute, Robot
from dh2sim.codegen.generate import generate_code
from dh2sim.errors import MeshError, ModelError
from dh2sim.kinematics.forward import geometric_jacobian
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.robot.links import MeshSpec
from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.codegen.running import python_functions
from tests.sample_robots import NAMES, robot
from tests.strategies import robots_with_joint_vectors

ALL = ("pose", "jacobian", "inverse-dynamics")


def size(spec: RobotSpec, q: Array) -> float:
    return max(1.0, float(np.abs(table_frame_poses(spec, q)[..., :3, 3]).max()))


@given(robots_with_joint_vectors(max_rows=8, must_move=False))
def test_code_of_any_robot_gives_the_tables_poses(drawn: tuple[RobotSpec, Array]) -> None:
    spec, q = drawn
    allowed = 1e-12 * size(spec, q)
    functions = python_functions(generate_code(spec, "python", ["pose", "jacobian"]))
    numpy = python_functions(generate_code(spec, "numpy", ["pose", "jacobian"]))
    T, J = table_tool_pose(spec, q), geometric_jacobian(spec, q)
    np.testing.assert_allclose([functions["fk"](row) for row in q], T, rtol=0, atol=allowed)
    np.testing.assert_allclose(numpy["fk"](q), T, rtol=0, atol=allowed)
    np.testing.assert_allclose(numpy["jacobian"](q), J, rtol=0, atol=allowed)
    found = np.array([functions["jacobian"](row) for row in q]).reshape(J.shape)
    np.testing.assert_allclose(found, J, rtol=0, atol=allowed)


@pytest.mark.parametrize("name", NAMES)
def test_code_of_a_catalogue_robot_gives_the_tables_poses(name: str) -> None:
    spec = robot(name)
    q = np.random.default_rng(5).uniform(-3, 3, (20, len(spec.moving_rows)))
    fk = python_functions(generate_code(spec, "numpy", "pose"))["fk"]
    np.testing.assert_allclose(fk(q), table_tool_pose(spec, q), rtol=0, atol=1e-12 * size(spec, q))


def test_numpy_code_takes_batches_of_any_shape_and_lists() -> None:
    functions = python_functions(generate_code(robot("stanford"), "numpy", ALL))
    q = np.random.default_rng(6).uniform(-1, 1, (2, 3, 6))
    T, J = functions["fk"](q), functions["jacobian"](q)
    assert (T.shape, J.shape) == ((2, 3, 4, 4), (2, 3, 6, 6))
    assert (T[1, 2] == functions["fk"](q[1, 2].tolist())).all()
    assert (J[0, 1] == functions["jacobian"](q[0, 1])).all()
    assert functions["fk"](np.zeros((0, 6))).shape == (0, 4, 4)
    forces = functions["inverse_dynamics"](q, q[0, 0], np.zeros((3, 6)))
    assert forces.shape == (2, 3, 6)
    assert (forces[1, 2] == functions["inverse_dynamics"](q[1, 2], q[0, 0], np.zeros(6))).all()


def test_python_code_takes_any_sequence_of_the_right_length_and_returns_plain_lists() -> None:
    functions = python_functions(generate_code(robot("planar_2r"), "python", ALL))
    for q in ([1, 2], (1.0, 2.0), np.array([1, 2]), range(1, 3)):
        T = functions["fk"](q)
        assert functions["fk"]([1.0, 2.0]) == T
        assert {type(value) for row in T for value in row} == {float}
    with pytest.raises(ValueError, match="values to unpack"):
        functions["fk"]([1.0, 2.0, 3.0])


def test_code_of_a_robot_without_joints_or_with_one_runs() -> None:
    still = Robot([Fixed(a=0.3, alpha=0.4), Fixed(d=0.2)], base=(1.0, 2.0, 3.0))
    functions = python_functions(still.code("python", ["pose", "jacobian"]))
    np.testing.assert_allclose(functions["fk"]([]), still.fk([]), rtol=0, atol=1e-15)
    assert functions["jacobian"]([]) == [[]] * 6
    one = Robot([Revolute(a=0.3, alpha=0.4)])
    assert python_functions(one.code("numpy", ALL))["inverse_dynamics"]([0.1], [0.2], [0.3]).shape == (1,)


def test_the_header_says_what_the_code_is() -> None:
    spec = robot("puma560")
    text = generate_code(spec, "python", ALL)
    header = " ".join(line.removeprefix("#").strip() for line in text.split("\n\n")[0].splitlines())
    assert spec.source_file is not None
    assert f"puma560: made by dh2sim from puma560.yaml (SHA-256 {spec.source_file.sha256})." in header
    assert "Convention: modified. Units: rad, m, s, kg, N, N m." in header
    assert "joint_1 (rad), joint_2 (rad)" in header
    assert "Estimated from the shapes, not measured: mass, com, inertia of link_1 to link_6." in header
    assert "fk: 40 multiplications, 20 additions, 12 sines and cosines; at most " in header
    assert "Inverse dynamics: links, tool, gravity and armature; no friction, damping or payload." in header
    assert "made by dh2sim from a robot made in code" in Robot([Revolute()]).code()
    assert "Inverse dynamics" not in generate_code(spec, "python", "pose")


@pytest.mark.parametrize("language", ["python", "numpy", "c", "cpp", "matlab", "javascript"])
def test_a_comment_holds_whatever_a_file_is_called(language: str) -> None:
    text = "name: odd\nconvention: standard\njoints: [{type: revolute, a: 0.3}]"
    file = '*/ int x; /* \n"""\n%}\x1b[31m é \\'
    code = generate_code(parse_robot(text, file=file), language, "pose")
    plain = generate_code(parse_robot(text, file="odd.yaml"), language, "pose")
    assert code.isascii()
    assert "\x1b" not in code
    assert len(code.splitlines()) == len(plain.splitlines())
    assert code.splitlines()[4:] == plain.splitlines()[4:]
    if language in ("c", "cpp"):
        assert re.findall(r"/\*|\*/", code) == re.findall(r"/\*|\*/", plain)


@pytest.mark.parametrize("language", ["python", "numpy", "c", "cpp", "matlab", "javascript"])
def test_the_same_robot_gives_the_same_code(language: str) -> None:
    assert generate_code(robot("rpr"), language, ALL) == generate_code(
        build_model(robot("rpr")), language, reversed(ALL)
    )


def test_masses_are_needed_for_inverse_dynamics_alone() -> None:
    spec = Robot([Revolute(a=0.3, link=LinkSpec(mesh=MeshSpec(file=Path("nowhere.stl"))))]).spec
    assert "def fk" in generate_code(spec)
    with pytest.raises(MeshError, match=r"nowhere\.stl"):
        generate_code(spec, what="inverse-dynamics")


def test_unknown_words_are_refused_with_what_is_allowed() -> None:
    spec = robot("rpr")
    with pytest.raises(Dh2simError, match=r"unknown language 'pyton'.* Did you mean 'python'"):
        generate_code(spec, "pyton", "pose")
    with pytest.raises(Dh2simError, match=r"unknown code 'poses'.* Did you mean 'pose'"):
        generate_code(spec, what=["jacobian", "poses"])
    with pytest.raises(Dh2simError, match="choose at least one of pose, jacobian, inverse-dynamics"):
        generate_code(spec, what=[])


@given(st.sampled_from(["pose", "jacobian", "inverse-dynamics"]), robots_with_joint_vectors(max_rows=3))
def test_each_function_can_be_had_alone(what: str, drawn: tuple[RobotSpec, Array]) -> None:
    spec, q = drawn
    try:
        model = build_model(spec)
    except ModelError:
        return  # nothing to move
    names = python_functions(generate_code(model, "python", what))
    wanted = {"pose": "fk", "jacobian": "jacobian", "inverse-dynamics": "inverse_dynamics"}
    assert [name for name in wanted.values() if name in names] == [wanted[what]]
    arguments = [q[0].tolist()] * (3 if what == "inverse-dynamics" else 1)
    assert np.isfinite(np.array(names[wanted[what]](*arguments))).all()


PARAMETERS = """\
name: letters
convention: standard
units: {{length: {unit}}}
parameters: {{reach: {reach}, half: "reach / 2", factor: 3}}
joints:
  - {{type: revolute, a: half, alpha: 0.4}}
  - {{type: revolute, a: "2 * reach - 0.1 * half + {own}", d: "{power}"}}
  - {{type: prismatic, d: "half + reach", alpha: 1.2, flip: true}}
tool: {{xyz: [0, 0, "reach - half"]}}
"""


@pytest.mark.parametrize(
    ("unit", "reach", "own", "power"), [("m", 0.5, 0.25, "factor * half ** 2"), ("mm", 500, 250, "sqrt(half)")]
)
def test_lengths_follow_the_parameters_that_they_are_made_of(unit: str, reach: float, own: float, power: str) -> None:
    spec = parse_robot(PARAMETERS.format(unit=unit, reach=reach, own=own, power=power))
    text = generate_code(spec, "python", ["pose", "jacobian"])
    assert "reach = 0.5  # m" in text
    q = [0.3, -0.4, 0.2]
    np.testing.assert_allclose(python_functions(text)["fk"](q), table_tool_pose(spec, q), rtol=0, atol=1e-14)
    longer = python_functions(text.replace("reach = 0.5 ", "reach = 0.7 ").replace("half = 0.25 ", "half = 0.35 "))
    if unit == "m":
        changed = parse_robot(PARAMETERS.format(unit=unit, reach=0.7, own=own, power=power))
        np.testing.assert_allclose(longer["fk"](q), table_tool_pose(changed, q), rtol=0, atol=1e-14)
    else:
        assert "d2 = " in text, "a square root of mm is a number in m"


@pytest.mark.parametrize("twist", [1e-12, 1e-9, 1e-6, 1e-3, np.pi - 1e-9, np.pi])
def test_twists_next_to_none_or_half_a_turn_are_kept(twist: float) -> None:
    table = [
        Revolute(a=0.3, alpha=0.7),
        Fixed(theta=np.pi, alpha=0.7 + twist),
        Revolute(convention="hayati", alpha=twist, beta=1e-7),
    ]
    arm = Robot(table, tool=(1000.0, 0.0, 1000.0))
    q = np.random.default_rng(14).uniform(-3, 3, (20, 2))
    fk = python_functions(arm.code("numpy"))["fk"]
    np.testing.assert_allclose(fk(q), table_tool_pose(arm.spec, q), rtol=0, atol=2e-12)


def test_a_table_that_leads_far_from_the_arm_and_back_has_code() -> None:
    # a calibrated arm of three nearly parallel axes
    table = [
        Revolute(d=0.1519, alpha=1.5707),
        Revolute(d=574.3, a=-0.2436, alpha=1.2e-3),
        Revolute(d=-598.1, a=-0.2132, alpha=-2.2e-3),
        Revolute(d=23.93, alpha=1.5708),
    ]
    arm = Robot(table)
    q = np.random.default_rng(15).uniform(-3, 3, (20, 4))
    functions = python_functions(arm.code("numpy", ALL))
    np.testing.assert_allclose(functions["fk"](q), table_tool_pose(arm.spec, q), rtol=0, atol=1e-12 * 600)


def test_long_chains_and_many_fixed_rows_take_no_longer_than_they_must() -> None:
    fixed = [Fixed(a=0.1, alpha=0.3, d=0.1, theta=0.2)] * 60
    twisted = Robot([Revolute(), *fixed, Revolute(), *fixed])
    snake = Robot([Revolute(a=0.05, d=0.01)] * 100)
    for arm in (twisted, snake):
        q = np.random.default_rng(16).uniform(-3, 3, (3, arm.n))
        fk = python_functions(arm.code("numpy"))["fk"]
        np.testing.assert_allclose(fk(q), table_tool_pose(arm.spec, q), rtol=0, atol=1e-12 * size(arm.spec, q))
