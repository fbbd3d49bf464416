from __future__ import annotations

import json
from pathlib import Path

import pytest

from dh2sim.codegen.generate import generate_code
from tests.program import dh2sim
from tests.sample_robots import robot

ALL = "pose,jacobian,inverse-dynamics"


@pytest.mark.parametrize("language", ["python", "numpy", "c", "cpp", "matlab", "javascript"])
def test_code_is_printed_in_every_language(language: str) -> None:
    done = dh2sim("symbolic", "rpr", "--what", "pose, jacobian", "--as", language)
    assert (done.status, done.err) == (0, "")
    assert done.out == generate_code(robot("rpr"), language, ["pose", "jacobian"])
    assert dh2sim("symbolic", "rpr", "--as", language.upper()).out == generate_code(robot("rpr"), language, "pose")


def test_code_is_written_to_a_file_and_a_file_is_not_overwritten_unasked(tmp_path: Path) -> None:
    file = tmp_path / "arm.c"
    done = dh2sim("symbolic", "rpr", "--what", ALL, "--as", "c", "-o", file)
    assert (done.status, done.out) == (0, f"{file}: rpr: pose, jacobian, inverse-dynamics as c\n")
    assert file.read_text() == generate_code(robot("rpr"), "c", ALL.split(","))
    again = dh2sim("symbolic", "rpr", "--as", "c", "-o", file)
    assert again.status == 2
    assert "already exists" in again.err
    assert dh2sim("symbolic", "rpr", "--as", "c", "-o", file, "--force").status == 0


def test_a_function_of_matlab_is_called_as_its_file_is(tmp_path: Path) -> None:
    dh2sim("symbolic", "rpr", "--as", "matlab", "-o", tmp_path / "my_arm.m")
    assert (tmp_path / "my_arm.m").read_text().startswith("function arm = my_arm()\n")


def test_what_inverse_dynamics_costs_is_printed_with_its_base_parameters() -> None:
    done = dh2sim("symbolic", "planar_2r", "--what", "inverse-dynamics")
    assert (done.status, done.err) == (0, "")
    lines = done.out.splitlines()
    assert lines[0] == "planar_2r: inverse dynamics by the recursive Newton-Euler algorithm"
    assert lines[2].startswith("Each call takes ")
    assert lines[-1] == "Languages: python, numpy, c, cpp, matlab, javascript"
    assert max(map(len, lines)) <= 80
    printed = dh2sim("symbolic", "planar_2r", "--what", "inverse-dynamics", "--as", "json")
    data = json.loads(printed.out)
    assert data["robot"] == "planar_2r"
    assert sorted(data["operations"]) == ["additions", "functions", "multiplications"]
    names = [constant["name"] for constant in data["constants"]]
    assert names == [line.split()[0] for line in lines[6 : 6 + len(names)]]
    assert {"ZZ1", "ZZ2", "MX2"} <= set(names)


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (["--what", "pose,jacobin", "--as", "c"], "--what: 'jacobin' is not one of pose, jacobian, inverse-dynamics"),
        (["--what", ALL], "--as takes one of python, numpy, c, cpp, matlab, javascript for several functions"),
        (["--what", "inverse-dynamics", "--as", "latex"], "--as takes one of text, json, python, numpy, c"),
        (["--style", "tool", "--as", "c"], "--style does not apply to code"),
        (["--to", "dh_2", "--as", "python"], "--to does not apply to code"),
        (["--no-names", "--as", "python"], "--no-names does not apply to code"),
    ],
)
def test_options_that_do_not_fit_code_are_refused(arguments: list[str], error: str) -> None:
    done = dh2sim("symbolic", "rpr", *arguments)
    assert (done.status, done.out) == (2, "")
    assert error in done.err


def test_a_robot_that_does_not_move_has_no_constants_to_list(tmp_path: Path) -> None:
    file = tmp_path / "post.yaml"
    file.write_text("{name: post, convention: standard, joints: [{type: fixed, d: 1}]}")
    run = dh2sim("symbolic", file, "--what", "inverse-dynamics")
    assert run.status == 0
    assert "Constants" not in run.out
