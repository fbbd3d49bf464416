"""Arms with three parallel axes and a wrist whose axes do not meet: the closed form of the Universal Robots' arms.

Source: K. P. Hawkins, Analytic Inverse Kinematics for the Universal Robots UR-5/UR-10 Arms, Georgia Institute of
Technology, 2013. Here the shoulder's step is written as that of an elbow arm, with which it shares its formula.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from dh2sim.inverse.textbook_axes import ArmAxes, norm, turn_about, wrapped
from dh2sim.inverse.textbook_parts import (
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
    placed_point,
    shoulder_of,
    with_signs,
    wrist_name,
)
from dh2sim.inverse.textbook_steps import METRE, RAD, Signs, Worksheet, number, term
from dh2sim.kinematics.rotations import rotations_about
from dh2sim.typing import Array

_SINGULAR: Final = 1e-12
"""Sine of the angle between axes 4 and 6, within which they are parallel."""
_TRIED: Final = sorted(np.radians(np.arange(-175.0, 181.0, 5.0)).tolist(), key=abs)
"""Angles of joint 6, rad, of which the first that leaves axis 4 within reach is taken where any will do."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OffsetWristArm:
    """R R R R R R: axes 2, 3 and 4 parallel, at right angles to axis 1; axes 5 and 6 meet, each at right angles."""

    axes: ArmAxes = field(repr=False)
    W0: Array
    """Where axes 5 and 6 meet at zero, in base_link, m, shape (3,)."""
    shoulder: Shoulder
    a1: float
    d1: float
    l2: float
    """From axis 2 to axis 3, m."""
    l3: float
    """From axis 3 to axis 4, m."""
    d5: float
    """From axis 4 to axis 6 along axis 5, m."""
    c4: float
    """From axis 4 to axis 5, m, along e × z5."""
    elevation: FromAngle
    bend: FromAngle
    tilt: FromAngle
    """Of axis 6 from axis 4, about axis 5."""
    outwards: int

    title: ClassVar[str] = "elbow arm with three parallel axes and an offset wrist"

    def _frame(self, q1: float) -> tuple[Array, Array, Array]:
        """Return f, e and z of the arm's plane in base_link, each of shape (3,)."""
        angle = self.shoulder.azimuth.at_zero + self.shoulder.azimuth.sense * q1
        R = self.shoulder.T_base_link_arm[:3, :3]
        f = R[:, 0] * math.cos(angle) + R[:, 1] * math.sin(angle)
        return f, np.cross(R[:, 2], f), R[:, 2]

    def solve(self, sheet: Worksheet, T: Array) -> list[PartialBranch]:
        """Write the steps to a pose of tool0 in base_link, shape (4, 4), and return every way to get there."""
        self._describe(sheet)
        frame = self.shoulder.T_base_link_arm
        W = placed_point(sheet, self.axes, self.W0, T, frame, "Where axes 5 and 6 meet")
        ways = self.shoulder.solve(sheet, W, "r")
        if not ways:
            return []
        turned = T[:3, :3] @ self.axes.T_home[:3, :3].T
        return self._rest(sheet, self._wrist(sheet, ways, turned, W), W)

    def _describe(self, sheet: Worksheet) -> None:
        sheet.step(
            "What the letters are",
            remark=(
                "Measured on the mechanism at zero; f is the arm's direction, z up along axis 1, e along axes 2, 3 "
                "and 4. p_w is where axes 5 and 6 meet; it keeps the distance d from the plane of f and z."
            ),
        )
        for letter, value, meaning in (
            ("a1", self.a1, "axis 1 to axis 2"),
            ("d1", self.d1, "height of axis 2"),
            ("l2", self.l2, "axis 2 to axis 3"),
            ("l3", self.l3, "axis 3 to axis 4"),
            ("d5", self.d5, "axis 4 to axis 6, along axis 5"),
            ("c4", self.c4, "axis 4 to axis 5"),
        ):
            if value != 0.0:
                sheet.letter(letter, value, METRE, meaning)
        self.shoulder.describe(sheet)
        for angle in (self.elevation, self.bend, self.tilt):
            angle.describe(sheet)

    def _wrist(
        self, sheet: Worksheet, ways: list[tuple[Signs, float, float, float]], turned: Array, W: Array
    ) -> list[tuple[Signs, float, float, float, Array]]:
        """Write the steps of joints 5 and 6; return signs, q1, q5, q6 and the direction of axis 5 in base_link."""
        w4, w5, w6 = (self.axes.joints[i].direction for i in (3, 4, 5))
        sheet.step(
            "Joint 5: how far axis 6 is turned out of axis 4, which joint 1 has placed",
            "cos ω = z4 · z6",
            f"{self.tilt.symbol} = σ5 acos(z4 · z6),  σ5 = +1 or -1",
            self.tilt.formula,
            remark="z6 is the direction of axis 6 at the goal, z4 that of axis 4, across the arm's plane.",
        )
        z6 = turned @ w6
        axis = turned @ w5  # where the goal would have axis 5 if it were fixed to the tool
        bent = []
        for signs, q1, _, _ in ways:
            z4 = self.axes.motion(0, q1)[:3, :3] @ w4
            cosine = min(1.0, max(-1.0, float(z4 @ z6)))
            # the sine from the cross product: the cosine does not tell small angles
            tilt = math.atan2(norm(np.cross(z4, z6)), cosine)
            singular = math.sin(tilt) <= _SINGULAR
            sheet.line("z4 · z6", cosine, "", "", signs)
            for s5 in (1,) if singular else (1, -1):
                with_s5: Signs = (*signs, ("σ5", s5))
                q5 = self.tilt.write(sheet, s5 * tilt, acos_text(s5, tilt), with_s5)
                bent.append((with_s5, q1, q5, z4, singular))
        sheet.step(
            "Joint 6: where axis 5 must be, seen from the tool",
            "z5 = z4 × z6 / sin ω",
            "q6 = angle about axis 6 from where the tool has axis 5 to z5",
        )
        found = []
        for signs, q1, q5, z4, singular in bent:
            if singular:
                q6 = next((x for x in _TRIED if self._reaches(W, q1, rotations_about(z6, -x) @ axis)), 0.0)
                z5 = rotations_about(z6, -q6) @ axis
                sheet.line("q6", q6, RAD, "any", signs)
                sheet.note(
                    f"Wrist singular{with_signs(signs)}: axes 4 and 6 are parallel, so that joints 2, 3, 4 and 6 "
                    f"turn about one direction, and q6 is free within reach; {sheet.angle(q6)} is taken here."
                )
            else:
                sine = math.sin(self.tilt.at_zero + self.tilt.sense * q5)
                z5 = np.cross(z4, z6) / sine
                z5 /= norm(z5)
                q6 = wrapped(turn_about(z6, z5, axis))
                pair = float(z6 @ np.cross(z5, axis)), float(z5 @ axis)
                sheet.line("q6", q6, RAD, f"atan2({number(pair[0])}, {number(pair[1])})", signs)
            found.append((signs, q1, q5, q6, z5))
        return found

    def _axis_4(self, W: Array, q1: float, z5: Array) -> tuple[float, float]:
        """Return where axis 4 must be, seen from axis 2: along f and along z, m."""
        f, e, z = self._frame(q1)
        P4 = W - self.d5 * z5 + self.c4 * np.cross(e, z5) - self.shoulder.T_base_link_arm[:3, 3]
        return float(f @ P4) - self.a1, float(z @ P4) - self.d1

    def _reaches(self, W: Array, q1: float, z5: Array) -> bool:
        """Whether two links reach axis 4."""
        return abs(self.l2 - self.l3) <= math.hypot(*self._axis_4(W, q1, z5)) <= self.l2 + self.l3

    def _rest(
        self, sheet: Worksheet, wrists: list[tuple[Signs, float, float, float, Array]], W: Array
    ) -> list[PartialBranch]:
        """Write the steps of joints 2, 3 and 4."""
        sheet.step(
            "Joint 3: axis 4 is reached by two links in the arm's plane, by the law of cosines",
            "p_4 = p_w - d5 z5" + (f"{term('c4')} (e × z5)" if self.c4 else ""),
            f"u = f · p_4{' - a1' if self.a1 else ''},  v = z · p_4{' - d1' if self.d1 else ''}",
            "cos γ = (u² + v² - l2² - l3²) / (2 l2 l3)",
            f"{self.bend.symbol} = σ3 acos(cos γ),  σ3 = +1 or -1",
            self.bend.formula,
        )
        bent = []
        for signs, q1, q5, q6, z5 in wrists:
            u, v = self._axis_4(W, q1, z5)
            for s3, gamma in law_of_cosines(sheet, u, v, self.l2, self.l3, ("l2", "l3"), signs):
                with_s3: Signs = (*signs, ("σ3", s3))
                q3 = self.bend.write(sheet, gamma, acos_text(s3, gamma), with_s3)
                bent.append((with_s3, (q1, q3, q5, q6), gamma, u, v, z5))
        if not bent:
            return []
        sheet.step(
            "Joint 2: the upper arm points at axis 4, less the triangle's angle",
            f"{self.elevation.symbol} = atan2(v, u) - atan2(l3 sin γ, l2 + l3 cos γ)",
            self.elevation.formula,
        )
        upper = []
        for signs, (q1, q3, q5, q6), gamma, u, v, z5 in bent:
            beta, text = first_link_angle(sheet, u, v, self.l2, self.l3, gamma)
            upper.append((signs, q1, self.elevation.write(sheet, beta, text, signs), q3, q5, q6, z5))
        sheet.step(
            "Joint 4: what is left until axis 5 has its direction",
            "q4 = angle about axis 4 from where joints 1 to 3 bring axis 5 to z5",
        )
        found = []
        for signs, q1, q2, q3, q5, q6, z5 in upper:
            R = self.axes.motions((q1, q2, q3))[:3, :3]
            z4, carried = R @ self.axes.joints[3].direction, R @ self.axes.joints[4].direction
            q4 = wrapped(turn_about(z4, carried, z5))
            pair = float(z4 @ np.cross(carried, z5)), float(carried @ z5)
            sheet.line("q4", q4, RAD, f"atan2({number(pair[0])}, {number(pair[1])})", signs)
            found.append(PartialBranch(signs=signs, q=(q1, q2, q3, q4, q5, q6)))
        return found

    def names(self, q: Array) -> list[Names]:
        """Return the names of configurations' branches, q of shape (k, n)."""
        T3 = self.axes.motions(q[:, :3])
        P4 = T3[:, :3, :3] @ self.axes.joints[3].point + T3[:, :3, 3]
        T4 = T3 @ self.axes.motion(3, q[:, 3])
        W = T4[:, :3, :3] @ self.W0 + T4[:, :3, 3]  # joint 5 does not move it
        return [
            (
                self.shoulder.name(rho),
                elbow_name(gamma if ahead >= self.a1 else -gamma, ("below", "above")),
                wrist_name(self.outwards * math.sin(tilt)),
            )
            for rho, ahead, gamma, tilt in zip(
                self.shoulder.rho(q, W),
                self.shoulder.rho(q, P4),
                self.bend.angles(q),
                self.tilt.angles(q),
                strict=True,
            )
        ]


