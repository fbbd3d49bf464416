"""Reports of a check for machines and pages: GitHub's annotations, SARIF, JUnit, JSON and Markdown."""

from __future__ import annotations

import hashlib
import json
import os
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from dh2sim.checking.findings import RULES, CheckReport, Finding, RobotCheck
from dh2sim.errors import Dh2simError
from dh2sim.messages import listed, printable
from dh2sim.validate.report import writable


class ReportFormat(StrEnum):
    """Form of a report."""

    TEXT = "text"
    GITHUB = "github"
    SARIF = "sarif"
    JSON = "json"
    JUNIT = "junit"
    MARKDOWN = "markdown"


_ENDINGS: Final = {
    ".txt": ReportFormat.TEXT,
    ".sarif": ReportFormat.SARIF,
    ".json": ReportFormat.JSON,
    ".xml": ReportFormat.JUNIT,
    ".md": ReportFormat.MARKDOWN,
}


def format_of(path: Path) -> ReportFormat:
    """Return the form of a report by the ending of its file.

    Raises:
        Dh2simError: The ending is unknown.
    """
    try:
        return _ENDINGS[path.suffix.lower()]
    except KeyError:
        raise Dh2simError(f"{path}: a report ends in {listed(_ENDINGS, ' or ')}") from None


def report_text(report: CheckReport, form: ReportFormat) -> str:
    """Return a report in some form, with a line end at its end."""
    makers: dict[ReportFormat, Callable[[CheckReport], str]] = {
        ReportFormat.TEXT: _text,
        ReportFormat.GITHUB: _github,
        ReportFormat.SARIF: lambda report: _json(to_sarif(report)),
        ReportFormat.JSON: lambda report: _json(report.to_json()),
        ReportFormat.JUNIT: _junit,
        ReportFormat.MARKDOWN: _markdown,
    }
    return makers[form](report)


def _json(value: object) -> str:
    return json.dumps(value, indent=2, allow_nan=False) + "\n"


# ---------------------------------------------------------------------------- for people


def _text(report: CheckReport) -> str:
    lines = [str(finding) for finding in report.findings if not finding.accepted]
    lines.append(summary(report))
    # a name with a line end must not start a line, which a CI may obey
    return "".join(printable(line).replace("\n", "\n    ") + "\n" for line in lines)


def summary(report: CheckReport) -> str:
    """Return in one line how many robots passed, and what was accepted."""
    count = len(report.robots)
    if not count:
        return "no robot to check"
    accepted = sum(finding.accepted for finding in report.findings)
    text = f"{count - report.failed} of {count} {'robot' if count == 1 else 'robots'} passed"
    found = len(report.findings) - accepted
    text += f", {found} {'finding' if found == 1 else 'findings'}" if found else ""
    text += f", {accepted} accepted by the baseline" if accepted else ""
    if report.outdated == 1:
        text += "; 1 entry of the baseline no longer occurs"
    elif report.outdated:
        text += f"; {report.outdated} entries of the baseline no longer occur"
    return text


def _markdown(report: CheckReport) -> str:
    """Return a table of the robots, and a list of what was found: GitHub shows it as the summary of a job."""
    lines = [f"### dh2sim check: {summary(report)}", ""]
    if report.robots:
        lines += ["| robot | file | exports | worst pose error | |", "|---|---|---|---|---|"]
    for robot in report.robots:
        error = robot.worst_error
        worst = "" if error is None else f"{error[0]:.1e} m, {error[1]:.1e} rad"
        verdict = "passed" if robot.ok else f"**{_count(robot)}**"
        exports = "" if robot.exports is None else f"`{_cell(robot.exports)}`"
        lines.append(f"| {_cell(robot.name or '')} | `{_cell(robot.file)}` | {exports} | {worst} | {verdict} |")
    if any(not finding.accepted for finding in report.findings):
        lines.append("")
    for finding in report.findings:
        if not finding.accepted:
            place = f"{finding.file}:{finding.line}" if finding.line else finding.file
            path = f"`{_cell(finding.path)}`: " if finding.path else ""
            lines.append(f"- `{_cell(place)}` {finding.rule}: {path}{_prose(finding.message)}")
    return "".join(f"{line}\n" for line in lines)


def _count(robot: RobotCheck) -> str:
    count = sum(not finding.accepted for finding in robot.findings)
    return f"{count} {'finding' if count == 1 else 'findings'}"


def _cell(text: str) -> str:
    """Return a text that stays in its line, in its cell, and in its code span."""
    return printable(text).replace("\n", "\\n").replace("|", "\\|").replace("`", "'")


def _prose(text: str) -> str:
    """Return a text that Markdown shows as it is."""
    return re.sub(r"([\\`*_{}\[\]<>#|@])", r"\\\1", printable(text))


# ---------------------------------------------------------------------------- for machines


