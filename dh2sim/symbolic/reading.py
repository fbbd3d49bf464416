"""A robot's table read in symbols: parameters stay letters, and numbers are exact.

A robot in memory holds evaluated numbers; what they were made of is read from the text of its file once more, by the
same grammar with polynomials instead of doubles. A value that the text does not give, because the robot was made in
code or changed after it was read, is the exact decimal fraction that its double is printed as.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Final, Literal

from dh2sim.errors import Dh2simError
from dh2sim.messages import Loc
from dh2sim.robot.expressions import ExpressionError, evaluate, evaluate_in
from dh2sim.robot.links import Pose
from dh2sim.robot.row import Convention, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit
from dh2sim.robot.yaml_tree import Node, Report, compose
from dh2sim.symbolic.angles import Angle, slide
from dh2sim.symbolic.constant_rows import constant_runs
from dh2sim.symbolic.polynomial import ONE, ZERO, NotPolynomialError, Polynomial, Rational, exact_number, simple
from dh2sim.symbolic.table import METRES, Letter, Motion, Run, SymbolicTable

_SNAP: Final = 4e-16
"""Share by which a double may differ from the multiple of 15 degrees that it stands for."""
_SNAP_PRODUCT: Final = 4e-15
"""The same of an angle that was computed of others."""


def symbolic_table(spec: RobotSpec, *, letters: bool = False, numbers: bool = False) -> SymbolicTable:
    """Return the table of a robot in symbols.

    Args:
        spec: The robot.
        letters: Whether lengths that are plain numbers get letters too: a1, d1, …
        numbers: Whether parameters of the file are numbers instead of letters.

    Returns:
        With the parameters of the robot file as letters, expressions over them exact.
    """
    reader = _Reader(spec, letters=letters, numbers=numbers)
    motions: list[Motion] = []
    frames = {"base_link": 0}
    motions += reader.pose_motions(spec.base.pose, "base")
    frames["dh_0"] = len(motions)
    for i, row in enumerate(spec.rows, start=1):
        link_part, joint_part = reader.row_motions(i, row)
        if row.convention is Convention.MODIFIED:
            motions += [*link_part, *joint_part]
            frames[f"link_{i}"] = len(motions)
        else:
            motions += joint_part
            frames[f"link_{i}"] = len(motions)
            motions += link_part
        frames[f"dh_{i}"] = len(motions)
    motions += reader.pose_motions(spec.tool.pose, "tool")
    frames["tool0"] = len(motions)
    runs = [] if letters else reader.constant_runs(motions, frames)
    used = reader.used_letters([*motions, *(motion for run in runs for motion in run.motions)])
    return SymbolicTable(spec=spec, motions=motions, frames=frames, letters=used, runs=runs)


class _Expressions:
    """Computes expressions of a robot file exactly; parameters are atoms, or what they stand for."""

    def __init__(self, values: Mapping[str, Polynomial]) -> None:
        self._values = values

    def number(self, text: str) -> Polynomial:
        return Polynomial.number(simple(Fraction(text)))

    def name(self, name: str) -> Polynomial:
        return Polynomial.atom("pi") if name == "pi" else self._values[name]

    def call(self, function: str, arguments: list[Polynomial]) -> Polynomial:
        value = arguments[0].constant
        if function == "sqrt" and value is not None and value >= 0:
            numerator, denominator = Fraction(value).numerator, Fraction(value).denominator
            root = Fraction(math.isqrt(numerator), math.isqrt(denominator))
            if root * root == value:
                return Polynomial.number(simple(root))
        raise NotPolynomialError

    def power(self, base: Polynomial, exponent: Polynomial) -> Polynomial:
        power = exponent.constant
        if power is None or power != int(power) or not -4 <= power <= 4:
            raise NotPolynomialError
        if power < 0:
            return ONE / base ** int(-power)
        return base ** int(power)


class _Reader:
    """Reads the values of a robot as polynomials and angles, and names constants."""

    def __init__(self, spec: RobotSpec, *, letters: bool, numbers: bool) -> None:
        self._spec = spec
        self._give_letters = letters
        self._degrees = spec.units.angle is AngleUnit.DEG and spec.source_file is not None
        self._units = spec.units
        self._named: dict[str, Letter] = {}
        self._tree = _tree(spec)
        self._parameters = {
            name: Polynomial.number(exact_number(value)) if numbers else Polynomial.atom(name)
            for name, value in spec.parameters.items()
        }
        if numbers:
            self._evaluate_parameters()
        self._expressions = _Expressions(self._parameters)

    def _evaluate_parameters(self) -> None:
        """Give parameters that are rational expressions of others their exact values."""
        for name in self._parameters:
            node = self._tree.at("parameters", name) if self._tree else None
            if node is not None and isinstance(node.value, str):
                try:
                    value = evaluate_in(node.value, _Expressions(self._parameters)).constant
                except (ExpressionError, ArithmeticError, KeyError):
                    continue
                if value is not None and math.isclose(value, self._spec.parameters[name], rel_tol=1e-14):
                    self._parameters[name] = Polynomial.number(value)

    # ------------------------------------------------------------ motions

    def row_motions(self, i: int, row: Row) -> tuple[list[Motion], list[Motion]]:
        """Return the motions of the link part and of the joint part of row i, counted from 1."""
        index = i - 1 if row.convention is Convention.MODIFIED else i
        at = ("joints", i - 1)
        a = self._length((*at, "a"), row.a, f"a{index}")
        d = self._length((*at, "d"), row.d, f"d{i}")
        alpha = self._angle((*at, "alpha"), row.alpha, f"alpha_{index}")
        beta = self._angle((*at, "beta"), row.beta, f"beta_{index}")
        theta = self._angle((*at, "theta"), row.theta, f"phi_{i}")
        sign = -1 if row.flip else 1
        if row.type.turns:
            theta = theta + Angle.of({i: sign})
        elif row.type.moves:
            d = d + Polynomial.atom(slide(i)).scaled(sign)
        joint = [Motion("Rz", theta), _shift(z=d)]
        link = [_shift(x=a), Motion("Rx", alpha), Motion("Ry", beta)]
        return link, joint

    def pose_motions(self, pose: Pose, owner: Literal["base", "tool"]) -> list[Motion]:
        """Return the motions of the pose of the base or the tool."""
        shift = [
            self._length((owner, "xyz", k), value, f"{owner}_{axis}")
            for k, (axis, value) in enumerate(zip("xyz", pose.xyz.tolist(), strict=True))
        ]
        roll, pitch, yaw = (
            self._angle((owner, "rpy", k), value, f"{owner}_{name}")
            for k, (name, value) in enumerate(zip(("roll", "pitch", "yaw"), pose.rpy.tolist(), strict=True))
        )
        return [_shift(*shift), Motion("Rz", yaw), Motion("Ry", pitch), Motion("Rx", roll)]

    # ------------------------------------------------------------ values

    def _length(self, at: Loc, value: float, letter: str) -> Polynomial:
        """Return a length in the file's unit; ``value`` is in m."""
        if value == 0.0:
            return ZERO
        found = self._found(at, value, self._units.metres)
        if found is None:
            found = Polynomial.number(simple(exact_number(value) / METRES[self._units.length]))
        if isinstance(found, tuple):
            return Polynomial.atom(self._name(letter, found[1], "length", found[0]))
        if found.constant is None or not self._give_letters:
            return found
        return Polynomial.atom(self._name(letter, float(found.constant), "length"))

    def _angle(self, at: Loc, value: float, letter: str) -> Angle:
        """Return an angle; ``value`` is in rad. An odd constant gets a name."""
        exact = _simple_degrees(value)
        if exact is not None:
            return Angle(degrees=exact)
        found = self._found(at, value, self._units.radians)
        if isinstance(found, Polynomial):
            angle = self._as_angle(found)
            if angle is not None:
                return angle
        definition = found[0] if isinstance(found, tuple) else ""
        for letter_, known in self._named.items():
            if known.kind == "angle" and known.definition == definition and abs(known.value) == abs(value):
                return Angle.of(names={letter_: 1 if known.value == value else -1})
        return Angle.of(names={self._name(letter, value, "angle", definition): 1})

    def _as_angle(self, value: Polynomial) -> Angle | None:
        """Return a linear expression as an angle, None if it is another one, or an odd number."""
        names: dict[str, Rational] = {}
        degrees: Rational = 0
        for monomial, number in value.terms.items():
            match monomial:
                case ():
                    if not self._degrees:
                        return None
                    degrees += number
                case (("pi", 1),) if not self._degrees:
                    degrees += 180 * number
                case ((name, 1),) if name in self._spec.parameters:
                    own = _simple_degrees(self._units.radians(self._spec.parameters[name]))
                    if own is not None:
                        degrees += own * number
                    else:
                        names[name] = number
                case _:
                    return None
        if degrees % 15 or not names:
            return None
        return Angle.of(names=names, degrees=degrees)

    def _found(self, at: Loc, value: float, to_si: Callable[[float], float]) -> Polynomial | tuple[str, float] | None:
        """Return what the file says of a value.

        Returns:
            A polynomial; or, for an expression that is none, its text and value in the file's unit; or None where the
            file does not have the value.
        """
        node = self._tree.at(*at) if self._tree else None
        if node is None or node.value is None or isinstance(node.value, bool | list | dict):
            return None
        if not isinstance(node.value, str):
            number = exact_number(node.value)
            return Polynomial.number(number) if _same(to_si(float(node.value)), value) else None
        try:
            result = evaluate_in(node.value, self._expressions)
        except (ArithmeticError, ValueError):
            result = None
        if result is not None:
            own = result.value({"pi": math.pi, **self._spec.parameters})
            return result if _same(to_si(own), value) else None
        own = evaluate(node.value, self._spec.parameters)
        return (" ".join(node.value.split()), own) if _same(to_si(own), value) else None

    def _name(self, wanted: str, value: float, kind: Literal["length", "angle", "number"], text: str = "") -> str:
        """Return the name of a new constant."""
        name = wanted
        while name in self._named or name in self._spec.parameters:
            name += "_"
        self._named[name] = Letter(name, value, kind, text)
        return name

    def constant_runs(self, motions: Sequence[Motion], frames: Mapping[str, int]) -> list[Run]:
        """Return the stretches of fixed rows that are shorter as one transform."""

        def angle(value: float, letter: str) -> Angle:
            exact = _simple_degrees(value, _SNAP_PRODUCT)
            return (
                Angle(degrees=exact) if exact is not None else Angle.of(names={self._name(letter, value, "angle"): 1})
            )

        def length(value: float, letter: str) -> Polynomial:
            return Polynomial.atom(self._name(letter, value, "length"))

        fixed = [i for i, row in enumerate(self._spec.rows, start=1) if not row.type.moves]
        return list(constant_runs(motions, frames, fixed, dict(self._named), angle, length)) if fixed else []

    def used_letters(self, motions: Sequence[Motion]) -> dict[str, Letter]:
        """Return the constants that motions use."""
        angles = {name for motion in motions for name, _ in motion.angle.names}
        lengths = {atom for motion in motions for entry in motion.shift for atom in entry.atoms}
        letters: dict[str, Letter] = {}
        for name, value in self._spec.parameters.items():
            node = self._tree.at("parameters", name) if self._tree else None
            text = " ".join(node.value.split()) if node is not None and isinstance(node.value, str) else ""
            if name in angles:
                letters[name] = Letter(name, self._units.radians(value), "angle", text)
            elif name in lengths:
                letters[name] = Letter(name, value, "length", text)
        return letters | {name: letter for name, letter in self._named.items() if name in angles | lengths}


def _tree(spec: RobotSpec) -> Node | None:
    """Return the nodes of the file that a robot was read from."""
    if spec.source_file is None:
        return None
    try:
        return compose(spec.source_file.text, Report(spec.source_file.name))
    except Dh2simError:
        return None


def _same(left: float, right: float) -> bool:
    return math.isclose(left, right, rel_tol=1e-12, abs_tol=1e-15)


def _simple_degrees(angle: float, share: float = _SNAP) -> int | None:
    """Return the multiple of 15 degrees that an angle, rad, is to within rounding, or None."""
    twelfths = round(angle / (math.pi / 12))
    near = twelfths * math.pi / 12
    return 15 * twelfths if abs(angle - near) <= share * max(1.0, abs(near)) else None


def _shift(x: Polynomial = ZERO, y: Polynomial = ZERO, z: Polynomial = ZERO) -> Motion:
    return Motion("T", shift=(x, y, z))
