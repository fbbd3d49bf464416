"""Arms whose axes are all parallel: planar arms of two and three links, and SCARA arms, with a slide along them.

Sources: J. J. Craig, Introduction to Robotics, 3rd ed., 2005, section 4.4 (three links in a plane); M. W. Spong,
S. Hutchinson, M. Vidyasagar, Robot Modeling and Control, 2006, section 3.3.2 (SCARA).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from dh2sim.inverse.textbook_axes import ArmAxes, norm, wrapped
from dh2sim.inverse.textbook_parts import (
    FromAngle,
    Names,
    PartialBranch,
    acos_text,
    elbow_name,
    first_link_angle,
    from_angle,
    law_of_cosines,
    placed_point,
)
from dh2sim.inverse.textbook_steps import METRE, RAD, Signs, Worksheet, term
from dh2sim.typing import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlanarArm:
    """Two or three turning joints about parallel axes, and at most one slide along them, in any order."""

    T_base_link_arm: Array = field(repr=False)
    """Frame 0 of the derivation: z along the first turning axis; shape (4, 4)."""
    axes: ArmAxes = field(repr=False)
    turns: tuple[int, ...]
    """Joints that turn, counted from 0."""
    senses: tuple[int, ...]
    """+1 or -1 for each: whether it turns about z."""
    slide: int | None
    """The joint that slides, counted from 0."""
    upwards: int
    """+1 or -1: whether the slide's positive coordinate goes along z."""
    l1: float
    l2: float
    point: Array
    """What the two links place, at zero in base_link, m, shape (3,): tool0 itself, or on the third axis."""
    height: float
    """Of that point at zero, m."""
    azimuth: FromAngle
    """Of the first link."""
    bend: FromAngle
    """Of the second link from the first."""
    forearm: Array = field(repr=False)

    @property
    def title(self) -> str:
        """What textbooks call it."""
        if self.slide is None:
            return f"planar arm of {'two' if len(self.turns) == 2 else 'three'} links"
        return "SCARA (two links in a plane and a slide at right angles to it)"

    def describe(self, sheet: Worksheet) -> None:
        """Write the step that says what the letters are."""
        a, b = (joint + 1 for joint in self.turns[:2])
        end = f"axis {self.turns[2] + 1}" if len(self.turns) == 3 else "the point to be placed"
        sheet.step("What the letters are", remark=f"Measured on the mechanism at zero; z along axis {a}.")
        sheet.letter("l1", self.l1, METRE, f"axis {a} to axis {b}")
        sheet.letter("l2", self.l2, METRE, f"axis {b} to {end}")
        if self.height != 0.0 and self.slide is not None:
            sheet.letter("h", self.height, METRE, "height at zero")
        self.azimuth.describe(sheet)
        self.bend.describe(sheet)

    def solve(self, sheet: Worksheet, W: Array) -> list[PartialBranch]:
        """Write the steps to a point in base_link, m, shape (3,), and return every way to get there.

        The coordinates are those of the first two turning joints and of the slide, in the order of the joints.
        """
        x, y, z = self.T_base_link_arm[:3, :3].T @ (W - self.T_base_link_arm[:3, 3])
        b = self.turns[1] + 1
        sheet.step(
            f"Joint {b}: the elbow, by the law of cosines",
            "cos γ = (x² + y² - l1² - l2²) / (2 l1 l2)",
            f"{self.bend.symbol} = σ{b} acos(cos γ),  σ{b} = +1 or -1",
            self.bend.formula,
        )
        bent: list[tuple[Signs, float, float]] = []
        for sign, gamma in law_of_cosines(sheet, x, y, self.l1, self.l2, ("l1", "l2"), ()):
            signs: Signs = ((f"σ{b}", sign),)
            bent.append((signs, self.bend.write(sheet, gamma, acos_text(sign, gamma), signs), gamma))
        if not bent:
            return []
        sheet.step(
            f"Joint {self.turns[0] + 1}: the first link points at the point, less the triangle's angle",
            f"{self.azimuth.symbol} = atan2(y, x) - atan2(l2 sin γ, l1 + l2 cos γ)",
            self.azimuth.formula,
        )
        found = []
        for signs, second, gamma in bent:
            angle, text = first_link_angle(sheet, x, y, self.l1, self.l2, gamma)
            q = {self.turns[0]: self.azimuth.write(sheet, angle, text, signs), self.turns[1]: second}
            if self.slide is not None:
                q[self.slide] = self.upwards * (float(z) - self.height)
            found.append(PartialBranch(signs=signs, q=tuple(q[joint] for joint in sorted(q))))
        if self.slide is not None:
            self._write_slide(sheet, float(z), found[0].q[sorted([*self.turns[:2], self.slide]).index(self.slide)])
        return found

    def _write_slide(self, sheet: Worksheet, z: float, coordinate: float) -> None:
        symbol = f"q{self.slide + 1 if self.slide is not None else 0}"
        rise = ("z - h" if self.upwards > 0 else "h - z") if self.height else ("z" if self.upwards > 0 else "-z")
        sheet.step(f"Joint {symbol[1:]}: the height", f"{symbol} = {rise}")
        first, second = (z, self.height) if self.upwards > 0 else (self.height, z)
        sheet.line(
            symbol, coordinate, METRE, sheet.length(first) + term(sheet.length(-second)) if self.height else ""
        )

    def solve_pose(self, sheet: Worksheet, T: Array) -> list[PartialBranch]:
        """Write the steps to a pose of tool0 in base_link, shape (4, 4), of an arm that is nothing more than this."""
        third = self.turns[2] if len(self.turns) == 3 else None
        title = "The point that the two links place" + ("" if third is None else f", on axis {third + 1}")
        W = placed_point(sheet, self.axes, self.point, T, self.T_base_link_arm, title)
        found = self.solve(sheet, W)
        if third is None or not found:
            return found
        R = self.T_base_link_arm[:3, :3].T @ T[:3, :3] @ self.axes.T_home[:3, :3].T @ self.T_base_link_arm[:3, :3]
        turned = math.atan2(R[1, 0], R[0, 0])
        a, b, c = (f"q{joint + 1}" for joint in self.turns)
        first, second, last = self.senses
        inner = f"φ {_minus(first)} {a} {_minus(second)} {b}"
        sheet.step(
            f"Joint {c[1:]}: what is left of the tool's angle φ, from zero about z",
            f"{c} = {inner}" if last > 0 else f"{c} = -({inner})",
        )
        sheet.line("φ", turned, RAD, "")
        whole = []
        order = sorted([*self.turns[:2], *([] if self.slide is None else [self.slide])])
        for branch in found:
            q = dict(zip(order, branch.q, strict=True))
            parts = (first * q[self.turns[0]], second * q[self.turns[1]])
            angle = last * (turned - parts[0] - parts[1])
            q[third] = wrapped(angle)
            text = sheet.angle(turned) + "".join(term(sheet.angle(-part)) for part in parts)
            sheet.turned(c, angle, text if last > 0 else f"-({text})", branch.signs)
            whole.append(PartialBranch(signs=branch.signs, q=tuple(q[joint] for joint in sorted(q))))
        return whole

    def names(self, q: Array, W: Array) -> list[Names]:  # noqa: ARG002
        """Return the names of configurations' branches: where the elbow is, seen from the base towards the point."""
        names = ("elbow down", "elbow up") if self.slide is None else ("right", "left")
        return [(elbow_name(bend, names),) for bend in self.bend.angles(q)]


