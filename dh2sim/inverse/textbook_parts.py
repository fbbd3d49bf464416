"""Steps that the closed forms of several arms share: shoulder, elbow, and how coordinates follow from angles.

Sources: J. J. Craig, Introduction to Robotics, 3rd ed., 2005, sections 4.4 to 4.7; M. W. Spong, S. Hutchinson,
M. Vidyasagar, Robot Modeling and Control, 2006, section 3.3; R. P. Paul, Robot Manipulators, 1981, chapter 3.

Lengths and angles are measured on the mechanism at zero: no letter depends on where the table puts its frames.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Final, TypeAlias

import numpy as np

from dh2sim.inverse.textbook_axes import ArmAxes, norm, wrapped
from dh2sim.inverse.textbook_steps import METRE, RAD, Signs, Worksheet, number, term
from dh2sim.typing import Array

DOUBLE: Final = 1e-7
"""rad, and share of the arm's size: two branches nearer than this are one, a double root."""

MEASURED: Final = "Measured on the mechanism at zero; f is the arm's direction, z up along axis 1."

_STRAIGHT: Final = 1e-6
"""Sine of a bend, or share of the arm's size, within which it is none: double solutions are known to about 1e-8."""
UNDETERMINED: Final = 1e-11
"""Share of the arm's size, within which a point is on an axis."""


Names: TypeAlias = tuple[str, ...]
"""What the parts of one configuration's branch are called."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PartialBranch:
    """Coordinates of some joints, and the signs that lead to them."""

    signs: Signs
    q: tuple[float, ...]


def placed_point(sheet: Worksheet, axes: ArmAxes, W0: Array, T: Array, T_base_link_arm: Array, title: str) -> Array:
    """Write where the point that an arm places must be for a pose, and return it.

    Args:
        sheet: The worksheet.
        axes: The robot's axes.
        W0: The point at zero in base_link, m, shape (3,).
        T: The goal of tool0 in base_link, shape (4, 4).
        T_base_link_arm: Frame 0 of the derivation, shape (4, 4).
        title: Of the step.

    Returns:
        In base_link, m, shape (3,).
    """
    c = axes.T_home[:3, :3].T @ (W0 - axes.tip)
    c = np.where(np.abs(c) <= 1e-12 * axes.size, 0.0, c)
    W = T[:3, :3] @ c + T[:3, 3]
    moved = not np.allclose(T_base_link_arm, np.eye(4), rtol=0.0, atol=1e-12)
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
    if moved:
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

    def angles(self, q: Array) -> list[float]:
        """Return the angle, rad, in joint vectors of shape (k, n)."""
        angles: list[float] = (self.at_zero + self.sense * q[:, self.joint - 1]).tolist()
        return angles

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

    def rho(self, q: Array, W: Array) -> list[float]:
        """Return where points in base_link, shape (k, 3), are along f in configurations of shape (k, n), m."""
        x, y, _ = ((W - self.T_base_link_arm[:3, 3]) @ self.T_base_link_arm[:3, :3]).T
        angle = self.azimuth.at_zero + self.azimuth.sense * q[:, self.azimuth.joint - 1]
        along: list[float] = (x * np.cos(angle) + y * np.sin(angle)).tolist()
        return along

    def name(self, rho: float) -> str:
        """Return the shoulder's name, given the point's coordinate along f, m.

        Seen from the base towards the point: the arm beside axis 1 is its left or right one. Where the plane holds
        axis 1, the arm reaches to its front or over its back, if joint 2 is before the axis; else axis 2 points
        left or right.
        """
        if abs(rho) <= _STRAIGHT * self.size:
            return "shoulder singular"
        if abs(self.offset) > self.tolerance:
            return "left" if rho * self.offset > 0.0 else "right"
        if abs(self.front) > self.tolerance:
            return "front" if rho * self.front > 0.0 else "back"
        return "left" if rho * self.sense > 0.0 else "right"


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


def elbow_name(bend: float, names: tuple[str, str]) -> str:
    """Return the name of a bend, rad, for its positive and negative side, or that it is straight or folded."""
    if abs(math.sin(bend)) > _STRAIGHT:
        return names[0] if math.sin(bend) > 0.0 else names[1]
    return "elbow straight" if math.cos(bend) > 0.0 else "elbow folded"


def wrist_name(sine: float) -> str:
    """Return the name of a wrist's branch, given the sine of its bend from where it is stretched."""
    return "wrist singular" if abs(sine) <= _STRAIGHT else "no flip" if sine > 0.0 else "flip"


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


def slide_name(out: float, tolerance: float) -> Names:
    """Return the name of a slide's branch, if it has one, given how far it is pulled out, m."""
    return () if abs(out) <= tolerance else ("slide out",) if out > 0.0 else ("slide back",)
