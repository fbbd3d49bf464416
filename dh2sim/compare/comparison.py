"""Whether two robots are the same mechanism, and what is different about them."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from dh2sim.arguments import below_one
from dh2sim.compare.fitting import Fit, ToolResidual, any_fit, best_fit, joint_samples, measured
from dh2sim.compare.geometry import LABELS, Difference, first_difference
from dh2sim.compare.inputs import PLAINLY, ReadRobot, read_any
from dh2sim.compare.matching import MARGIN, Correspondence, Obstacle, ObstacleKind, correspondences
from dh2sim.compare.misreadings import Misreading, misreadings
from dh2sim.compare.quantities import JointPair, QuantityDifference, quantity_differences
from dh2sim.compare.screws import ScrewAxes, axes_of
from dh2sim.compare.words import degrees, millimetres, pose_text
from dh2sim.errors import Dh2simError
from dh2sim.importing.sources import ImportOptions
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import invert
from dh2sim.robot.spec import RobotSpec, SpecLike
from dh2sim.typing import Array

TOLERANCE = 1e-6
"""rad, and m for a reach of up to 1 m, then of the reach."""
CONFIGURATIONS = 1000
MOST_JOINTS = 64
"""That move, of robots that are compared: time grows with their fourth power."""
_LOOSER = (1e-5, 1e-4, 1e-3, 1e-2)
"""Tolerances at which robots that differ are compared once more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class JointCorrespondence:
    """How the coordinate of a joint of B follows from that of A: q_B = sense q_A + zero."""

    a: str
    """Name of the joint in A."""
    b: str
    """Name of the joint in B."""
    turns: bool
    sense: int
    """1, or -1 where B turns or slides the other way."""
    zero: float
    """The coordinate of B at which A is at zero, rad or m."""

    def formula(self, smallest: float) -> str:
        """Return the coordinate of B in terms of q, that of A; zeros up to ``smallest`` are left out."""
        if abs(self.zero) <= smallest:
            return "-q" if self.sense < 0 else "q"
        size = degrees(abs(self.zero)) if self.turns else millimetres(abs(self.zero))
        if self.sense < 0:
            return f"{'-' if self.zero < 0 else ''}{size} - q"
        return f"q {'-' if self.zero < 0 else '+'} {size}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Equivalence:
    """How one robot is to be read as the other: FK_B(q_B) = T_base FK_A(q_A) T_tool."""

    joints: tuple[JointCorrespondence, ...]
    """In the order of A's joints."""
    order: tuple[int, ...]
    """The index in B of each joint of A: other than 0, 1, … where joints may be exchanged, as slides may."""
    T_a_base_b_base: Array = field(repr=False)
    """Pose of B's base_link in A's, shape (4, 4)."""
    T_a_tool_b_tool: Array = field(repr=False)
    """Pose of B's tool0 in A's, shape (4, 4)."""
    links: tuple[Array, ...] = field(repr=False)
    """Motions that take link i of A, at coordinate zero and in base_link, to that of B; each of shape (4, 4)."""
    residual: ToolResidual
    smallest: float
    """rad and m up to which nothing is said: the tolerance."""

    @property
    def base_differs(self) -> bool:
        """Whether base_link is elsewhere in B."""
        return bool(pose_text(self.T_a_base_b_base, self.smallest))

    @property
    def tool_differs(self) -> bool:
        """Whether tool0 is elsewhere in B."""
        return bool(pose_text(self.T_a_tool_b_tool, self.smallest))

    def sentences(self, label: str = LABELS[1]) -> Iterator[str]:
        """Yield what differs although the mechanism is the same; ``label`` is what B is called."""
        for joint in self.joints:
            does = "turns" if joint.turns else "slides"
            parts = []
            if joint.sense < 0:
                parts.append(f"{does} the other way")
            if abs(joint.zero) > self.smallest:
                parts.append(f"starts at {degrees(joint.zero) if joint.turns else millimetres(joint.zero)}")
            if parts:
                yield f"{joint.b} of {label} {' and '.join(parts)}"
        if self.order != tuple(range(len(self.order))):
            yield f"joints of {label} are in another order: {', '.join(joint.b for joint in self.joints)}"
        if base := pose_text(self.T_a_base_b_base, self.smallest):
            yield f"base differs by {base}"
        if tool := pose_text(self.T_a_tool_b_tool, self.smallest):
            yield f"tool differs by {tool}"
        renamed = [f"{joint.a} is {joint.b}" for joint in self.joints if joint.a != joint.b]
        if renamed:
            yield f"names differ: {', '.join(renamed)}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Comparison:
    """What comparing robot A with robot B found; as text, the verdict and a line for each difference."""

    a: RobotSpec
    b: RobotSpec
    tolerance: float
    """rad, and m for a reach of up to 1 m, then of the reach."""
    equivalence: Equivalence | None
    """How B is to be read as A; None if they are different mechanisms."""
    difference: Difference | None
    """Where the mechanisms first differ."""
    same_at: float | None
    """A greater tolerance at which they would be the same."""
    misreadings: tuple[Misreading, ...]
    """Single misreadings of the table of A that give B; each was tested by making it."""
    notes: tuple[str, ...] = ()
    """What was chosen or left out when the files were read."""
    labels: tuple[str, str] = LABELS
    """What A and B are called in sentences."""
    quantities: tuple[QuantityDifference, ...] = ()
    """Limits, masses, inertias, gains that both give, and give differently; of the same mechanism."""

    @property
    def same(self) -> bool:
        """Whether both are the same mechanism."""
        return self.equivalence is not None

    @property
    def equal(self) -> bool:
        """Whether both are the same mechanism, with the same limits, masses and gains as far as both give them."""
        return self.same and not self.quantities

    def __repr__(self) -> str:
        verdict = "equal" if self.equal else "the same mechanism" if self.same else "different"
        return f"<Comparison of '{self.a.name}' with '{self.b.name}': {verdict}>"

    def __str__(self) -> str:
        found = [*self.sentences(), *map(str, self.quantities)]
        verdict = "The same mechanism" if self.same else "Different mechanisms"
        end = ", but:" if self.same and found else "."
        return "\n".join([verdict + end, *(f"  - {sentence}" for sentence in found)])

    def sentences(self) -> list[str]:
        """Return what is different, in words: of the same mechanism, or of two."""
        if self.equivalence is not None:
            return list(self.equivalence.sentences(self.labels[1]))
        found = [] if self.difference is None else [f"first difference: {self.difference.sentence}"]
        if self.same_at is not None:
            found.append(f"they are the same to a tolerance of {_rounded_up(self.same_at)}")
        if self.misreadings:
            several = len(self.misreadings) > 1
            intro = "a single misreading would explain it" if several else "one misreading explains it"
            found += [f"{intro}: {misreading.sentence}" for misreading in self.misreadings]
        else:
            found.append("no single misreading of the table explains it")
        return found

    def to_dict(self) -> dict[str, object]:
        """Return everything as plain data."""
        made: dict[str, object] = {"a": self.a.name, "b": self.b.name, "same": self.same, "equal": self.equal}
        made["tolerance"] = self.tolerance
        if (same := self.equivalence) is not None:
            made["joints"] = [
                {"a": joint.a, "b": joint.b, "sense": joint.sense, "zero": joint.zero} for joint in same.joints
            ]
            made["base"] = same.T_a_base_b_base.tolist()
            made["tool"] = same.T_a_tool_b_tool.tolist()
            made["residual"] = {
                "position": same.residual.position,
                "rotation": same.residual.rotation,
                "configurations": same.residual.configurations,
            }
        else:
            difference = self.difference
            made["difference"] = difference and {
                "kind": difference.kind.value,
                "joints": list(difference.joints),
                "a": difference.a,
                "b": difference.b,
                "sentence": difference.sentence,
            }
            made["same_at"] = self.same_at
            made["misreadings"] = [
                {"kind": m.kind.value, "rows": list(m.rows), "columns": list(m.columns), "sentence": m.sentence}
                for m in self.misreadings
            ]
        made["quantities"] = [
            {"joint": found.joint, "quantity": found.quantity, "a": found.a, "b": found.b}
            for found in self.quantities
        ]
        made["sentences"] = self.sentences()
        made["notes"] = list(self.notes)
        return made


