"""Grades of students' tables against a solution, and rubrics.

A table that is equal up to the free choices of frames is right. Of a wrong one the misreading is named, as ``diff``
does, and gives its points; where several explain it, those of the mildest.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType

from dh2sim.arguments import below_one, file_paths, instance
from dh2sim.compare.comparison import Comparison, compared, require_comparable
from dh2sim.compare.inputs import PLAINLY, ReadRobot, read_any
from dh2sim.compare.matching import ObstacleKind
from dh2sim.compare.misreadings import MisreadingKind
from dh2sim.errors import Dh2simError
from dh2sim.importing.sources import ImportOptions
from dh2sim.messages import did_you_mean, listed, shown
from dh2sim.robot.expressions import NumberError, to_number
from dh2sim.robot.spec import SpecLike
from dh2sim.robot.yaml_tree import Node, Report, compose, decode, read_yaml_file

TOLERANCE_OF_GRADES = 1e-3
"""rad, and m for a reach of up to 1 m, then of the reach: tables are rounded."""
_LABELS = ("the solution", "the submission")
_DANGEROUS = ("=", "+", "-", "@", "\t", "\r")
"""What a spreadsheet takes for the beginning of a formula."""


class Outcome(StrEnum):
    """What a submission is, besides a misreading of the solution."""

    RIGHT = "right"
    WRONG = "wrong"
    """Joints of the right types in the right number, and no single misreading explains the rest."""
    JOINTS = "joints"
    """Another number of joints, or other types, and no single misreading explains that."""
    UNREADABLE = "unreadable"


class FreeChoice(StrEnum):
    """What a table may choose freely, for which a rubric may take points off."""

    ZERO = "zero"
    """Joints start elsewhere."""
    SENSE = "sense"
    """Joints turn or slide the other way."""
    BASE = "base"
    TOOL = "tool"
    NAMES = "names"


_SHARES: Mapping[str, float] = MappingProxyType(
    {
        MisreadingKind.SIGN: 0.8,
        MisreadingKind.VALUE: 0.8,
        MisreadingKind.LENGTH_UNIT: 0.8,
        MisreadingKind.ANGLE_UNIT: 0.8,
        MisreadingKind.LOST: 0.7,
        MisreadingKind.ADDED: 0.7,
        MisreadingKind.SWAPPED_ROWS: 0.6,
        MisreadingKind.SWAPPED_COLUMNS: 0.6,
        MisreadingKind.SHIFTED: 0.5,
        MisreadingKind.REVERSED: 0.5,
        MisreadingKind.CONVENTION: 0.5,
        MisreadingKind.TYPE: 0.5,
        MisreadingKind.MISSING_ROW: 0.4,
        MisreadingKind.EXTRA_ROW: 0.4,
        Outcome.WRONG: 0.2,
        Outcome.JOINTS: 0.0,
        Outcome.UNREADABLE: 0.0,
    }
)
"""Shares of the points that a rubric gives by default."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rubric:
    """How many points a submission is worth, by what it is."""

    points: float = 10.0
    """Of a right table."""
    kinds: Mapping[str, float] = field(default_factory=dict)
    """Points by the kind of a misreading or outcome, instead of a share of ``points``."""
    off: Mapping[str, float] = field(default_factory=dict)
    """Points taken off a right table for what it may choose freely, by the choice; by default none."""

    def of(self, kind: str) -> float:
        """Return the points of a misreading or an outcome."""
        return self.kinds.get(kind, round(_SHARES[kind] * self.points, 2))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Grade:
    """What a submission is worth, and why."""

    submission: str
    """Its file."""
    points: float
    out_of: float
    outcome: str
    """An outcome, or the kind of the misreading that the points are for."""
    comments: tuple[str, ...]
    """Sentences for the student."""
    comparison: Comparison | None = field(default=None, repr=False)
    """None of an unreadable submission."""

    def __repr__(self) -> str:
        return f"<Grade of '{self.submission}': {self.points:g} of {self.out_of:g}, {self.outcome}>"

    @property
    def full(self) -> bool:
        """Whether nothing was taken off."""
        return self.points >= self.out_of

    def to_dict(self) -> dict[str, object]:
        """Return everything as plain data."""
        return {
            "submission": self.submission,
            "points": self.points,
            "out_of": self.out_of,
            "outcome": self.outcome,
            "comments": list(self.comments),
        }


def read_rubric(path: str | os.PathLike[str]) -> Rubric:
    """Read a rubric: ``points``, points by kind under ``kinds``, and deductions for free choices under ``off``.

    Raises:
        RobotFileError: It is wrong; the error holds everything that is.
        Dh2simError: It cannot be read.
    """
    data, report = read_yaml_file(path)
    root = compose(decode(data, report), report, needs="a rubric needs points, kinds or off")
    if report.problems:
        raise report.error()
    groups = {"kinds": tuple(_SHARES), "off": tuple(FreeChoice)}
    entries = _mapping(root, (), ("points", *groups), report)
    points = _points(entries.get("points"), ("points",), report)
    read = {
        name: {
            key: value
            for key, node in _mapping(entries.get(name), (name,), allowed, report).items()
            if (value := _points(node, (name, key), report)) is not None
        }
        for name, allowed in groups.items()
    }
    if report.problems:
        raise report.error()
    return Rubric(points=Rubric().points if points is None else points, kinds=read["kinds"], off=read["off"])


