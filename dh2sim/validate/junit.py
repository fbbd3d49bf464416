"""A validation as JUnit XML, which CI systems show."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

from dh2sim.validate.report import Check, ValidationReport

_UNWRITABLE = re.compile("[^\t\n\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def to_junit(report: ValidationReport) -> str:
    """Return a JUnit document: a suite for every robot, a case for every check."""
    checks = [check for robot in report.robots for check in robot.checks]
    root = ET.Element("testsuites", {"name": "dh2sim validate", **_counts(checks)})
    for robot in report.robots:
        suite = ET.SubElement(root, "testsuite", {"name": robot.name, **_counts(robot.checks)})
        for check in robot.checks:
            case = ET.SubElement(
                suite,
                "testcase",
                classname=f"dh2sim.{robot.name}",
                name=f"{check.engine}: {check.quantity.value}",
                time=f"{check.seconds:.3f}",
            )
            if check.ok is None:
                ET.SubElement(case, "skipped", message=_writable(check.reason or ""))
            elif not check.ok:
                ET.SubElement(case, "failure", message=_writable(failure_text(check)))
    ET.indent(root)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def failure_text(check: Check) -> str:
    """Say in a line by how much a check fell short, and where."""
    if check.reason is not None:
        return check.reason
    if check.max_position_error is not None and check.max_rotation_error is not None:
        text = f"{check.max_position_error:.3g} m, {check.max_rotation_error:.3g} rad"
    else:
        text = f"{check.max_error:.3g}" if check.max_error is not None else "no result"
    text += f" (tolerance {check.tolerance:g})" if check.tolerance is not None else ""
    if check.worst is not None:
        text += f"; worst at {check.worst.where}" if check.worst.where else ""
        if check.worst.q:
            text += f", q = [{', '.join(f'{value:.6g}' for value in check.worst.q)}]"
    return text


def _counts(checks: list[Check] | tuple[Check, ...]) -> dict[str, str]:
    return {
        "tests": str(len(checks)),
        "failures": str(sum(check.ok is False for check in checks)),
        "skipped": str(sum(check.ok is None for check in checks)),
    }


def _writable(text: str) -> str:
    """Replace what XML cannot hold: control characters, and bytes of file names that are no text."""
    return _UNWRITABLE.sub("?", text)