def _github(report: CheckReport) -> str:
    """Return workflow commands, which GitHub shows as annotations beside the lines."""
    lines = []
    for finding in report.findings:
        if finding.accepted:
            continue
        place = {"file": _in_repository(finding.file)}
        if finding.line:
            place |= {"line": str(finding.line), "col": str(finding.column)}
        place["title"] = f"dh2sim: {finding.rule}"
        properties = ",".join(f"{key}={_escaped(value, more=':,')}" for key, value in place.items())
        path = f"{finding.path}: " if finding.path else ""
        lines.append(f"::{finding.level} {properties}::{_escaped(path + finding.message)}")
    return "".join(f"{line}\n" for line in [*lines, printable(summary(report))])


def _in_repository(file: str) -> str:
    """Return a path relative to the checkout of a GitHub job, as its annotations have it; elsewhere as it is."""
    workspace = os.environ.get("GITHUB_WORKSPACE")
    path = Path(file)
    if workspace is None or path.is_absolute():
        return file
    absolute = Path(os.path.normpath(Path.cwd() / path))
    return absolute.relative_to(workspace).as_posix() if absolute.is_relative_to(workspace) else file


def _escaped(text: str, *, more: str = "") -> str:
    escaped = text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")
    for character in more:
        escaped = escaped.replace(character, f"%{ord(character):02X}")
    return printable(escaped)


_SARIF_SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"
_HOME = "https://github.com/dh2sim/dh2sim"


def to_sarif(report: CheckReport) -> dict[str, Any]:
    """Return the report in the Static Analysis Results Interchange Format, version 2.1.0.

    Every result has a fingerprint that stays when lines move; what a baseline accepts is suppressed.
    """
    from importlib.metadata import version

    names = list(RULES)
    rules = [
        {
            "id": name,
            "shortDescription": {"text": text},
            "helpUri": f"{_HOME}/blob/main/docs/checking.md#rules",
        }
        for name, text in RULES.items()
    ]
    driver = {"name": "dh2sim", "version": version("dh2sim"), "informationUri": _HOME, "rules": rules}
    results = [_result(finding, names.index(finding.rule)) for finding in report.findings]
    run = {"tool": {"driver": driver}, "columnKind": "unicodeCodePoints", "results": results}
    return {"$schema": _SARIF_SCHEMA, "version": "2.1.0", "runs": [run]}


def _result(finding: Finding, index: int) -> dict[str, Any]:
    file = _in_repository(finding.file)
    uri = Path(file).as_uri() if Path(file).is_absolute() else quote(file)
    place: dict[str, Any] = {"artifactLocation": {"uri": uri}}
    if finding.line:
        place["region"] = {"startLine": finding.line, "startColumn": max(1, finding.column)}
    where: dict[str, Any] = {"physicalLocation": place}
    if finding.path:
        where["logicalLocations"] = [{"fullyQualifiedName": finding.path}]
    text = f"{finding.path}: {finding.message}" if finding.path else finding.message
    identity = "\0".join(finding.identity).encode("utf-8", "surrogateescape")
    result: dict[str, Any] = {
        "ruleId": finding.rule,
        "ruleIndex": index,
        "level": finding.level,
        "message": {"text": printable(text)},
        "locations": [where],
        "partialFingerprints": {"identity/v1": hashlib.sha256(identity).hexdigest()},
    }
    if finding.accepted:
        result["suppressions"] = [{"kind": "external", "justification": "in the baseline"}]
    return result


def _junit(report: CheckReport) -> str:
    """Return a JUnit document: a suite for every robot file, a case for every part, which lists what failed."""
    root = ET.Element("testsuites", {"name": "dh2sim check"})
    total = failures = 0
    for robot in report.robots:
        suite = ET.SubElement(root, "testsuite", {"name": robot.file})
        cases = failed = 0
        for part in report.parts:
            if robot.name is None and part != report.parts[0]:
                continue  # a file that is wrong has no exports and no poses
            case = ET.SubElement(suite, "testcase", classname=f"dh2sim.{robot.name or robot.file}", name=part.value)
            cases += 1
            found = [finding for finding in robot.findings if _part(finding) == part.value and not finding.accepted]
            if robot.name is None:
                found = list(robot.findings)
            if found:
                failed += 1
                failure = ET.SubElement(case, "failure", message=writable(found[0].message))
                failure.text = writable("\n".join(map(str, found)))
        suite.attrib |= {"tests": str(cases), "failures": str(failed), "time": f"{robot.seconds:.3f}"}
        total, failures = total + cases, failures + failed
    root.attrib |= {"tests": str(total), "failures": str(failures)}
    ET.indent(root)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _part(finding: Finding) -> str:
    return {"drift": "drift", "name-clash": "drift", "engine": "poses"}.get(finding.rule, "files")