def _mapping(node: Node | None, loc: tuple[str, ...], allowed: Sequence[str], report: Report) -> dict[str, Node]:
    if node is None:
        return {}
    if not isinstance(node.value, dict):
        report.add(node.line, node.column, loc, f"expected a mapping, found {shown(_plain(node))}")
        return {}
    found = {}
    for key, entry in node.value.items():
        if key in allowed:
            found[key] = entry.value
        else:
            text = f"unknown key {shown(key)}.{did_you_mean(key, allowed)} Allowed: {listed(allowed)}"
            report.add(entry.line, entry.column, (*loc, key), text)
    return found


def _points(node: Node | None, loc: tuple[str, ...], report: Report) -> float | None:
    if node is None:
        return None
    value = node.value
    try:
        points = to_number(value, None)
    except NumberError:
        points = -1.0
    if points < 0.0:
        report.add(node.line, node.column, loc, f"expected a number of at least 0, found {shown(_plain(node))}")
        return None
    return points


def _plain(node: Node) -> object:
    value = node.value
    return value if isinstance(value, str | int | float | bool | None) else ([] if isinstance(value, list) else {})


def grade(
    solution: SpecLike | str | os.PathLike[str],
    submissions: Iterable[str | os.PathLike[str]] | str | os.PathLike[str],
    *,
    rubric: Rubric | None = None,
    tolerance: float = TOLERANCE_OF_GRADES,
    options: ImportOptions = PLAINLY,
) -> list[Grade]:
    """Grade students' tables against a solution.

    Args:
        solution: The right robot, in any form that ``diff`` takes.
        submissions: Files, or a file, of any kind that dh2sim reads.
        rubric: What submissions are worth; by default 10 points, and shares of them.
        tolerance: Greatest difference of tool0, rad, and m for a reach of up to 1 m, then of the reach.
        options: How tables are to be read that do not say it themselves.

    Raises:
        ArgumentError: An argument is of a wrong kind, or ``tolerance`` is not above 0 and below 1.
        Dh2simError: The solution cannot be read. A submission that cannot be is graded as unreadable.
    """
    files = file_paths("submissions", submissions)
    rubric = Rubric() if rubric is None else instance("rubric", rubric, Rubric)
    tolerance = below_one("tolerance", tolerance)
    instance("options", options, ImportOptions)
    right = read_any(solution)
    require_comparable(right.spec)
    return [_grade(right, os.fspath(file), rubric, tolerance, options) for file in files]


def _grade(right: ReadRobot, file: str, rubric: Rubric, tolerance: float, options: ImportOptions) -> Grade:
    try:
        read = read_any(file, options, strangers=True)
        require_comparable(read.spec)
    except (Dh2simError, OSError) as error:
        return Grade(
            submission=file,
            points=rubric.of(Outcome.UNREADABLE),
            out_of=rubric.points,
            outcome=Outcome.UNREADABLE,
            comments=tuple(str(error).splitlines()),
        )
    found = compared(right, read, tolerance, _LABELS)
    if found.equivalence is not None:
        off, comments = _chosen(found, rubric)
        points, outcome = max(0.0, rubric.points - off), str(Outcome.RIGHT)
    elif found.misreadings:
        mildest = max(found.misreadings, key=lambda misreading: rubric.of(misreading.kind))
        points, outcome = rubric.of(mildest.kind), str(mildest.kind)
        sentences = [misreading.sentence for misreading in found.misreadings]
        comments = [sentences[0], *(f"or: {sentence}" for sentence in sentences[1:])]
    else:
        kind = found.difference and found.difference.kind
        joints = kind in (ObstacleKind.COUNT, ObstacleKind.TYPE)
        outcome = str(Outcome.JOINTS if joints else Outcome.WRONG)
        points = rubric.of(outcome)
        comments = [found.difference.sentence] if found.difference else ["it moves otherwise than the solution"]
    return Grade(
        submission=file,
        points=points,
        out_of=rubric.points,
        outcome=outcome,
        comments=tuple(comments),
        comparison=found,
    )


def _chosen(found: Comparison, rubric: Rubric) -> tuple[float, list[str]]:
    """Return what a rubric takes off for free choices of a right table, and sentences on that."""
    same = found.equivalence
    assert same is not None
    used = {
        FreeChoice.ZERO: any(abs(joint.zero) > same.smallest for joint in same.joints),
        FreeChoice.SENSE: any(joint.sense < 0 for joint in same.joints),
        FreeChoice.BASE: same.base_differs,
        FreeChoice.TOOL: same.tool_differs,
        FreeChoice.NAMES: any(joint.a != joint.b for joint in same.joints),
    }
    charged = [choice for choice, differs in used.items() if differs and rubric.off.get(choice, 0.0) > 0.0]
    comments = [f"{rubric.off[choice]:g} off, as {choice} differs" for choice in charged]
    return sum(rubric.off[choice] for choice in charged), comments


def class_csv(grades: Iterable[Grade]) -> str:
    """Return grades as CSV, a line for each submission."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["submission", "points", "out_of", "outcome", "comment"])
    for given in grades:
        comment = "; ".join(given.comments)
        writer.writerow(
            [_harmless(given.submission), f"{given.points:g}", f"{given.out_of:g}", given.outcome, _harmless(comment)]
        )
    return out.getvalue()


def _harmless(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula."""
    return f"'{text}" if text.startswith(_DANGEROUS) else text