def _minus(sense: int) -> str:
    return "-" if sense > 0 else "+"


def planar_arm(axes: ArmAxes, count: int, W0: Array | None = None) -> PlanarArm | None:
    """Return the first joints as a planar arm or a SCARA; None if they are not.

    Args:
        axes: The robot's axes.
        count: Number of joints, 2 to 4.
        W0: A point behind them, at zero in base_link, m, shape (3,); None: the joints are the whole arm.
    """
    kinds = axes.kinds[:count]
    turns, slides = [i for i, k in enumerate(kinds) if k == "R"], [i for i, k in enumerate(kinds) if k == "P"]
    if len(turns) not in (2, 3) or len(slides) > 1 or not axes.parallel(*range(count)):
        return None
    if W0 is not None and len(turns) != 2:
        return None
    T = axes.base_frame(turns[0])
    x, y, z = T[:3, 0], T[:3, 1], T[:3, 2]
    end = axes.tip if W0 is None else W0
    if len(turns) == 3:
        end = axes.foot(turns[2], end)
    upper, fore = axes.joints[turns[1]].point - T[:3, 3], end - axes.joints[turns[1]].point
    upper, fore = upper - z * float(z @ upper), fore - z * float(z @ fore)
    if axes.is_short(norm(upper)) or axes.is_short(norm(fore)):
        return None
    senses = tuple(1 if float(axes.joints[i].direction @ z) > 0.0 else -1 for i in turns)
    rise = math.atan2(float(upper @ y), float(upper @ x))
    bend = math.atan2(float(fore @ y), float(fore @ x)) - rise
    height = float((end - T[:3, 3]) @ z)
    return PlanarArm(
        T_base_link_arm=T,
        axes=axes,
        turns=tuple(turns),
        senses=senses,
        slide=slides[0] if slides else None,
        upwards=1 if not slides or float(axes.joints[slides[0]].direction @ z) > 0.0 else -1,
        l1=norm(upper),
        l2=norm(fore),
        point=end,
        height=0.0 if abs(height) <= 1e-12 * axes.size else height,
        azimuth=from_angle(turns[0] + 1, "φ1", rise),
        bend=from_angle(turns[1] + 1, "γ", bend, senses[1]),
        forearm=fore if not slides else np.zeros(3),
    )
