"""What a validation tells programs: JSON and JUnit."""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from dh2sim.validate.report import Check, Quantity, RobotReport, ValidationReport, Worst, failure_text, to_junit
from tests.engines.files import PYBULLET
from tests.program import dh2sim
from tests.robot_files import ODD, small, write
from tests.validate.files import change, numbers, part, validated

POSE = {"engine", "quantity", "frames", "max_position_error", "max_rotation_error", "tolerance", "ok"}
"""What the command line's contract promises of a pose's entry."""


def test_the_report_has_the_shape_of_the_contract(tmp_path: Path) -> None:
    report = validated(write(tmp_path, ODD))
    assert set(report) == {"ok", "robots"}
    [robot] = report["robots"]
    assert set(robot) == {"name", "ok", "samples", "reach", "engines", "notes", "warnings"}
    assert (report["ok"], robot["name"], robot["ok"], robot["samples"]) == (True, "odd", True, 20)
    poses = [entry for entry in robot["engines"] if entry["quantity"] == "pose" and entry["ok"] is not None]
    assert [set(entry) - {"reference", "samples"} for entry in poses] == [POSE] * (6 if PYBULLET else 5)
    assert poses[1] == {
        "engine": "mujoco-mjcf",
        "quantity": "pose",
        "reference": "table",
        "samples": 20,
        "frames": 7,
        "max_position_error": poses[1]["max_position_error"],
        "max_rotation_error": poses[1]["max_rotation_error"],
        "tolerance": 1e-12,
        "ok": True,
    }
    others = [entry for entry in robot["engines"] if entry["quantity"] != "pose"]
    assert [(entry["engine"], entry["quantity"]) for entry in others] == [
        ("mjcf-file", "unit quaternions"),
        ("dh2sim", "jacobian"),
        ("mujoco-mjcf", "jacobian"),
        ("mujoco-urdf", "jacobian"),
        ("pinocchio", "jacobian"),
        *([("pybullet", "jacobian")] if PYBULLET else []),
        ("mujoco-mjcf", "link inertia"),
        ("mujoco-urdf", "link inertia"),
        *(
            (engine, term)
            for engine in ("mujoco-urdf", "pinocchio", *(["pybullet"] if PYBULLET else []))
            for term in ("mass matrix", "bias force", "gravity force")
        ),
    ]


def test_two_validations_report_the_same_bytes(tmp_path: Path) -> None:
    robot = write(tmp_path, ODD)
    runs = [dh2sim("validate", robot, "--samples", "50", "--json", "-") for _ in range(2)]
    assert runs[0] == runs[1]
    assert runs[0].err == ""


def test_the_report_is_written_to_a_file_beside_what_is_printed(tmp_path: Path) -> None:
    robot, file = write(tmp_path, small()), tmp_path / "report.json"
    run = dh2sim("validate", robot, "--samples", "3", "--json", file)
    assert (run.status, run.err) == (0, "")
    assert run.out.startswith("small matches its table\n")
    assert file.read_text() == dh2sim("validate", robot, "--samples", "3", "--json", "-").out


def test_a_report_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    robot, file = write(tmp_path, small()), tmp_path / "missing" / "report"
    for option in ("--json", "--junit"):
        run = dh2sim("validate", robot, "--samples", "1", option, file)
        assert run.status == 2
        assert run.err == f"dh2sim: cannot write '{file}': No such file or directory\n"


def _strict(text: str) -> Any:
    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    return json.loads(text, parse_constant=refuse)


