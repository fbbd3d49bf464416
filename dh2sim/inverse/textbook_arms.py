"""The first three joints of an arm, which place the centre of its wrist: closed forms as textbooks derive them.

Sources: J. J. Craig, Introduction to Robotics, 3rd ed., 2005, sections 4.4 to 4.7; M. W. Spong, S. Hutchinson,
M. Vidyasagar, Robot Modeling and Control, 2006, section 3.3; B. Siciliano, L. Sciavicco, L. Villani, G. Oriolo,
Robotics: Modelling, Planning and Control, 2009, section 2.12; R. P. Paul, Robot Manipulators, 1981, chapter 3.

Lengths and angles are measured on the mechanism at zero: no letter depends on where the table puts its frames.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar, Final, Protocol

import numpy as np

from dh2sim.inverse.textbook_axes import ArmAxes, norm, wrapped
from dh2sim.inverse.textbook_steps import METRE, RAD, Signs, Worksheet, number, term
from dh2sim.typing import Array

DOUBLE: Final = 1e-7
"""rad, and share of the arm's size: two branches nearer than this are one, a double root."""

_MEASURED: Final = "Measured on the mechanism at zero; f is the arm's direction, z up along axis 1."

UNDETERMINED: Final = 1e-11
"""Share of the arm's size, within which a point is on an axis."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PartialBranch:
    """Coordinates of some joints, and the signs that lead to them."""

    signs: Signs
    q: tuple[float, ...]


class ArmPart(Protocol):
    """Three joints that place a point."""

    @property
    def title(self) -> str:
        """What textbooks call it."""
        ...

    @property
    def forearm(self) -> Array:
        """From the last joint towards the point at zero, in base_link, m, shape (3,); zero where nothing tells."""
        ...

    def describe(self, sheet: Worksheet) -> None:
        """Write the step that says what the letters are."""
        ...

    def solve(self, sheet: Worksheet, W: Array) -> list[PartialBranch]:
        """Write the steps to a point in base_link, m, shape (3,), and return every way to get there."""
        ...

    def names(self, q: Array, W: Array) -> tuple[str, ...]:
        """Return the names of a configuration's branch, given where the point is, m, shape (3,), in base_link."""
        ...


def placed_point(
    sheet: Worksheet, axes: ArmAxes, W0: Array, T: Array, T_base_link_arm: Array | None, title: str
) -> Array:
    """Write where the point that an arm places must be for a pose, and return it.

    Args:
        sheet: The worksheet.
        axes: The robot's axes.
        W0: The point at zero in base_link, m, shape (3,).
        T: The goal of tool0 in base_link, shape (4, 4).
        T_base_link_arm: Frame 0 of the derivation, shape (4, 4), if it has one.
        title: Of the step.

    Returns:
        In base_link, m, shape (3,).
    """
    c = axes.T_home[:3, :3].T @ (W0 - axes.tip)
    c = np.where(np.abs(c) <= 1e-12 * axes.size, 0.0, c)
    W = T[:3, :3] @ c + T[:3, 3]
    moved = T_base_link_arm is not None and not np.allclose(T_base_link_arm, np.eye(4), rtol=0.0, atol=1e-12)
    if norm(c) == 0.0:
        formula, remark = "p_w = p", "It is where tool0 is."
    elif norm(c[:2]) == 0.0:
        n = len(axes.joints)
        formula = f"p_w = p {'-' if c[2] < 0.0 else '+'} d{n} z{n}"
        remark = f"z{n} is the third column of the goal; d{n} = {sheet.measure(abs(float(c[2])))}."
    else:
        formula = "p_w = p + R c"
        remark = f"It is at c = ({', '.join(sheet.length(float(x)) for x in c)}) in tool0; R is the goal's rotation."
    where = "frame 0 of the derivation" if moved else "base_link"
    sheet.step(title, formula, remark=f"{remark} x, y, z are those of p_w in {where}.")
    for letter, value, part in zip("xyz", W.tolist(), T[:3, 3].tolist(), strict=True):
        text = sheet.length(part) + term(sheet.length(value - part)) if norm(c) else ""
        sheet.line(f"p_w{letter}" if moved else letter, value, METRE, text)
    if moved and T_base_link_arm is not None:
        local = T_base_link_arm[:3, :3].T @ (W - T_base_link_arm[:3, 3])
        for letter, value in zip("xyz", local.tolist(), strict=True):
            sheet.line(letter, value, METRE, "")
    return np.asarray(W)


