"""Whatever is typed: an exit status of 0, 1 or 2, errors on standard error, and never a traceback."""

from __future__ import annotations

import tempfile
from contextlib import chdir
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from tests.program import dh2sim
from tests.robot_files import RICH, small, write

OPTIONS = [
    "--out",
    "--format",
    "--check",
    "--no-verify",
    "--no-dh-frames",
    "--samples",
    "--seed",
    "--tolerance",
    "--dir",
    "--json",
    "--junit",
    "--frame",
    "--at",
    "--xyz",
    "--lock",
    "--degrees",
    "--help",
    "-h",
    "--version",
    "--",
    "-",
    "--samples=2",
    "--format=urdf",
    "--json=-",
    "--x",
    "--=",
]
WORDS = [
    "stanford",
    "rpr",
    "planar_2r.yaml",
    "rich.yaml",
    "small.yaml",
    "wrong.yaml",
    "missing.yaml",
    ".",
    "..",
    "generated",
    "urdf",
    "mjcf",
    "tool0",
    "dh_2",
    "home",
    "zero",
    "0",
    "1",
    "2",
    "-1",
    "-1e-3",
    "-pi/2",
    "pi",
    "1/0",
    "1e400",
    "nan",
    "inf",
    "x",
    "(",
    "1+",
    "~",
    "report.json",
]
SMALL = ["--samples", "2"]

typed = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=8)
arguments = st.lists(st.sampled_from(OPTIONS) | st.sampled_from(WORDS) | typed, max_size=7)
coordinates = st.lists(
    st.sampled_from(["0.1", "-0.2", "-1e-3", "pi/3", "-sqrt(2)", "1e308", "-1e308"]) | st.floats().map(repr),
    min_size=1,
    max_size=4,
)


def _run(*command: str) -> None:
    with tempfile.TemporaryDirectory() as name, chdir(name):
        folder = Path(name)
        write(folder, RICH)
        write(folder, small())
        write(folder, "name: wrong\nconvention: standrad\njoints: []\n")
        run = dh2sim(*command)
    assert run.status in (0, 1, 2)
    assert "Traceback" not in run.out + run.err
    if run.status == 2:
        assert run.err or not command, "bad input is printed"


EXAMPLES = 2 * settings().max_examples
lenient = settings(max_examples=EXAMPLES, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


@lenient
@given(st.sampled_from(["export", "fk", "ik", "info", "list", "schema", "nonsense", ""]), arguments)
@example("fk", ["stanford", "--frame", "dh_٣"])
@example("fk", ["stanford", "--", "--", "1"])
@example("ik", ["rpr", "--xyz", "1", "-pi/2", "1e308"])
@example("ik", ["rpr", "--at", "0.1", "-1e308", "3", "--lock", "x=", "=", "joint_1=1e400"])
@example("export", ["small.yaml", "--out", "rich.yaml"])
@example("export", ["small.yaml", "--out", "x" * 300])
@example("export", ["small.yaml", "--out", ""])
@example("info", ["x" * 5000])
@example("info", [""])
def test_no_command_line_makes_a_traceback(command: str, rest: list[str]) -> None:
    _run(command, *rest)


@settings(lenient, max_examples=EXAMPLES // 2)
@given(arguments)
@example(["small.yaml", "--json", ""])
@example(["small.yaml", "--json", ".", "--junit", "-"])
@example(["small.yaml", "--dir", "rich.yaml"])
@example(["small.yaml", "--seed", "9" * 50])
@example(["small.yaml", "--tolerance", "5e-324"])
def test_no_validation_makes_a_traceback(rest: list[str]) -> None:
    _run("validate", *rest, *([] if any("samples" in word for word in rest) else SMALL))


@lenient
@given(coordinates, st.booleans(), st.booleans())
def test_no_coordinates_make_a_traceback(q: list[str], degrees: bool, as_json: bool) -> None:
    options = ["--degrees"] * degrees + ["--json"] * as_json
    _run("fk", "rpr", *q, *options)


@pytest.mark.parametrize("text", ["(" * 3000, "1+" * 3000 + "1", "9**9**9**9", "-" * 3001 + "1", "sqrt(" * 500])
def test_no_expression_makes_a_traceback_or_takes_long(text: str) -> None:
    _run("fk", "rpr", text, "0", "0")
    run = dh2sim("fk", "rpr", text, "0", "0")
    assert len(run.err) < 500
