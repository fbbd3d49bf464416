"""What a check of a repository found, and what of it was accepted before."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

from dh2sim.errors import Dh2simError, Problem
from dh2sim.input_files import json_content, read_input
from dh2sim.messages import shown
from dh2sim.model.slips import SlipKind
from dh2sim.validate.report import RobotReport


class CheckPart(StrEnum):
    """What is checked of a robot."""

    FILES = "files"
    """The robot file: its schema, its meshes, likely slips."""
    DRIFT = "drift"
    """Whether its exports are what an export would write."""
    POSES = "poses"
    """Every engine on the exports, against the table."""


RULES: Final = {
    "robot-file": "A robot file is wrong",
    "name-clash": "Two robots have one name, but each needs a folder of its own name",
    "drift": "An exported file is not what the robot file says",
    "engine": "An engine differs from the table, or refuses a file",
    SlipKind.DEGREES.value: "An angle looks like degrees in a file of radians",
    SlipKind.RADIANS.value: "An angle looks like radians in a file of degrees",
    SlipKind.ROUNDED.value: "A right angle is rounded",
    SlipKind.LIMITS.value: "Limits are beyond what cables stand",
    SlipKind.REACH.value: "A robot of this size is unlikely",
    SlipKind.MASS.value: "A robot of this mass is unlikely",
    SlipKind.CONVENTION.value: "The table looks like one of the other convention",
    SlipKind.FAR_FRAMES.value: "Frames are far from the robot",
}
"""Every rule, with what it finds."""
PART_OF_RULE: Final = {
    "name-clash": CheckPart.DRIFT,
    "drift": CheckPart.DRIFT,
    "engine": CheckPart.POSES,
    **dict.fromkeys((kind.value for kind in SlipKind), CheckPart.FILES),
}
"""The part that finds it; what reading the robot file finds is of every part."""
MAX_BYTES: Final = 10_000_000
"""Of a baseline."""
_WARNINGS: Final = {kind.value for kind in SlipKind}


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding(Problem):
    """One thing that is wrong, and where; places that are not known are 0."""

    rule: str
    """A key of RULES."""
    accepted: bool = False
    """Whether a baseline contains it."""

    @property
    def level(self) -> str:
        """'warning' for a likely slip, which an engineer may mean, else 'error'."""
        return "warning" if self.rule in _WARNINGS else "error"

    def __str__(self) -> str:
        """Return ``file:line:column: level [rule]: path: message``, as far as there is such a place."""
        place = f"{self.file}:{self.line}:{self.column}" if self.line else self.file
        path = f"{self.path}: " if self.path else ""
        return f"{place}: {self.level} [{self.rule}]: {path}{self.message}"

    def to_json(self) -> dict[str, Any]:
        """Return it as reports list it, without a place that it does not have."""
        entry: dict[str, Any] = {"rule": self.rule, "level": self.level, "file": self.file}
        if self.line:
            entry |= {"line": self.line, "column": self.column}
        return entry | {"path": self.path, "message": self.message, "accepted": self.accepted}

    @property
    def identity(self) -> tuple[str, str, str, str]:
        """What stays when lines move: by this a baseline knows it again."""
        return self.rule, self.file, self.path, self.message


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotCheck:
    """What was checked of one robot file."""

    file: str
    name: str | None
    """None where the file is wrong."""
    exports: str | None
    """Folder of its exports; None if there is none."""
    report: RobotReport | None
    """Of all engines; None if they were not asked."""
    findings: tuple[Finding, ...]
    seconds: float = 0.0

    @property
    def ok(self) -> bool:
        """Whether nothing was found that is not accepted."""
        return all(finding.accepted for finding in self.findings)

    @property
    def worst_error(self) -> tuple[float, float] | None:
        """The worst pose error of all engines, m and rad; None if none was asked."""
        checks = [] if self.report is None else self.report.checks
        errors = [
            (check.max_position_error, check.max_rotation_error)
            for check in checks
            if check.max_position_error is not None and check.max_rotation_error is not None
        ]
        return (max(error[0] for error in errors), max(error[1] for error in errors)) if errors else None

    def to_json(self) -> dict[str, Any]:
        """Return the entry of the ``robots`` list."""
        return {
            "file": self.file,
            "name": self.name,
            "ok": self.ok,
            "exports": self.exports,
            "engines": [] if self.report is None else [check.to_json() for check in self.report.checks],
            "findings": [finding.to_json() for finding in self.findings],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckReport:
    """What was checked of a repository."""

    robots: tuple[RobotCheck, ...]
    parts: tuple[CheckPart, ...]
    outdated: int = 0
    """Entries of the baseline that no longer occur."""

    @property
    def ok(self) -> bool:
        """Whether nothing was found that is not accepted."""
        return all(robot.ok for robot in self.robots)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Everything that was found, in the order of the robots."""
        return tuple(finding for robot in self.robots for finding in robot.findings)

    @property
    def failed(self) -> int:
        """Number of robots with a finding that is not accepted."""
        return sum(not robot.ok for robot in self.robots)

    def to_json(self) -> dict[str, Any]:
        """Return what ``dh2sim check --format json`` prints."""
        return {
            "ok": self.ok,
            "passed": len(self.robots) - self.failed,
            "failed": self.failed,
            "checked": [part.value for part in self.parts],
            "outdated_in_baseline": self.outdated,
            "robots": [robot.to_json() for robot in self.robots],
        }


