from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import pytest

from dh2sim.checking.findings import Baseline, CheckPart, CheckReport, Finding, RobotCheck
from dh2sim.checking.formats import ReportFormat, format_of, report_text, to_sarif
from dh2sim.errors import Dh2simError
from tests.checking.schemas import published_schema

WRONG = Finding(rule="robot-file", file="robots/a b.yaml", line=3, column=7, path="joints[0].a", message="found 'x'")
SLIP = Finding(
    rule="degrees-in-rad", file="robots/a b.yaml", line=4, column=1, path="joints[1].alpha", message="90 rad"
)
NASTY = Finding(
    rule="engine", file="robots/x\n::error::y.yaml", path="", message="50% off\n::warning::z \x1b[31m| `_*"
)


def report_of(*findings: Finding) -> CheckReport:
    robot = RobotCheck(file="robots/a b.yaml", name="arm", exports=None, report=None, findings=findings, seconds=0.5)
    right = RobotCheck(file="robots/c.yaml", name="c", exports="generated/c", report=None, findings=())
    return CheckReport(robots=(robot, right), parts=tuple(CheckPart))


@pytest.fixture(autouse=True)
def outside_of_github(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("GITHUB_WORKSPACE", raising=False)


def test_text_has_a_line_for_each_finding_and_one_of_all() -> None:
    lines = report_text(report_of(WRONG, SLIP), ReportFormat.TEXT).splitlines()
    assert lines == [
        "robots/a b.yaml:3:7: error [robot-file]: joints[0].a: found 'x'",
        "robots/a b.yaml:4:1: warning [degrees-in-rad]: joints[1].alpha: 90 rad",
        "1 of 2 robots passed, 2 findings",
    ]


def test_annotations_have_their_place_and_cannot_be_forged() -> None:
    lines = report_text(report_of(WRONG, NASTY), ReportFormat.GITHUB).splitlines()
    assert lines == [
        "::error file=robots/a b.yaml,line=3,col=7,title=dh2sim%3A robot-file::joints[0].a: found 'x'",
        "::error file=robots/x%0A%3A%3Aerror%3A%3Ay.yaml,title=dh2sim%3A engine::50%25 off%0A::warning::z "
        "\\x1b[31m| `_*",
        "1 of 2 robots passed, 2 findings",
    ]
    text = report_text(report_of(NASTY), ReportFormat.TEXT)
    assert not any(line.startswith("::") for line in text.splitlines())


def test_annotations_are_relative_to_the_checkout(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    monkeypatch.chdir(tmp_path / "sub")
    monkeypatch.setenv("GITHUB_WORKSPACE", str(tmp_path))
    assert "file=sub/robots/a b.yaml," in report_text(report_of(WRONG), ReportFormat.GITHUB)
    [result] = to_sarif(report_of(WRONG))["runs"][0]["results"]
    assert result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == "sub/robots/a%20b.yaml"


def test_sarif_is_valid_by_its_published_schema() -> None:
    accepted = replace(SLIP, accepted=True)
    outside = replace(WRONG, file="/elsewhere/arm.yaml", line=0, column=0, path="")
    log = json.loads(report_text(report_of(WRONG, accepted, NASTY, outside), ReportFormat.SARIF))
    published_schema("sarif-2.1.0").validate(log)
    results = log["runs"][0]["results"]
    assert [result["level"] for result in results] == ["error", "warning", "error", "error"]
    assert results[0]["locations"][0]["physicalLocation"] == {
        "artifactLocation": {"uri": "robots/a%20b.yaml"},
        "region": {"startLine": 3, "startColumn": 7},
    }
    assert ["suppressions" in result for result in results] == [False, True, False, False]
    rules = log["runs"][0]["tool"]["driver"]["rules"]
    assert all(rules[result["ruleIndex"]]["id"] == result["ruleId"] for result in results)


def test_fingerprints_stay_when_lines_move() -> None:
    first, moved, other = to_sarif(report_of(WRONG, replace(WRONG, line=30), SLIP))["runs"][0]["results"]
    assert first["partialFingerprints"] == moved["partialFingerprints"] != other["partialFingerprints"]


def test_junit_has_a_case_for_every_part_and_counts_those_that_failed() -> None:
    root = ET.fromstring(report_text(report_of(WRONG, SLIP, NASTY), ReportFormat.JUNIT).encode())
    assert (root.get("tests"), root.get("failures")) == ("6", "2")
    assert [suite.get("name") for suite in root] == ["robots/a b.yaml", "robots/c.yaml"]
    failures = {case.get("name"): case.find("failure") for case in root[0]}
    assert failures["drift"] is None
    assert failures["files"] is not None
    assert failures["files"].text == f"{WRONG}\n{SLIP}"


def test_markdown_is_a_table_that_names_cannot_break() -> None:
    lines = report_text(report_of(NASTY), ReportFormat.MARKDOWN).splitlines()
    assert lines[0] == "### dh2sim check: 1 of 2 robots passed, 1 finding"
    assert [line.replace("\\|", "").count("|") for line in lines[2:6]] == [6, 6, 6, 6]
    assert lines[6] == ""
    assert "\\[31m\\| \\`\\_\\*" in lines[-1]


def test_a_line_end_in_a_file_name_ends_no_line_of_markdown() -> None:
    report = report_of(replace(WRONG, file="robots/a\n# b.yaml"))
    lines = report_text(report, ReportFormat.MARKDOWN).splitlines()
    assert not any(line.startswith("# b") for line in lines)
    assert sum("robots/a\\n# b.yaml" in line for line in lines) >= 1


def test_json_lists_robots_with_their_findings() -> None:
    data = json.loads(report_text(report_of(WRONG), ReportFormat.JSON))
    assert (data["ok"], data["passed"], data["failed"]) == (False, 1, 1)
    assert data["robots"][0]["findings"] == [
        {
            "rule": "robot-file",
            "level": "error",
            "file": "robots/a b.yaml",
            "line": 3,
            "column": 7,
            "path": "joints[0].a",
            "message": "found 'x'",
            "accepted": False,
        }
    ]


def test_the_ending_of_a_file_says_its_form() -> None:
    assert format_of(Path("a/report.SARIF")) is ReportFormat.SARIF
    with pytest.raises(Dh2simError, match=r"report.html: a report ends in .txt or .sarif or .json or .xml or .md"):
        format_of(Path("report.html"))


# ---------------------------------------------------------------------------- baseline


def test_a_baseline_comes_back_from_its_file(tmp_path: Path) -> None:
    path = tmp_path / "accepted.json"
    path.write_text(Baseline.of([WRONG, SLIP, SLIP]).text(), encoding="utf-8")
    assert Baseline.read(path) == Baseline.of([SLIP, SLIP, WRONG])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "is not a JSON file: line 1, column 2: expecting property name"),
        ('{"version": ' + "1" * 5000 + "}", "is not a JSON file: it contains a number of 5000 digits"),
        ("[" * 100_000, "is not a JSON file: it is nested too deeply"),
        ('{"version": NaN}', "is not a JSON file: it contains NaN"),
        ('{"version": 1, "version": 1}', "is not a JSON file: it contains the key 'version' twice in one object"),
        ("[]", "is not a baseline of version 1"),
        ('{"version": 1}', "accepted: must be a list"),
        ('{"version": 1, "accepted": [{}]}', r"accepted\[0\]: must have the texts rule, file, path, message"),
        (
            '{"version": 1, "accepted": [{"rule": "x", "file": "", "path": "", "message": ""}]}',
            r"accepted\[0\].rule: unknown rule 'x'",
        ),
    ],
)
def test_a_file_that_is_no_baseline_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "accepted.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(Dh2simError, match=message):
        Baseline.read(path)
