"""dh2sim symbolic: its formats, its options, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.program import dh2sim


def test_prints_the_pose_of_the_tool_by_default() -> None:
    run = dh2sim("symbolic", "planar_2r")
    assert (run.status, run.err) == (0, "")
    assert run.out == (
        "planar_2r: T_0_2, pose of tool0 in base_link\n"
        "  [ c12   -s12   0   a1*c1 + a2*c12 ]\n"
        "  [ s12   c12    0   a1*s1 + a2*s12 ]\n"
        "  [ 0     0      1   0              ]\n"
        "  [ 0     0      0   1              ]\n"
        "\n"
        "c12 = cos(theta_1 + theta_2), s12 = sin(theta_1 + theta_2), a1 = 1 m,\n"
        "a2 = 0.7 m\n"
    )


def test_frames_and_styles_are_options() -> None:
    run = dh2sim("symbolic", "puma560", "--from", "dh_4", "--to", "dh_6")
    assert "T_4_6, pose of dh_6 in dh_4" in run.out
    assert "c5*c6" in run.out
    tool = dh2sim("symbolic", "stanford", "--style", "tool", "--no-names").out
    assert "r33 = c2*c5 - s2*c4*s5" in tool
    assert "d6*(c1*s2*c5 + s5*(c1*c2*c4 - s1*s4)) - d2*s1 + d3*c1*s2" in tool


def test_letters_numbers_folding_and_names_of_coordinates_are_options() -> None:
    assert "a2 = -0.425 m" in dh2sim("symbolic", "ur5e", "--letters").out
    assert "0.4*c2" in dh2sim("symbolic", "arm_5r", "--numbers", "--to", "dh_4").out
    assert "c(1+2-4)" in dh2sim("symbolic", "scara", "--fold", "all").out
    assert "c1*c2 - s1*s2" in dh2sim("symbolic", "planar_2r", "--no-fold").out
    assert "c12 = cos(q1 + q2)" in dh2sim("symbolic", "planar_2r", "--q").out
    assert "d6*c2*c5" in dh2sim("symbolic", "stanford", "--style", "expanded", "--lengths", "last").out


def test_json_goes_to_a_file_whole(tmp_path: Path) -> None:
    out = tmp_path / "form.json"
    run = dh2sim("symbolic", "scara", "--what", "jacobian", "--as", "json", "-o", out)
    assert (run.status, run.err) == (0, "")
    assert run.out == f"{out}: scara: jacobian as json\n"
    assert json.loads(out.read_text())["equations"][1]["entries"] == [["a1*a2*s2"]]
    again = dh2sim("symbolic", "scara", "-o", out)
    assert again.status == 2
    assert "already exists" in again.err
    assert dh2sim("symbolic", "scara", "-o", out, "--force").status == 0


@pytest.mark.parametrize("format_", ["latex", "markdown", "json", "text"])
def test_every_format_prints_something(format_: str) -> None:
    run = dh2sim("symbolic", "rpr", "--as", format_)
    assert (run.status, run.err) == (0, "")
    assert "L2" in run.out or "L_{2}" in run.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--what", "pse"],
            "'pse' is not one of pose, matrices, jacobian, dynamics, inverse-dynamics. Did you mean 'pose'?",
        ),
        (["--style", "bas"], "'bas' is not one of base, tool, expanded. Did you mean 'base'?"),
        (
            ["--as", "fortran"],
            "'fortran' is not one of text, latex, markdown, json, python, numpy, c, cpp, matlab, javascript",
        ),
        (["--what", "matrices", "--to", "dh_2"], "--to does not apply to --what matrices"),
        (["--what", "dynamics", "--style", "tool"], "--style does not apply to --what dynamics"),
        (["--what", "dynamics", "--no-fold"], "--no-fold does not apply to --what dynamics"),
        (["--fold", "some"], "'some' is not one of parallel, all, none"),
        (["--to", "dh_7"], "scara: unknown frame 'dh_7'."),
    ],
)
def test_what_is_not_allowed_is_said_with_what_is(arguments: list[str], message: str) -> None:
    run = dh2sim("symbolic", "scara", *arguments)
    assert run.status == 2
    assert message in run.err
    assert "Traceback" not in run.err


def test_dynamics_in_letters_and_in_numbers() -> None:
    assert "I1 + I2" in dh2sim("symbolic", "planar_2r", "--what", "dynamics", "--letters").out
    assert "M, mass matrix" in dh2sim("symbolic", "planar_2r", "--what", "dynamics").out
    run = dh2sim("symbolic", "puma560", "--what", "dynamics")
    assert (run.status, run.out) == (2, "")
    assert run.err == (
        "dh2sim: puma560: has 6 joints that move; equations of motion are printed for up to 4. "
        "For any arm: --what inverse-dynamics --as c\n"
    )