# ---------------------------------------------------------------------------- baseline

_VERSION = 1
_KEYS = ("rule", "file", "path", "message")


@dataclass(frozen=True, slots=True)
class Baseline:
    """Findings that are accepted, each as often as it is listed; lines do not matter."""

    entries: tuple[tuple[str, str, str, str], ...] = ()

    @classmethod
    def of(cls, findings: Iterable[Finding]) -> Baseline:
        """Accept findings."""
        return cls(tuple(sorted(finding.identity for finding in findings)))

    @classmethod
    def read(cls, path: Path) -> Baseline:
        """Read a file that ``text`` made.

        Raises:
            Dh2simError: It cannot be read, or is not a baseline.
        """
        try:
            data = read_input(path, MAX_BYTES)
        except OSError as error:
            raise Dh2simError(f"cannot read the baseline '{path}': {error.strerror or error}") from error
        if len(data) > MAX_BYTES:
            raise Dh2simError(f"{path}: is larger than {MAX_BYTES // 10**6} MB, the most that is read of a baseline")
        try:
            content = json_content(data)
        except ValueError as error:
            raise Dh2simError(f"{path}: {error}") from None
        if not isinstance(content, dict) or content.get("version") != _VERSION:
            raise Dh2simError(f"{path}: is not a baseline of version {_VERSION}; write it with --write-baseline")
        entries = content.get("accepted")
        if not isinstance(entries, list):
            raise Dh2simError(f"{path}: accepted: must be a list")
        for index, entry in enumerate(entries):
            if not isinstance(entry, dict) or any(not isinstance(entry.get(key), str) for key in _KEYS):
                raise Dh2simError(f"{path}: accepted[{index}]: must have the texts {', '.join(_KEYS)}")
            if entry["rule"] not in RULES:
                raise Dh2simError(f"{path}: accepted[{index}].rule: unknown rule {shown(entry['rule'])}")
        return cls(tuple((entry["rule"], entry["file"], entry["path"], entry["message"]) for entry in entries))

    def text(self) -> str:
        """Return the content of a baseline file."""
        entries = [dict(zip(_KEYS, entry, strict=True)) for entry in self.entries]
        return json.dumps({"version": _VERSION, "accepted": entries}, indent=2, ensure_ascii=False) + "\n"

    def counts(self) -> Counter[tuple[str, str, str, str]]:
        """Return how often each entry is listed."""
        return Counter(self.entries)
