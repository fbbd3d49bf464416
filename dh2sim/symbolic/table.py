"""The DH table in symbols: letters, exact numbers, and the elementary motions of every row; and their products."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from fractions import Fraction
from typing import Final, Literal, NamedTuple

from dh2sim.errors import Dh2simError, UnknownFrameError
from dh2sim.messages import did_you_mean
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import LengthUnit
from dh2sim.symbolic.angles import Angle, trig_of
from dh2sim.symbolic.polynomial import ONE, ROOTS, ZERO, Atom, Matrix, Polynomial, identity, product

MOST_TERMS: Final = 20_000
"""That a matrix may have when its products are multiplied out."""
METRES: Final = {
    LengthUnit.M: Fraction(1),
    LengthUnit.MM: Fraction(1, 1000),
    LengthUnit.CM: Fraction(1, 100),
    LengthUnit.IN: Fraction(254, 10000),
}


class Fold(StrEnum):
    """Across which axes the angles of neighbouring rows are added up."""

    PARALLEL = "parallel"
    """Axes that point the same way: c12 for the cosine of theta_1 + theta_2."""
    ALL = "all"
    """Axes that point opposite ways too, whose angles are subtracted."""
    NONE = "none"
    """No axes: every row has a cosine and a sine of its own."""


class _TooLargeError(Exception):
    """A product has too many terms."""


class Letter(NamedTuple):
    """A named constant."""

    name: str
    value: float
    """In the file's length unit, rad, or neither, as what it is used for."""
    kind: Literal["length", "angle", "acceleration", "number"]
    definition: str = ""
    """How it is made of others; empty for a plain number."""


class Motion(NamedTuple):
    """A rotation about x, y or z, or a translation."""

    kind: Literal["Rx", "Ry", "Rz", "T"]
    angle: Angle = Angle()
    shift: tuple[Polynomial, Polynomial, Polynomial] = (ZERO, ZERO, ZERO)

    @property
    def inverse(self) -> Motion:
        """The motion back."""
        x, y, z = self.shift
        return Motion(self.kind, -self.angle, (-x, -y, -z))


class Run(NamedTuple):
    """A stretch of constant motions, and the motions, with the same product, that stand for them."""

    start: int
    end: int
    motions: Sequence[Motion]


@dataclass(frozen=True, kw_only=True, eq=False)
class SymbolicTable:
    """A robot's table in symbols.

    Angles are in atoms; lengths are in the file's unit, and so are the coordinates of sliding rows.
    """

    spec: RobotSpec = field(repr=False)
    motions: Sequence[Motion] = field(repr=False)
    """From base_link to tool0."""
    frames: Mapping[str, int]
    """How many motions lead from base_link to each frame: base_link, dh_0 … dh_n, link_1 … link_n, tool0."""
    letters: Mapping[str, Letter]
    """The constants that occur, by name, parameters of the file first."""
    runs: Sequence[Run] = ()
    """Stretches of motions that are shorter as others, in order."""

    @property
    def unit(self) -> LengthUnit:
        """Unit of lengths, which is the file's."""
        return self.spec.units.length

    @property
    def exact_unit(self) -> Fraction:
        """Unit of lengths, m."""
        return METRES[self.unit]

    @property
    def moving(self) -> tuple[int, ...]:
        """Rows with a coordinate, counted from 1, in the order of a joint vector."""
        return tuple(i for i, row in enumerate(self.spec.rows, start=1) if row.type.moves)

    def path(self, source: str, target: str) -> list[Motion]:
        """Return the motions from one frame to another.

        Raises:
            UnknownFrameError: There is no such frame.
        """
        start, end = self._index(source), self._index(target)
        if start <= end:
            return self._between(start, end)
        return [motion.inverse for motion in reversed(self._between(end, start))]

    def _between(self, start: int, end: int) -> list[Motion]:
        motions: list[Motion] = []
        for run in self.runs:
            if start <= run.start and run.end <= end:
                motions += [*self.motions[start : run.start], *run.motions]
                start = run.end
        return [*motions, *self.motions[start:end]]

    def pose(self, source: str = "base_link", target: str = "tool0", *, fold: Fold = Fold.PARALLEL) -> Matrix:
        """Return the pose of frame ``target`` in frame ``source``: 4 rows of 4 polynomials.

        Raises:
            UnknownFrameError: There is no such frame.
            Dh2simError: It has more terms than anybody could read.
        """
        motions = self.path(source, target)
        try:
            return transform(motions, fold)
        except _TooLargeError:
            raise Dh2simError(
                f"{self.spec.name}: the pose of {target} in {source} has more than {MOST_TERMS} terms when it is "
                "written out; ask for a shorter part of the arm"
            ) from None

    def outermost(self, source: str, target: str, *, from_tool: bool) -> list[list[Atom]]:
        """Return cosines and sines of constant angles before the first coordinate between two frames, angle by angle.

        Nested outermost, they leave the entries of the matrix behind them whole, which rows then share.

        Args:
            source: The frame to begin with.
            target: The frame to end with.
            from_tool: Whether to begin with ``target``.

        Raises:
            UnknownFrameError: There is no such frame.
        """
        motions = self.path(source, target)
        angles = [motion.angle for motion in (motions[::-1] if from_tool else motions) if motion.kind != "T"]
        groups = []
        for angle in itertools.takewhile(lambda angle: angle.is_constant, angles):
            c, s = angle.cos_sin()
            groups.append(sorted((c.atoms | s.atoms) - ROOTS.keys()))
        return [group for group in groups if group]

    def _index(self, frame: str) -> int:
        if frame not in self.frames:
            n = len(self.spec.rows)
            hint = did_you_mean(frame, self.frames)
            raise UnknownFrameError(
                f"{self.spec.name}: unknown frame '{frame}'.{hint} "
                f"Frames: base_link, dh_0 … dh_{n}, link_1 … link_{n}, tool0"
            )
        return self.frames[frame]


