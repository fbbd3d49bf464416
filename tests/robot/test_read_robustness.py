"""Whatever stands in a file, reading it ends soon, in a RobotSpec or in a Dh2simError."""

from __future__ import annotations

import contextlib
import time

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dh2sim.errors import Dh2simError, RobotFileError
from dh2sim.robot.read import parse_robot
from tests.robot.files import FULL, MINIMAL

SPICE = "{}[]:,-?&*!|>'\"%@`#\n\t\r \\0aé\u2028\ufeff~<="
KEYS = sorted({part.strip(" -{") for line in FULL.split("\n") for part in line.split(":")[:1] if part.strip()})
VALUES = [
    "", "~", "true", "1", "-1", "0", "1e999", ".nan", "-.inf", "x", "pi", "a2", "1 / 0", "9 ** 9 ** 9", "''",
    "[]", "{}", "[1]", "[1, 2]", "[1, 2, 3]", "[[1]]", "{a: 1}", "[~, x, true]", "{1: 2}", "!!set {a}", "&a [1]",
    "*a", "revolute", "fixed", "deg", "none", "'\\0'", '"\\0"', '"\\ud800"', "2024-01-01", "{xyz: 3}", "{kp: 1}",
]  # fmt: skip


def _read(text: str | bytes) -> None:
    """Read a file; anything but a Dh2simError is a failure, and so is a problem without a proper place."""
    with contextlib.suppress(Dh2simError):
        try:
            parse_robot(text)
        except RobotFileError as error:
            places = [(problem.line, problem.column) for problem in error.problems]
            data = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
            lines = len(data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n"))
            if not places or any(line < 1 or column < 1 or line > lines for line, column in places):
                raise AssertionError(f"a problem outside the file: {error}") from error
            raise


@given(st.text() | st.text(alphabet=SPICE) | st.binary())
@example("a: \ud800")
@example("? ? ? ?")
@example("&a &b c")
@example("--- |1\n---")
@example("%YAML 1.3\n---\na")
@example('"\\x')
@example("a: >\n  b\n\n\n c")
def test_any_text_is_read_as_a_robot_or_refused(text: str | bytes) -> None:
    _read(text)


@given(st.integers(0, len(FULL)), st.integers(0, 20), st.text(alphabet=SPICE, max_size=5))
def test_a_robot_file_with_a_piece_replaced_is_read_or_refused(start: int, length: int, piece: str) -> None:
    _read(FULL[:start] + piece + FULL[start + length :])


@given(st.data())
def test_a_file_with_odd_values_is_read_or_refused(data: st.DataObject) -> None:
    lines = FULL.split("\n")
    for _ in range(data.draw(st.integers(1, 4))):
        index = data.draw(st.integers(0, len(lines) - 1))
        key, colon, _value = lines[index].partition(":")
        lines[index] = f"{key}{colon} {data.draw(st.sampled_from(VALUES))}"
    _read("\n".join(lines))


@given(st.lists(st.tuples(st.sampled_from(KEYS), st.sampled_from(VALUES)), max_size=6), st.integers(0, 2))
def test_a_file_with_odd_keys_is_read_or_refused(pairs: list[tuple[str, str]], level: int) -> None:
    mapping = "{" + ", ".join(f"{key}: {value}" for key, value in pairs) + "}"
    joint = ["{type: revolute}", mapping, f"{{type: revolute, link: {mapping}}}"][level]
    keys = "" if level else "".join(f"{key}: {value}\n" for key, value in pairs)
    _read(f"name: r\nconvention: standard\njoints:\n- {joint}\n{keys}")


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        MINIMAL + "parameters:\n" + "".join(f"  p{i}: p{i + 1} + q{i}\n" for i in range(20_000)),
        MINIMAL + "parameters:\n" + "".join(f"  p{i}: p{(i + 1) % 20_000}\n" for i in range(20_000)),
        "".join(f"key{i}: 1\n" for i in range(20_000)),
        "name: r\nconvention: standard\njoints:\n" + "- {typ: 1, a: b}\n" * 9_000,
        MINIMAL + "configurations:\n" + "".join(f"  c{i}: [1, 2, x]\n" for i in range(9_000)),
        "[" + ("!" + "a" * 99_000 + " 1,\n") * 9 + "]",
        "a: |\n" + " a\n" * 300_000,
        "a: '" + "''" * 49_000 + "'\n",
        "\n" * 900_000,
        "- " * 49_000,
    ],
    ids=["names", "cycle", "keys", "rows", "configurations", "tags", "lines", "quotes", "empty", "dashes"],
)
def test_a_large_wrong_robot_file_is_refused_quickly(text: str) -> None:
    start = time.thread_time()
    with pytest.raises(RobotFileError):
        parse_robot(text)
    assert time.thread_time() - start < 60  # hours, if it were not refused


def test_a_large_right_file_is_read_soon() -> None:
    row = (
        "- {type: revolute, a: 0.1, alpha: -90, d: d1, theta: 0, limits: {position: [-170, 170], velocity: 90}, "
        "link: {mass: 1, com: [0, 0, 0], inertia: {ixx: 1, iyy: 1, izz: 1}}}\n"
    )
    start = time.thread_time()
    spec = parse_robot("name: r\nconvention: standard\nparameters: {d1: 1}\njoints:\n" + row * 400)
    assert time.thread_time() - start < 10
    assert len(spec.rows) == 400
