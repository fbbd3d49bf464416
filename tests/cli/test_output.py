"""JSON of commands has no numbers that are not finite, and what they print has no control characters."""

from __future__ import annotations

import json
import math
import os
import pty
from contextlib import redirect_stderr
from pathlib import Path

import pytest

from dh2sim.cli.common import complain
from dh2sim.cli.output import json_text
from dh2sim.errors import NotFiniteError
from tests.program import dh2sim, on_terminal


def test_json_reads_back() -> None:
    value = {"a": [1.0, {"b": "é"}], "c": None}
    assert json.loads(json_text(value)) == value
    assert json_text(value, indent=None, ensure_ascii=False) == '{"a": [1.0, {"b": "é"}], "c": null}'


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_refused_with_its_place(number: float) -> None:
    with pytest.raises(NotFiniteError, match=rf"^JSON\.a\[1\]\.b: {number} is not a finite number"):
        json_text({"a": [1.0, {"b": number}]})


@pytest.mark.parametrize(
    "command",
    [
        ("export", "rpr", "--out", ""),
        ("export", "rpr", "--check", "--out", "nothing"),
        ("new", "--out", "arm.yaml", "arm"),
        ("convert", "rpr", "--to", "modified", "--out", "arm.yaml"),
        ("rollout", "rpr", "--rollouts", "1", "--steps", "1", "--out", "run.zarr"),
        ("draw", "rpr", "--out", "rpr.svg"),
    ],
    ids=" ".join,
)
def test_names_of_folders_do_not_reach_the_terminal_as_they_are(command: tuple[str, ...], tmp_path: Path) -> None:
    folder = tmp_path / "a\x1b[2Jb"
    try:
        folder.mkdir()
    except OSError:
        pytest.skip("the system has no such names")
    place = command.index("--out") + 1
    done = dh2sim(*command[:place], folder / command[place], *command[place + 1 :])
    assert done.status in (0, 1), done.err
    assert "\x1b" not in done.out + done.err
    assert "a\\x1b[2Jb" in done.out


def test_an_error_is_wrapped_between_words_on_a_terminal_and_stays_one_line_elsewhere() -> None:
    sentence = "dh2sim: no file or robot named 'nosuch'. 'dh2sim list' lists the "
    assert dh2sim("fk", "nosuch").err.startswith(sentence)
    assert dh2sim("fk", "nosuch").err.count("\n") == 1
    master, slave = pty.openpty()
    with os.fdopen(master, "rb") as screen, os.fdopen(slave, "w") as terminal, redirect_stderr(terminal):
        complain("a long word " * 7 + "and 'dh2sim import arm.urdf -o arm.yaml'")
        terminal.flush()
        lines = os.read(screen.fileno(), 4096).decode().splitlines()
    assert lines == [
        "dh2sim: a long word a long word a long word a long word a long word a long word",
        "  a long word and 'dh2sim import arm.urdf -o arm.yaml'",
    ]


def test_long_lines_end_between_items_on_a_terminal_and_the_jacobian_goes_on_below() -> None:
    narrow, wide = on_terminal("jacobian", "franka_panda", columns=60), dh2sim("jacobian", "franka_panda").out
    assert max(map(len, narrow.splitlines())) <= 60
    words = [line.split() for line in wide.splitlines() if line.startswith(("  v", "  w"))]
    found = [line.split() for line in narrow.splitlines() if line.startswith(("  v", "  w"))]
    assert [first + rest[2:] for first, rest in zip(found[:6], found[6:], strict=True)] == words
    assert narrow.splitlines()[1:3] == [
        "q           home: 0.3 rad, -0.6 rad, 0.2 rad, -2.2 rad,",
        "            0.25 rad, 1.8 rad, 0.7 rad",
    ]
    assert on_terminal("jacobian", "franka_panda", columns=120) == wide


def test_a_long_controller_is_wrapped_after_a_comma(tmp_path: Path) -> None:
    controller = "computed-torque:bandwidth=25.123456,period=0.712345,amplitude=0.512345,reference=none"
    how = ("rollout", "planar_2r", "--rollouts", "2", "--steps", "2", "--controller", controller)
    lines = dh2sim(*how, "--out", tmp_path / "run.zarr").out.splitlines()
    assert lines[:3] == [
        "planar_2r: 2 rollouts of 2 steps (0.004 s), computed-torque:bandwidth=25.123456,",
        "  period=0.712345,amplitude=0.512345,reference=none, in",
        f"  {tmp_path / 'run.zarr'}",
    ]