def constant_value(table: SymbolicTable, atom: Atom) -> float | None:
    """Return the value of an atom that does not depend on the configuration; None for any other."""
    if atom in ROOTS:
        return math.sqrt(ROOTS[atom])
    trig = trig_of(atom)
    if trig is None:
        letter = table.letters.get(atom)
        return None if letter is None else letter.value
    if not trig.angle.is_constant:
        return None
    angle = constant_angle(trig.angle, table.letters)
    return math.cos(angle) if trig.function == "cos" else math.sin(angle)


def constant_angle(angle: Angle, letters: Mapping[str, Letter]) -> float:
    """Return the value, rad, of an angle that does not depend on the configuration."""
    named = math.fsum(float(n) * letters[name].value for name, n in angle.names)
    return math.radians(angle.degrees) + named


def transform(motions: Sequence[Motion], fold: Fold) -> Matrix:
    """Return the product of motions: 4 rows of 4 polynomials.

    Raises:
        _TooLargeError: It has too many terms.
    """
    result = identity(4)
    for block in reversed(list(_blocks(motions, fold))):
        result = product(block, result)
        if sum(len(entry.terms) for row in result for entry in row) > MOST_TERMS:
            raise _TooLargeError
    return result


def _blocks(motions: Sequence[Motion], fold: Fold) -> Iterator[Matrix]:
    """Yield factors of a product of motions; while axes are parallel, their angles are added up in one factor."""
    angle, position, sign, begun = Angle(), (ZERO, ZERO, ZERO), 1, False
    for kind, turn, shift in motions:
        if kind == "T":
            if any(shift):
                x, y, z = shift[0], shift[1].scaled(sign), shift[2].scaled(sign)
                c, s = angle.cos_sin()
                position = (position[0] + c * x - s * y, position[1] + s * x + c * y, position[2] + z)
                begun = True
        elif not turn.names and turn.is_constant and turn.degrees % 360 == 0:
            continue
        elif kind == "Rz":
            if fold is Fold.NONE and not angle.is_constant:
                yield _block(angle, position, sign)
                angle, position, sign = Angle(), (ZERO, ZERO, ZERO), 1
            angle = angle + turn.scaled(sign)
            begun = True
        elif kind == "Rx" and fold is Fold.ALL and turn.is_constant and not turn.names and turn.degrees % 180 == 0:
            sign = -sign
            begun = True
        else:
            if begun:
                yield _block(angle, position, sign)
            angle, position, sign, begun = Angle(), (ZERO, ZERO, ZERO), 1, False
            yield _rotation(kind, turn)
    if begun:
        yield _block(angle, position, sign)


def _block(angle: Angle, position: Sequence[Polynomial], sign: int) -> Matrix:
    """Return Rz(angle), turned over by 180 degrees about x if ``sign`` is -1, at a position."""
    c, s = angle.cos_sin()
    x, y, z = position
    return [
        [c, -s.scaled(sign), ZERO, x],
        [s, c.scaled(sign), ZERO, y],
        [ZERO, ZERO, ONE.scaled(sign), z],
        [ZERO, ZERO, ZERO, ONE],
    ]


def _rotation(kind: str, angle: Angle) -> Matrix:
    c, s = angle.cos_sin()
    matrix = identity(4)
    i, j = (1, 2) if kind == "Rx" else (2, 0)
    matrix[i][i], matrix[i][j], matrix[j][i], matrix[j][j] = c, -s, s, c
    return matrix