@pytest.mark.parametrize(("value", "reported"), [(math.nan, "nan"), (math.inf, "inf")])
def test_what_is_not_finite_is_text_in_the_json(value: float, reported: str) -> None:
    check = Check(
        engine="mujoco-mjcf",
        quantity=Quantity.POSE,
        ok=False,
        samples=1,
        frames=2,
        max_position_error=value,
        max_rotation_error=0.0,
        tolerance=1e-12,
        worst=Worst(where="dh_1", q=(0.5,), sample=0),
    )
    robot = RobotReport(name="arm", samples=1, reach=1.0, checks=(check,))
    report = ValidationReport(robots=(robot,))
    [entry] = _strict(json.dumps(report.to_json(), allow_nan=False))["robots"][0]["engines"]
    assert entry["max_position_error"] == reported
    assert entry["worst"] == {"where": "dh_1", "q": [0.5], "sample": 0}
    assert failure_text(check) == f"{reported} m, 0 rad (tolerance 1e-12); worst at dh_1, q = [0.5]"


def test_nothing_checked_has_not_failed_and_one_failure_fails_all() -> None:
    absent = Check(engine="pinocchio", quantity=Quantity.POSE, ok=None, reason="not installed")
    passed = Check(engine="dh2sim", quantity=Quantity.POSE, ok=True)
    failed = Check(engine="dh2sim", quantity=Quantity.POSE, ok=False)

    def ok(*checks: Check) -> bool:
        robot = RobotReport(name="arm", samples=1, reach=1.0, checks=checks)
        other = RobotReport(name="leg", samples=1, reach=1.0, checks=(passed,))
        return ValidationReport(robots=(other, robot)).ok

    assert ok(passed, absent)
    assert not ok(passed, failed, absent)
    assert absent.to_json() == {"engine": "pinocchio", "quantity": "pose", "ok": None, "reason": "not installed"}


def test_junit_has_a_suite_for_every_robot_and_a_case_for_every_check(tmp_path: Path) -> None:
    robots = [write(tmp_path, text) for text in (ODD, small())]
    assert dh2sim("export", *robots, "--out", tmp_path).status == 0
    change(
        tmp_path / "odd" / "odd.urdf",
        lambda root: numbers(part(root, "joint", "one", "origin"), "xyz", lambda v: [v[0] + 0.5, *v[1:]]),
    )
    file = tmp_path / "report.xml"
    run = dh2sim("validate", *robots, "--dir", tmp_path, "--samples", "3", "--junit", file, "--json", "-")
    assert run.status == 1
    root = ET.parse(file).getroot()
    assert root is not None
    assert root.tag == "testsuites"
    suites = list(root)
    entries = [robot["engines"] for robot in json.loads(run.out)["robots"]]
    assert [suite.get("name") for suite in suites] == ["odd", "small"]
    for suite, checks in zip(suites, entries, strict=True):
        assert [case.get("name") for case in suite] == [f"{c['engine']}: {c['quantity']}" for c in checks]
        assert {case.get("classname") for case in suite} == {f"dh2sim.{suite.get('name')}"}
        assert [case.find("failure") is not None for case in suite] == [c["ok"] is False for c in checks]
    for element in [root, *suites]:
        cases = list(element.iter("testcase"))
        assert element.get("tests") == str(len(cases))
        assert element.get("failures") == str(len(list(element.iter("failure"))))
        assert element.get("skipped") == "0"
    failure = next(root.iter("failure"))
    assert failure.get("message", "").startswith("0.5 m, ")
    assert " (tolerance 1e-12); worst at " in failure.get("message", "")


def test_junit_skips_what_was_not_checked_and_can_hold_any_message() -> None:
    checks = (
        Check(engine="pinocchio", quantity=Quantity.POSE, ok=None, reason="not installed"),
        Check(engine="yourdfpy", quantity=Quantity.FILE, ok=False, reason="<\x01&\udcff\ufffe\U0001f600\n"),
    )
    text = to_junit(ValidationReport(robots=(RobotReport(name="arm", samples=1, reach=1.0, checks=checks),)))
    root = ET.fromstring(text.encode())
    assert [skipped.get("message") for skipped in root.iter("skipped")] == ["not installed"]
    assert [failure.get("message") for failure in root.iter("failure")] == ["<?&??\U0001f600\n"]
    assert (root.get("tests"), root.get("failures"), root.get("skipped")) == ("2", "1", "1")