def _rounded_up(value: float) -> str:
    """Return a number of two digits that is not smaller."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return f"{math.ceil(value / unit) * unit:.1e}"


def diff(
    a: SpecLike | str | os.PathLike[str],
    b: SpecLike | str | os.PathLike[str],
    *,
    tolerance: float = TOLERANCE,
    options_a: ImportOptions = PLAINLY,
    options_b: ImportOptions = PLAINLY,
) -> Comparison:
    """Compare two robots: the same mechanism, up to base, tool, zeros and senses of joints, and names?

    Args:
        a: A robot; the name of one that comes with dh2sim; or a file of any kind that dh2sim reads.
        b: The robot to compare with it.
        tolerance: Greatest difference of tool0, rad, and m for a reach of up to 1 m, then of the reach.
        options_a: Which part of a file to import, and how.
        options_b: The same for ``b``.

    Raises:
        Dh2simError: A file is wrong, or a robot has closed loops, branches, or more than ``MOST_JOINTS`` joints that
            move.
    """
    tolerance = below_one("tolerance", tolerance)
    of_a, of_b = read_any(a, options_a), read_any(b, options_b)
    for read in (of_a, of_b):
        require_comparable(read.spec)
    return compared(of_a, of_b, tolerance)


def require_comparable(spec: RobotSpec) -> None:
    """Refuse a robot whose comparison would take minutes.

    Raises:
        Dh2simError: More than ``MOST_JOINTS`` of its joints move.
    """
    count = len(spec.moving_rows)
    if count > MOST_JOINTS:
        raise Dh2simError(f"{spec.name}: {count} joints move; robots with at most {MOST_JOINTS} can be compared")


def compared(a: ReadRobot, b: ReadRobot, tolerance: float, labels: tuple[str, str] = LABELS) -> Comparison:
    """Compare two robots that were read; ``labels`` are what they are called in sentences."""
    of_a, of_b = axes_of(a.spec), axes_of(b.spec)
    fit = best_fit(of_a, of_b, tolerance)
    notes = (*(f"A: {note}" for note in a.notes), *(f"B: {note}" for note in b.notes))
    equivalence = None
    if isinstance(fit, Fit) and fit.good:
        equivalence = _equivalence(a.spec, b.spec, of_a, of_b, fit, tolerance)
    if equivalence is not None:
        return Comparison(
            a=a.spec,
            b=b.spec,
            tolerance=tolerance,
            equivalence=equivalence,
            difference=None,
            quantities=_quantities(a.spec, b.spec, equivalence, tolerance),
            same_at=None,
            misreadings=(),
            notes=notes,
            labels=labels,
        )
    return Comparison(
        a=a.spec,
        b=b.spec,
        tolerance=tolerance,
        equivalence=None,
        difference=(
            first_difference(of_a, of_b, fit, tolerance, labels)
            if isinstance(fit, Obstacle)
            else _sum(of_a, of_b, fit.residual, tolerance, labels)
        ),
        same_at=_same_at(a.spec, b.spec, of_a, of_b, tolerance),
        misreadings=misreadings(a.spec, b.spec, tolerance),
        notes=notes,
        labels=labels,
    )


def _sum(a: ScrewAxes, b: ScrewAxes, residual: ToolResidual, tolerance: float, labels: tuple[str, str]) -> Difference:
    """Return the difference of mechanisms none of whose numbers is far off by itself, with the first that is off."""
    text = (
        f"number by number they nearly agree, but tool0 is up to {millimetres(residual.position)} and "
        f"{degrees(residual.rotation)} off"
    )
    closer = tolerance / MARGIN
    found = correspondences(a, b, closer)
    if isinstance(found, Obstacle):
        first = first_difference(a, b, found, closer, labels)
        if first.a is not None and first.b is not None and first.a != first.b:
            return replace(first, kind=ObstacleKind.SUM, sentence=f"{text}: {first.sentence}")
    return Difference(kind=ObstacleKind.SUM, joints=(), a=None, b=None, sentence=text)


def _quantities(a: RobotSpec, b: RobotSpec, same: Equivalence, tolerance: float) -> tuple[QuantityDifference, ...]:
    pairs = [
        JointPair(a=i, b=k, sense=float(joint.sense), zero=joint.zero, T_b_a=T)
        for i, (k, joint, T) in enumerate(zip(same.order, same.joints, same.links[1:], strict=True))
    ]
    return quantity_differences(a, b, pairs, tolerance)


def _equivalence(
    a: RobotSpec, b: RobotSpec, of_a: ScrewAxes, of_b: ScrewAxes, fit: Fit, tolerance: float
) -> Equivalence | None:
    """Return what a fit means, measured on the tables themselves; None if it is not good enough there."""
    way = _tidied(fit.correspondence, of_a.turns)
    place = np.argsort(fit.order)
    residual = measured(
        lambda q: table_tool_pose(a, q),
        lambda q: table_tool_pose(b, q[:, place]),
        way,
        joint_samples(of_a, CONFIGURATIONS),
    )
    if not residual.within(tolerance, max(of_a.reach, of_b.reach)):
        return None
    joints = tuple(
        JointCorrespondence(
            a=of_a.names[i], b=of_b.names[k], turns=of_a.turns[i], sense=int(way.senses[i]), zero=float(way.zeros[i])
        )
        for i, k in enumerate(fit.order)
    )
    return Equivalence(
        joints=joints,
        order=fit.order,
        T_a_base_b_base=invert(way.T_base),
        T_a_tool_b_tool=way.T_tool,
        links=way.links,
        residual=residual,
        smallest=tolerance * max(1.0, of_a.reach, of_b.reach),
    )


_ROUNDING = 1e-12


def _tidied(way: Correspondence, turns: tuple[bool, ...]) -> Correspondence:
    """Return the correspondence without what is rounding alone, and with angles in (-pi, pi]."""

    def rounded(value: float) -> float:
        for simple in (0.0, math.pi / 2, -math.pi / 2, math.pi, -math.pi):
            if abs(value - simple) <= _ROUNDING:
                return abs(simple) if simple == -math.pi else simple
        return value

    zeros = [
        rounded(math.remainder(zero, 2 * math.pi) if turn else zero)
        for zero, turn in zip(way.zeros.tolist(), turns, strict=True)
    ]
    return replace(way, zeros=np.array(zeros))


def _same_at(a: RobotSpec, b: RobotSpec, of_a: ScrewAxes, of_b: ScrewAxes, tolerance: float) -> float | None:
    for looser in _LOOSER:
        if looser > tolerance:
            fit = any_fit(of_a, of_b, looser)
            if fit is not None:
                same = _equivalence(a, b, of_a, of_b, fit, looser)
                if same is not None:
                    return max(same.residual.rotation, same.residual.position / max(1.0, of_a.reach, of_b.reach))
    return None