@dataclass(frozen=True, slots=True, kw_only=True)
class FromAngle:
    """How a joint's coordinate follows from an angle that is measured on the mechanism."""

    joint: int
    """Counted from 1."""
    letter: str
    at_zero: float
    """The angle at coordinate zero, rad."""
    sense: int = 1
    """+1 or -1: whether the angle grows with the coordinate."""

    @property
    def plain(self) -> bool:
        """Whether the angle is the coordinate."""
        return self.sense == 1 and self.at_zero == 0.0

    @property
    def symbol(self) -> str:
        """What the angle is called in formulas."""
        return f"q{self.joint}" if self.plain else self.letter

    @property
    def formula(self) -> str:
        """How the coordinate follows, or nothing where it is the angle."""
        if self.plain:
            return ""
        if self.at_zero == 0.0:
            return f"q{self.joint} = -{self.letter}"
        parts = (self.letter, f"{self.letter}0") if self.sense == 1 else (f"{self.letter}0", self.letter)
        return f"q{self.joint} = {parts[0]} - {parts[1]}"

    def describe(self, sheet: Worksheet) -> None:
        """Write what the angle is at zero, where it is not zero."""
        if self.at_zero != 0.0:
            sheet.letter(f"{self.letter}0", self.at_zero, RAD, f"{self.letter} at q{self.joint} = 0")

    def write(self, sheet: Worksheet, angle: float, numbers: str, signs: Signs) -> float:
        """Write the angle and the coordinate, and return the coordinate, rad."""
        sheet.turned(self.symbol, angle, numbers, signs)
        angle = wrapped(angle)
        coordinate = self.sense * (angle - self.at_zero)
        if not self.plain:
            first, second = (angle, self.at_zero) if self.sense == 1 else (self.at_zero, angle)
            shown = sheet.angle(first) + term(sheet.angle(-second)) if self.at_zero != 0.0 else ""
            sheet.turned(f"q{self.joint}", coordinate, shown, signs)
        return wrapped(coordinate)


