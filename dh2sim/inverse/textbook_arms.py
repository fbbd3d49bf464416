"""The first three joints of an arm, which place the centre of its wrist: closed forms as textbooks derive them.

Sources: J. J. Craig, Introduction to Robotics, 3rd ed., 2005, section 4.7; M. W. Spong, S. Hutchinson, M. Vidyasagar,
Robot Modeling and Control, 2006, section 3.3; B. Siciliano, L. Sciavicco, L. Villani, G. Oriolo, Robotics: Modelling,
Planning and Control, 2009, section 2.12.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np

from dh2sim.inverse.textbook_axes import ArmAxes
from dh2sim.inverse.textbook_parts import (
    DOUBLE,
    MEASURED,
    UNDETERMINED,
    FromAngle,
    Names,
    PartialBranch,
    Shoulder,
    acos_text,
    elbow_name,
    first_link_angle,
    from_angle,
    law_of_cosines,
    length_of,
    shoulder_of,
    slide_name,
    with_signs,
)
from dh2sim.inverse.textbook_steps import METRE, Signs, Worksheet, term
from dh2sim.typing import Array


class ArmPart(Protocol):
    """Three joints that place a point."""

    @property
    def title(self) -> str:
        """What textbooks call it."""
        ...

    @property
    def T_base_link_arm(self) -> Array:
        """Frame 0 of the derivation in base_link, shape (4, 4)."""
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

    def names(self, q: Array, W: Array) -> list[Names]:
        """Return the names of branches, q of shape (k, n), given the point in base_link, m, shape (k, 3)."""
        ...


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

    @property
    def T_base_link_arm(self) -> Array:
        """Frame 0 of the derivation, shape (4, 4)."""
        return self.shoulder.T_base_link_arm

    def describe(self, sheet: Worksheet) -> None:
        """Write the step that says what the letters are."""
        sheet.step("What the letters are", remark=MEASURED)
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

    def names(self, q: Array, W: Array) -> list[Names]:
        """Return the names of branches, q of shape (k, n), given the point in base_link, m, shape (k, 3)."""
        return [
            (self.shoulder.name(rho), elbow_name(gamma if rho >= self.a1 else -gamma, ("below", "above")))
            for rho, gamma in zip(self.shoulder.rho(q, W), self.bend.angles(q), strict=True)
        ]


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

    @property
    def T_base_link_arm(self) -> Array:
        """Frame 0 of the derivation, shape (4, 4)."""
        return self.shoulder.T_base_link_arm

    def describe(self, sheet: Worksheet) -> None:
        """Write the step that says what the letters are."""
        sheet.step("What the letters are", remark=MEASURED)
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

    def names(self, q: Array, W: Array) -> list[Names]:
        """Return the names of branches, q of shape (k, n), given the point in base_link, m, shape (k, 3)."""
        return [
            (self.shoulder.name(rho), *slide_name(slide + self.c, self.shoulder.tolerance))
            for rho, slide in zip(self.shoulder.rho(q, W), q[:, 2].tolist(), strict=True)
        ]


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

    @property
    def T_base_link_arm(self) -> Array:
        """Frame 0 of the derivation, shape (4, 4)."""
        return self.shoulder.T_base_link_arm

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

    def names(self, q: Array, W: Array) -> list[Names]:
        """Return the names of branches, q of shape (k, n), given the point in base_link, m, shape (k, 3)."""
        del W
        return [slide_name(slide + self.c, self.shoulder.tolerance) for slide in q[:, 2].tolist()]


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

    @property
    def T_base_link_arm(self) -> Array:
        """Frame 0 of the derivation, shape (4, 4): base_link."""
        return np.eye(4)

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

    def names(self, q: Array, W: Array) -> list[Names]:
        """Return no names: there is one branch."""
        del W
        return [()] * len(q)


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