def offset_wrist_arm(axes: ArmAxes) -> OffsetWristArm | None:
    """Return an arm of six joints as one with an offset wrist, or None if it is not."""
    if axes.kinds != "RRRRRR" or not axes.parallel(1, 2, 3):
        return None
    if not (axes.perpendicular(0, 1) and axes.perpendicular(3, 4) and axes.perpendicular(4, 5)):
        return None
    W0 = axes.meeting_point((4, 5))
    if W0 is None:
        return None
    shoulder, f, e, z = shoulder_of(axes, W0)
    origin = shoulder.T_base_link_arm[:3, 3]
    P2, P3, P4 = (axes.joints[i].point for i in (1, 2, 3))
    upper, fore = P3 - P2, P4 - P3
    l2, l3 = math.hypot(float(upper @ f), float(upper @ z)), math.hypot(float(fore @ f), float(fore @ z))
    if axes.is_short(l2) or axes.is_short(l3):
        return None
    rise = math.atan2(float(upper @ z), float(upper @ f))
    w4, w5, w6 = (axes.joints[i].direction for i in (3, 4, 5))
    # in the plane, from axis 4 to the point on axis 5: along axis 5, and across it
    hand = W0 - P4
    hand = hand - e * float(hand @ e)
    tool = float((axes.tip - W0) @ w6)
    return OffsetWristArm(
        axes=axes,
        W0=W0,
        shoulder=shoulder,
        a1=length_of(axes, float((P2 - origin) @ f)),
        d1=length_of(axes, float((P2 - origin) @ z)),
        l2=l2,
        l3=l3,
        d5=length_of(axes, float(hand @ w5)),
        c4=length_of(axes, -float(hand @ np.cross(e, w5))),
        elevation=from_angle(2, "β", rise, -float(axes.joints[1].direction @ e)),
        bend=from_angle(
            3, "γ", math.atan2(float(fore @ z), float(fore @ f)) - rise, -float(axes.joints[2].direction @ e)
        ),
        tilt=from_angle(5, "ω", turn_about(w5, w4, w6)),
        outwards=-1 if tool < 0.0 and not axes.is_short(tool) else 1,
    )