def from_angle(joint: int, letter: str, at_zero: float, sense: float = 1.0) -> FromAngle:
    """Return how a joint's coordinate follows from an angle; an angle that is zero but for rounding is zero."""
    at_zero = wrapped(at_zero)
    return FromAngle(
        joint=joint, letter=letter, at_zero=0.0 if abs(at_zero) < 1e-12 else at_zero, sense=1 if sense > 0.0 else -1
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shoulder:
    """Joint 1 turns a plane that holds the rest of the arm, beside the axis or through it."""

    T_base_link_arm: Array = field(repr=False)
    """Frame 0 of the derivation: z along axis 1; shape (4, 4)."""
    azimuth: FromAngle
    """Of the plane's direction f, from x about z."""
    offset: float
    """d: how far the plane is from axis 1, on the side of y where f is along x; m."""
    size: float
    tolerance: float
    """Offsets below this, m, count as none in names."""
    front: float = 0.0
    """How far axis 2 is before axis 1 along f, m."""
    sense: float = 1.0
    """Positive where axis 2 points along y, if f is along x."""

    def describe(self, sheet: Worksheet) -> None:
        """Write what the letters are."""
        if self.offset != 0.0:
            sheet.letter("d", self.offset, METRE)
        self.azimuth.describe(sheet)

    def solve(self, sheet: Worksheet, W: Array, radius: str) -> list[tuple[Signs, float, float, float]]:
        """Write the step of joint 1.

        Args:
            sheet: The worksheet.
            W: The point in base_link, m, shape (3,).
            radius: What the distance in the plane is called in the formulas.

        Returns:
            Signs, q1, coordinates of the point in the plane along f and along z, for each way to get there.
        """
        x, y, z = self.T_base_link_arm[:3, :3].T @ (W - self.T_base_link_arm[:3, 3])
        d, plane = self.offset, self.azimuth
        root = "sqrt(x² + y² - d²)" if d else "sqrt(x² + y²)"
        sheet.step(
            f"Joint {plane.joint}: turn the arm's plane through the wrist centre, seen along axis {plane.joint}",
            f"{radius} = σ1 {root},  σ1 = +1 or -1",
            f"{plane.symbol} = atan2(y, x) - atan2(d, {radius})" if d else f"{plane.symbol} = atan2(σ1 y, σ1 x)",
            plane.formula,
        )
        squared = x * x + y * y - d * d
        numbers = f"{sheet.square(x)} + {sheet.square(y)}" + (f" - {sheet.square(d)}" if d else "")
        tiny = UNDETERMINED * self.size
        if squared < -2.0 * tiny * max(abs(d), tiny):
            sheet.line("x² + y² - d²", squared, "", numbers)
            short = abs(d) - math.hypot(x, y)
            sheet.note(
                f"Out of reach: the wrist centre is {sheet.measure(math.hypot(x, y))} from axis {plane.joint}, "
                f"the arm's plane never nearer than {sheet.measure(abs(d))}: {sheet.measure(short)} too near."
            )
            return []
        distance = math.sqrt(max(0.0, squared))
        if distance <= math.sqrt(UNDETERMINED) * self.size if d else distance <= tiny:
            if not d:
                sheet.note(
                    f"Shoulder singular: the wrist centre is on axis {plane.joint}, so that any "
                    f"q{plane.joint} will do; 0 is taken here."
                )
                sheet.line(f"q{plane.joint}", 0.0, RAD, "any: the wrist centre is on the axis")
                return [((("σ1", 1),), 0.0, 0.0, float(z))]
            sheet.note(
                f"Shoulder singular: the wrist centre is as near to axis {plane.joint} as it gets; "
                "both choices of σ1 are one."
            )
        ways = []
        for s1 in (1, -1) if distance > DOUBLE * self.size else (1,):
            signs: Signs = (("σ1", s1),)
            rho = s1 * distance
            sheet.line(radius, rho, METRE, f"{'-' if s1 < 0 else ''}sqrt({numbers})", signs)
            if d:
                angle = math.atan2(y, x) - math.atan2(d, rho)
                text = f"atan2({sheet.length(y)}, {sheet.length(x)}) - atan2({sheet.length(d)}, {sheet.length(rho)})"
            else:
                angle = math.atan2(s1 * y, s1 * x)
                text = f"atan2({sheet.length(s1 * y)}, {sheet.length(s1 * x)})"
            ways.append((signs, plane.write(sheet, angle, text, signs), rho, float(z)))
        return ways

    def rho(self, q1: float, W: Array) -> tuple[float, float]:
        """Return where a point in base_link is in the plane: along f and along z, m."""
        x, y, z = self.T_base_link_arm[:3, :3].T @ (W - self.T_base_link_arm[:3, 3])
        angle = self.azimuth.at_zero + self.azimuth.sense * q1
        return float(x * math.cos(angle) + y * math.sin(angle)), float(z)

    def name(self, rho: float) -> Iterator[str]:
        """Yield the shoulder's name where it has one, given the point's coordinate along f, m.

        Seen from the base towards the point: the arm beside axis 1 is its left or right one. Where the plane holds
        axis 1, the arm reaches to its front or over its back, if joint 2 is before the axis; else axis 2 points
        left or right.
        """
        if abs(rho) <= self.tolerance:
            return
        if abs(self.offset) > self.tolerance:
            yield "left" if rho * self.offset > 0.0 else "right"
        elif abs(self.front) > self.tolerance:
            yield "front" if rho * self.front > 0.0 else "back"
        else:
            yield "left" if rho * self.sense > 0.0 else "right"


def law_of_cosines(
    sheet: Worksheet, along: float, across: float, l2: float, l3: float, letters: tuple[str, str], signs: Signs
) -> tuple[tuple[int, float], ...]:
    """Write the bend of a two-link arm to a point, and return the signs and angles, rad, that reach it.

    Args:
        sheet: The worksheet.
        along: The point's first coordinate from where the first link turns, m.
        across: Its second, m.
        l2: Length of the first link, m.
        l3: Of the second, m.
        letters: Those of the lengths.
        signs: That lead here.
    """
    reach = math.hypot(along, across)
    cosine = (along * along + across * across - l2 * l2 - l3 * l3) / (2.0 * l2 * l3)
    numbers = (
        f"({sheet.square(along)} + {sheet.square(across)} - {sheet.square(l2)} - {sheet.square(l3)})"
        f" / (2 · {sheet.length(l2)} · {sheet.length(l3)})"
    )
    sheet.line("cos γ", cosine, "", numbers, signs)
    if abs(cosine) > 1.0 + 1e-10:
        far = reach - (l2 + l3) if cosine > 0.0 else abs(l2 - l3) - reach
        sheet.note(
            f"Out of reach by {sheet.measure(far)}{with_signs(signs)}: the point is {sheet.measure(reach)} away, and "
            f"{letters[0]} {'+' if cosine > 0.0 else '-'} {letters[1]} = "
            f"{sheet.measure(l2 + l3 if cosine > 0.0 else abs(l2 - l3))}."
        )
        return ()
    bend = math.acos(min(1.0, max(-1.0, cosine)))
    if bend < 1e-6 or bend > math.pi - 1e-6:
        how = "straight" if bend < 1.0 else "folded"
        sheet.note(
            f"Elbow {how}{with_signs(signs)}: both choices of its sign are one, and the arm is singular there."
        )
        return ((1, bend),)
    return (1, bend), (-1, -bend)


def acos_text(sign: int, bend: float) -> str:
    """Return how a bend, rad, is computed from its cosine."""
    return f"{'-' if sign < 0 else ''}acos({number(math.cos(bend))})"


def with_signs(signs: Signs) -> str:
    """Return which signs a note is about, or nothing."""
    shown = ", ".join(f"{letter} = {sign:+d}" for letter, sign in signs)
    return f" with {shown}" if shown else ""


def first_link_angle(
    sheet: Worksheet, along: float, across: float, l2: float, l3: float, gamma: float
) -> tuple[float, str]:
    """Return the angle, rad, of a bent two-link arm's first link, and how it is computed."""
    opposite, adjacent = l3 * math.sin(gamma), l2 + l3 * math.cos(gamma)
    text = (
        f"atan2({sheet.length(across)}, {sheet.length(along)})"
        f" - atan2({sheet.length(opposite)}, {sheet.length(adjacent)})"
    )
    return math.atan2(across, along) - math.atan2(opposite, adjacent), text


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElbowArm:
    """R R R: axis 1 at right angles to axes 2 and 3, which are parallel; an arm with an upper arm and a forearm."""

    title: ClassVar[str] = "elbow arm (axis 2 at right angles to axis 1, axis 3 parallel to axis 2)"
    shoulder: Shoulder
    a1: float
    """From axis 1 to axis 2 along f, m."""
    d1: float
    """Height of axis 2, m."""
    l2: float
    l3: float
    elevation: FromAngle
    bend: FromAngle
    forearm: Array

    def describe(self, sheet: Worksheet) -> None:
        """Write the step that says what the letters are."""
        sheet.step("What the letters are", remark=_MEASURED)
        for letter, value in (("a1", self.a1), ("d1", self.d1)):
            if value != 0.0:
                sheet.letter(letter, value, METRE)
        sheet.letter("l2", self.l2, METRE, "axis 2 to axis 3")
        sheet.letter("l3", self.l3, METRE, "axis 3 to the wrist centre")
        self.shoulder.describe(sheet)
        self.elevation.describe(sheet)
        self.bend.describe(sheet)

    def solve(self, sheet: Worksheet, W: Array) -> list[PartialBranch]:
        """Write the steps to a point in base_link, m, shape (3,), and return every way to get there."""
        ways = self.shoulder.solve(sheet, W, "r")
        if not ways:
            return []
        sheet.step(
            "Joint 3: the elbow, by the law of cosines in the arm's plane",
            f"u = r - a1,  {self._v}" if self.a1 else f"u = r,  {self._v}",
            "cos γ = (u² + v² - l2² - l3²) / (2 l2 l3)",
            f"{self.bend.symbol} = σ3 acos(cos γ),  σ3 = +1 or -1",
            self.bend.formula,
        )
        bent = []
        for signs, q1, rho, z in ways:
            u, v = rho - self.a1, z - self.d1
            for s3, gamma in law_of_cosines(sheet, u, v, self.l2, self.l3, ("l2", "l3"), signs):
                with_s3: Signs = (*signs, ("σ3", s3))
                q3 = self.bend.write(sheet, gamma, acos_text(s3, gamma), with_s3)
                bent.append((with_s3, q1, q3, gamma, u, v))
        if not bent:
            return []
        found = []
        sheet.step(
            "Joint 2: the upper arm points at the wrist centre, less the triangle's angle",
            f"{self.elevation.symbol} = atan2(v, u) - atan2(l3 sin γ, l2 + l3 cos γ)",
            self.elevation.formula,
        )
        for signs, q1, q3, gamma, u, v in bent:
            beta, text = first_link_angle(sheet, u, v, self.l2, self.l3, gamma)
            q2 = self.elevation.write(sheet, beta, text, signs)
            found.append(PartialBranch(signs=signs, q=(q1, q2, q3)))
        return found

    @property
    def _v(self) -> str:
        return "v = z - d1" if self.d1 else "v = z"

    def names(self, q: Array, W: Array) -> tuple[str, ...]:
        """Return the names of a configuration's branch, given where the point is, m, shape (3,), in base_link."""
        rho, _ = self.shoulder.rho(float(q[0]), W)
        gamma = self.bend.at_zero + self.bend.sense * float(q[2])
        ahead = rho - self.a1
        return (*self.shoulder.name(rho), *elbow_name(gamma if ahead >= 0.0 else -gamma, ("below", "above")))


def elbow_name(bend: float, names: tuple[str, str]) -> Iterator[str]:
    """Yield the name of a bend, rad, for its positive and negative side; nothing where it is straight or folded."""
    if abs(math.sin(bend)) > 1e-6:
        yield names[0] if math.sin(bend) > 0.0 else names[1]


def shoulder_of(axes: ArmAxes, W0: Array) -> tuple[Shoulder, Array, Array, Array]:
    """Return the shoulder of an arm whose axes 1 and 2 are at right angles; f, y and z in base_link at zero."""
    T = axes.base_frame(0)
    x, y, z = T[:3, 0], T[:3, 1], T[:3, 2]
    w2 = axes.joints[1].direction
    f = np.cross(w2, z)
    f /= norm(f)
    along = float(f @ x)
    if along < -1e-9 or (abs(along) <= 1e-9 and float(f @ y) < 0.0):
        f = -f
    e = np.cross(z, f)
    offset = float((W0 - T[:3, 3]) @ e)
    before = float((axes.joints[1].point - T[:3, 3]) @ f)
    return (
        Shoulder(
            T_base_link_arm=T,
            azimuth=from_angle(1, "φ", math.atan2(float(f @ y), float(f @ x))),
            offset=length_of(axes, offset),
            size=axes.size,
            tolerance=axes.tolerance * axes.size,
            front=before,
            sense=float(w2 @ e),
        ),
        f,
        e,
        z,
    )


def length_of(axes: ArmAxes, value: float) -> float:
    """Return a length, m; zero where only rounding is left."""
    return 0.0 if abs(value) <= 1e-12 * axes.size else value


def elbow_arm(axes: ArmAxes, W0: Array) -> ElbowArm | None:
    """Return joints 1 to 3 as an elbow arm that places a point, at zero in base_link; None if they are not."""
    if axes.kinds[:3] != "RRR" or not axes.perpendicular(0, 1) or not axes.parallel(1, 2):
        return None
    shoulder, f, e, z = shoulder_of(axes, W0)
    origin = shoulder.T_base_link_arm[:3, 3]
    upper = axes.joints[2].point - axes.joints[1].point
    fore = W0 - axes.joints[2].point
    fore = fore - e * float(fore @ e)
    l2, l3 = math.hypot(float(upper @ f), float(upper @ z)), math.hypot(float(fore @ f), float(fore @ z))
    if axes.is_short(l2) or axes.is_short(l3):
        return None
    rise = math.atan2(float(upper @ z), float(upper @ f))
    bend = math.atan2(float(fore @ z), float(fore @ f)) - rise
    return ElbowArm(
        shoulder=shoulder,
        a1=length_of(axes, float((axes.joints[1].point - origin) @ f)),
        d1=length_of(axes, float((axes.joints[1].point - origin) @ z)),
        l2=l2,
        l3=l3,
        # turning about e takes f downwards
        elevation=from_angle(2, "β", rise, -float(axes.joints[1].direction @ e)),
        bend=from_angle(3, "γ", bend, -float(axes.joints[2].direction @ e)),
        forearm=fore,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SphericalArm:
    """R R P: axis 1 at right angles to axis 2, and axis 2 to the slide; the Stanford arm's first three joints."""

    title: ClassVar[str] = "spherical arm (two turning axes at right angles, then a slide)"
    shoulder: Shoulder
    a1: float
    d1: float
    b: float
    """Distance of the point from the slide's line through axis 2, m, on the side away from z."""
    c: float
    """How far the point is along the slide from axis 2 at q3 = 0, m."""
    slope: FromAngle
    """Of the slide, from z towards f."""
    forearm: Array

    def describe(self, sheet: Worksheet) -> None:
        """Write the step that says what the letters are."""
        sheet.step("What the letters are", remark=_MEASURED)
        for letter, value in (("a1", self.a1), ("d1", self.d1), ("b", self.b), ("c", self.c)):
            if value != 0.0:
                sheet.letter(letter, value, METRE)
        self.shoulder.describe(sheet)
        self.slope.describe(sheet)

    def solve(self, sheet: Worksheet, W: Array) -> list[PartialBranch]:
        """Write the steps to a point in base_link, m, shape (3,), and return every way to get there."""
        ways = self.shoulder.solve(sheet, W, "r")
        if not ways:
            return []
        root = "sqrt(u² + v² - b²)" if self.b else "sqrt(u² + v²)"
        sheet.step(
            "Joint 3: the slide's length in the arm's plane",
            f"u = {'r - a1' if self.a1 else 'r'},  v = {'z - d1' if self.d1 else 'z'}",
            f"q3 = σ3 {root}{' - c' if self.c else ''},  σ3 = +1 or -1",
            remark="σ3 = -1 pulls the slide backwards through joint 2.",
        )
        slid = []
        for signs, q1, rho, z in ways:
            u, v = rho - self.a1, z - self.d1
            squared = u * u + v * v - self.b * self.b
            numbers = f"{sheet.square(u)} + {sheet.square(v)}" + (f" - {sheet.square(self.b)}" if self.b else "")
            tiny = UNDETERMINED * self.shoulder.size
            if squared < -2.0 * tiny * max(abs(self.b), tiny):
                sheet.note(
                    f"Out of reach{with_signs(signs)}: the wrist centre is {sheet.measure(math.hypot(u, v))} from "
                    f"axis 2, the slide's line never nearer than {sheet.measure(abs(self.b))}."
                )
                continue
            out = math.sqrt(max(0.0, squared))
            double = out <= DOUBLE * self.shoulder.size
            if double:
                sheet.note(
                    f"Slide at axis 2{with_signs(signs)}: both choices of σ3 are one"
                    + (", and any q2 will do; 0 is taken here." if not self.b else ", and the arm is singular there.")
                )
            for s3 in (1,) if double else (1, -1):
                with_s3: Signs = (*signs, ("σ3", s3))
                text = f"{'-' if s3 < 0 else ''}sqrt({numbers})"
                sheet.line(
                    "q3", s3 * out - self.c, METRE, text + (term(sheet.length(-self.c)) if self.c else ""), with_s3
                )
                slid.append((with_s3, q1, s3 * out, u, v))
        if not slid:
            return []
        sheet.step(
            "Joint 2: the slide points at the wrist centre; its angle is counted from z",
            f"{self.slope.symbol} = atan2(σ3 u, σ3 v)"
            if not self.b
            else f"{self.slope.symbol} = atan2(u, v) - atan2(b, q3{term('c') if self.c else ''})",
            self.slope.formula,
        )
        found = []
        for signs, q1, out, u, v in slid:
            side = -1.0 if out < 0.0 else 1.0
            if self.b:
                angle = math.atan2(u, v) - math.atan2(self.b, out)
                text = (
                    f"atan2({sheet.length(u)}, {sheet.length(v)})"
                    f" - atan2({sheet.length(self.b)}, {sheet.length(out)})"
                )
            else:
                free = abs(out) <= DOUBLE * self.shoulder.size
                angle = self.slope.at_zero if free else math.atan2(side * u, side * v)
                text = "any" if free else f"atan2({sheet.length(side * u)}, {sheet.length(side * v)})"
            q2 = self.slope.write(sheet, angle, text, signs)
            found.append(PartialBranch(signs=signs, q=(q1, q2, out - self.c)))
        return found

    def names(self, q: Array, W: Array) -> tuple[str, ...]:
        """Return the names of a configuration's branch, given where the point is, m, shape (3,), in base_link."""
        rho, _ = self.shoulder.rho(float(q[0]), W)
        return (*self.shoulder.name(rho), *slide_name(float(q[2]) + self.c, self.shoulder.tolerance))


def slide_name(out: float, tolerance: float) -> Iterator[str]:
    """Yield the name of a slide's branch, given how far it is pulled out, m."""
    if abs(out) > tolerance:
        yield "slide out" if out > 0.0 else "slide back"


def spherical_arm(axes: ArmAxes, W0: Array) -> SphericalArm | None:
    """Return joints 1 to 3 as a spherical arm that places a point, at zero in base_link; None if they are not."""
    if axes.kinds[:3] != "RRP" or not axes.perpendicular(0, 1) or not axes.perpendicular(1, 2):
        return None
    shoulder, f, e, z = shoulder_of(axes, W0)
    P2, s = axes.joints[1].point, axes.joints[2].direction
    origin = shoulder.T_base_link_arm[:3, 3]
    slope = math.atan2(float(s @ f), float(s @ z))
    beside = f * math.cos(slope) - z * math.sin(slope)
    return SphericalArm(
        shoulder=shoulder,
        a1=length_of(axes, float((P2 - origin) @ f)),
        d1=length_of(axes, float((P2 - origin) @ z)),
        b=length_of(axes, float((W0 - P2) @ beside)),
        c=length_of(axes, float((W0 - P2) @ s)),
        slope=from_angle(2, "ψ", slope, float(axes.joints[1].direction @ e)),
        forearm=s * axes.size,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CylindricalArm:
    """A turning and a sliding joint about and along one direction, in either order, then a slide across."""

    title: ClassVar[str] = "cylindrical arm (turn about and slide along one direction, then slide across it)"
    shoulder: Shoulder
    turn: int
    """Joint that turns, counted from 0."""
    lift: int
    """Joint that slides along it, counted from 0."""
    upwards: int
    """+1 or -1: whether the lift's positive coordinate goes along z."""
    height: float
    """Of the point at zero, m."""
    c: float
    """Of the point from the axis along f at zero, m."""
    forearm: Array

    def describe(self, sheet: Worksheet) -> None:
        """Write the step that says what the letters are."""
        sheet.step("What the letters are", remark="Measured on the mechanism at zero; z along the turning axis.")
        for letter, value in (("h", self.height), ("c", self.c)):
            if value != 0.0:
                sheet.letter(letter, value, METRE)
        self.shoulder.describe(sheet)

    def solve(self, sheet: Worksheet, W: Array) -> list[PartialBranch]:
        """Write the steps to a point in base_link, m, shape (3,), and return every way to get there."""
        ways = self.shoulder.solve(sheet, W, "r")
        if not ways:
            return []
        lift = f"q{self.lift + 1}"
        rise = "z - h" if self.upwards > 0 else "h - z"
        sheet.step(
            "Joints that slide: across by what is left, and up by the height",
            f"q3 = {'r - c' if self.c else 'r'}",
            f"{lift} = {rise if self.height else ('z' if self.upwards > 0 else '-z')}",
            remark="σ1 = -1 turns the arm away and pulls its slide back through the axis.",
        )
        found = []
        for signs, turned, rho, z in ways:
            out, up = rho - self.c, self.upwards * (z - self.height)
            sheet.line("q3", out, METRE, sheet.length(rho) + (term(sheet.length(-self.c)) if self.c else ""), signs)
            first, second = (z, self.height) if self.upwards > 0 else (self.height, z)
            sheet.line(
                lift, up, METRE, sheet.length(first) + term(sheet.length(-second)) if self.height else "", signs
            )
            q = [0.0, 0.0, out]
            q[self.turn], q[self.lift] = turned, up
            found.append(PartialBranch(signs=signs, q=tuple(q)))
        return found

    def names(self, q: Array, W: Array) -> tuple[str, ...]:
        """Return the names of a configuration's branch, given where the point is, m, shape (3,), in base_link."""
        del W
        return tuple(slide_name(float(q[2]) + self.c, self.shoulder.tolerance))


def cylindrical_arm(axes: ArmAxes, W0: Array) -> CylindricalArm | None:
    """Return joints 1 to 3 as a cylindrical arm that places a point, at zero in base_link; None if they are not."""
    if axes.kinds[:3] not in ("RPP", "PRP") or not axes.parallel(0, 1) or not axes.perpendicular(1, 2):
        return None
    turn = axes.kinds.index("R")
    T = axes.base_frame(turn)
    f, z = axes.joints[2].direction, T[:3, 2]
    e = np.cross(z, f)
    relative = W0 - T[:3, 3]
    return CylindricalArm(
        shoulder=Shoulder(
            T_base_link_arm=T,
            azimuth=from_angle(turn + 1, "φ", math.atan2(float(f @ T[:3, 1]), float(f @ T[:3, 0]))),
            offset=length_of(axes, float(relative @ e)),
            size=axes.size,
            tolerance=axes.tolerance * axes.size,
        ),
        turn=turn,
        lift=1 - turn,
        upwards=1 if float(axes.joints[1 - turn].direction @ z) > 0.0 else -1,
        height=length_of(axes, float(relative @ z)),
        c=length_of(axes, float(relative @ f)),
        forearm=f * axes.size,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CartesianArm:
    """P P P along three directions at right angles."""

    title: ClassVar[str] = "Cartesian arm (three slides at right angles)"
    directions: Array
    """Of the slides in base_link, a row each, shape (3, 3)."""
    at_zero: Array
    """The point along them at zero, m, shape (3,)."""
    forearm: Array

    def describe(self, sheet: Worksheet) -> None:
        """Write the step that says what the letters are."""
        sheet.step("What the letters are", remark="e1, e2, e3 are the directions of the slides.")
        for letter, direction in zip(("e1", "e2", "e3"), self.directions, strict=True):
            sheet.vector(letter, direction)

    def solve(self, sheet: Worksheet, W: Array) -> list[PartialBranch]:
        """Write the steps to a point in base_link, m, shape (3,), and return the way to get there."""
        sheet.step("Joints 1 to 3: the wrist centre along the slides", "qi = ei · p - ei · p(0)")
        along = self.directions @ W
        for i, (here, zero) in enumerate(zip(along.tolist(), self.at_zero.tolist(), strict=True), start=1):
            sheet.line(f"q{i}", here - zero, METRE, sheet.length(here) + term(sheet.length(-zero)))
        return [PartialBranch(signs=(), q=tuple((along - self.at_zero).tolist()))]

    def names(self, q: Array, W: Array) -> tuple[str, ...]:
        """Return no names: there is one branch."""
        del q, W
        return ()


def cartesian_arm(axes: ArmAxes, W0: Array) -> CartesianArm | None:
    """Return joints 1 to 3 as a Cartesian arm that places a point, at zero in base_link; None if they are not."""
    if axes.kinds[:3] != "PPP" or not all(axes.perpendicular(i, j) for i, j in ((0, 1), (1, 2), (2, 0))):
        return None
    directions = np.array([joint.direction for joint in axes.joints[:3]])
    return CartesianArm(directions=directions, at_zero=directions @ W0, forearm=np.zeros(3))


def arm_part(axes: ArmAxes, W0: Array) -> ArmPart | None:
    """Return joints 1 to 3 as the arm of a textbook that places a point; None if they are none.

    Args:
        axes: The robot's axes.
        W0: The point at zero in base_link, m, shape (3,); it moves with link 3.
    """
    return elbow_arm(axes, W0) or spherical_arm(axes, W0) or cylindrical_arm(axes, W0) or cartesian_arm(axes, W0)
