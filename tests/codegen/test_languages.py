"""Code in every language, compiled and run, against the table and the code in Python."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dh2sim import Continuous, Fixed, LinkSpec, Prismatic, Revolute, Robot
from dh2sim.codegen.generate import generate_code
from dh2sim.codegen.languages import Language, program_text
from dh2sim.codegen.program import Function, Program, identifier
from dh2sim.kinematics.forward import geometric_jacobian
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.kinematics.trace import Trace
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from tests.codegen.running import (
    Call,
    c_results,
    cpp_results,
    javascript_results,
    numpy_results,
    octave_results,
    python_functions,
    python_results,
)
from tests.sample_robots import model

ALL = ("pose", "jacobian", "inverse-dynamics")
ROBOTS = ("puma560", "stanford", "franka_panda", "arm_5r", "scara", "ssrms", "odd", "return", "std", "still")

SLIDE = Robot([Prismatic(theta=0.7, alpha=1.1, flip=True)], name="return", base=(0.1, 0.2, 0.3))
"""Its pose does not depend on much, and its name is a word of most languages."""
PARALLEL = Robot(
    [
        Revolute(a=0.4),
        Fixed(a=0.1, alpha=np.pi),
        Continuous(a=0.3, theta=0.3, flip=True),
        Prismatic(),
        Revolute(d=0.1),
    ],
    name="std",
)
STILL = Robot([Fixed(a=0.3, alpha=0.4), Fixed(d=0.2, link=LinkSpec(mass=1.0))], name="still", base=(1.0, 2.0, 3.0))
"""Without a joint."""


def built(name: str) -> RobotModel:
    own = {"return": SLIDE, "std": PARALLEL, "still": STILL}
    return own[name].model if name in own else model(name)


def results(language: Language, text: str, prefix: str, call: Call) -> list[Array]:
    match language:
        case Language.PYTHON:
            return python_results(text, call)
        case Language.NUMPY:
            return numpy_results(text, call)
        case Language.C:
            return c_results(text, prefix.rstrip("_"), call)
        case Language.CPP:
            return cpp_results(text, prefix, call)
        case Language.MATLAB:
            return octave_results(text, prefix, call)
        case Language.JAVASCRIPT:
            return javascript_results(text, call)


@pytest.mark.slow
@pytest.mark.parametrize("language", Language)
@pytest.mark.parametrize("name", ROBOTS)
def test_code_compiles_without_a_warning_and_equals_the_table(name: str, language: Language, tmp_path: Path) -> None:
    robot = built(name)
    generator = np.random.default_rng(11)
    n = robot.chain.n
    q, qd, qdd = (generator.uniform(-3, 3, (10, n)) for _ in range(3))
    call = Call(functions=("fk", "jacobian", "inverse_dynamics"), arguments=(q, qd, qdd), folder=tmp_path)
    prefix = {"return": "return_", "std": "std" if language is Language.MATLAB else "std_"}.get(name, name)
    T, J, tau = results(language, generate_code(robot, language, ALL), prefix, call)
    reach = max(1.0, float(np.abs(table_frame_poses(robot.spec, q)[..., :3, 3]).max()))
    np.testing.assert_allclose(T, table_tool_pose(robot.spec, q), rtol=0, atol=1e-12 * reach)
    np.testing.assert_allclose(J, geometric_jacobian(robot.spec, q), rtol=0, atol=1e-12 * reach)
    numpy = python_functions(generate_code(robot, "numpy", "inverse-dynamics"))["inverse_dynamics"](q, qd, qdd)
    np.testing.assert_allclose(tau, numpy, rtol=0, atol=1e-12 * max(1.0, float(np.abs(numpy).max(initial=0.0))))


# Parameters that a robot file may have, and that mean something in a language, in a library, or in the file itself.
WORDS = """
    lambda class def map float list q qd qdd T J tau fk jacobian inverse_dynamics c1 s1 c12 x1 x2 k1 q1 qd1 np _ __x
    _x double int register inline restrict _Bool gamma y0 y1 jn erf NAN INFINITY M_PI HUGE_VAL linux unix I main
    namespace template std new delete this and or xor a__b operator constexpr function end endfunction i j e ans p arm
    varargin nargin eps zeros var let const export import Math typeof undefined await yield arguments eval print None
    True abs Iterable v DH2SIM_double_
"""
NAMES_IN_USE = [*WORDS.split(), "a" * 100, "a" * 99 + "b"]


def hostile_program() -> Program:
    trace = Trace()
    x, y = trace.variables("q", 2)
    total = trace.constant("one_more", 0.5) * (x + y)
    for i, name in enumerate(NAMES_IN_USE):
        total = total * trace.constant(name, 1.0 + i / 1000) + y
    function = Function(name="fk", arguments=("q",), result="T", shape=(1, 1), values=(total,), text="a number")
    return Program(name="double", n=2, trace=trace, functions=(function,), header=("*/ /* \\", "two words"))


def hostile_value(x: float, y: float) -> float:
    total = 0.5 * (x + y)
    for i in range(len(NAMES_IN_USE)):
        total = total * (1.0 + i / 1000) + y
    return total


@pytest.mark.parametrize(
    "language",
    [
        Language.PYTHON,
        Language.NUMPY,
        *(pytest.param(each, marks=pytest.mark.slow) for each in Language if each not in ("python", "numpy")),
    ],
)
def test_constants_may_have_any_name(language: Language, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.codegen.running.SIZES", {"fk": (1, 1)})
    q = np.array([[0.3, -0.2], [1.0, 2.0]])
    call = Call(functions=["fk"], arguments=[q], folder=tmp_path)
    [found] = results(language, program_text(hostile_program(), language), "double_", call)
    np.testing.assert_allclose(found[:, 0, 0], [hostile_value(*row) for row in q.tolist()], rtol=1e-14)


@pytest.mark.slow
def test_python_code_passes_strict_type_checks(tmp_path: Path) -> None:
    from mypy import api

    for language in (Language.PYTHON, Language.NUMPY):
        (tmp_path / f"{language}_code.py").write_text(generate_code(model("odd"), language, ALL))
    out, errors, status = api.run(["--strict", "--config-file=", *map(str, sorted(tmp_path.glob("*.py")))])
    assert status == 0, out + errors


def test_c_code_is_laid_out_like_this() -> None:
    text = Robot([Revolute(a=0.3), Revolute(a=0.2)], name="planar").code("c")
    assert text.partition(" */\n\n")[2] == PLANAR


PLANAR = """\
#include <math.h>

void planar_fk(const double *q, double *T);

static const double a1 = 0.3; /* m, row 1 */
static const double a2 = 0.2; /* m, row 2 */

/* The pose of tool0 in base_link, 4 x 4 numbers row by row. */
void planar_fk(const double *q, double *T)
{
    const double q1 = q[0];
    const double q2 = q[1];
    const double c1 = cos(q1);
    const double s1 = sin(q1);
    const double q12 = q1 + q2;
    const double c12 = cos(q12);
    const double s12 = sin(q12);
    T[0] = c12;
    T[1] = -s12;
    T[2] = 0.0;
    T[3] = a2*c12 + a1*c1;
    T[4] = s12;
    T[5] = c12;
    T[6] = 0.0;
    T[7] = a2*s12 + a1*s1;
    T[8] = 0.0;
    T[9] = 0.0;
    T[10] = 1.0;
    T[11] = 0.0;
    T[12] = 0.0;
    T[13] = 0.0;
    T[14] = 0.0;
    T[15] = 1.0;
}
"""


def test_identifiers_are_plain_and_short() -> None:
    assert [identifier(name) for name in ("a2", "my-arm", "_a", "__a__b", "9", "é", "_")] == [
        "a2",
        "my_arm",
        "a",
        "a_b",
        "p_9",
        "p",
        "p",
    ]
    assert len(identifier("a" * 100)) == 40
    assert build_model(SLIDE.spec).name == "return"
