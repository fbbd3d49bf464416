"""Which closed form of the textbooks an arm has: recognised from its axes alone."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from dh2sim.inverse.textbook_arms import ArmPart, PartialBranch, arm_part
from dh2sim.inverse.textbook_axes import ArmAxes, norm
from dh2sim.inverse.textbook_planar import PlanarArm, planar_arm
from dh2sim.inverse.textbook_steps import METRE, Worksheet, term
from dh2sim.inverse.textbook_wrists import Wrist, wrist
from dh2sim.typing import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TextbookArm:
    """An arm that places the centre of a wrist, and the wrist; either may be missing."""

    axes: ArmAxes = field(repr=False)
    arm: ArmPart | None
    wrist: Wrist | None
    W0: Array
    """The wrist's centre, or what else the arm places, at zero in base_link, m, shape (3,)."""

    @property
    def title(self) -> str:
        """What textbooks call it."""
        parts = [part.title for part in (self.arm, self.wrist) if part is not None]
        return " with a ".join(parts)

    def solve(self, sheet: Worksheet, T: Array) -> list[PartialBranch]:
        """Write the steps to a pose of tool0 in base_link, shape (4, 4), and return every way to get there."""
        branches = [PartialBranch(signs=(), q=())]
        if self.arm is not None:
            self.arm.describe(sheet)
            self._write_centre(sheet, T)
            branches = self.arm.solve(sheet, self._centre(T))
        if self.wrist is not None and branches:
            branches = self.wrist.solve(sheet, branches, T[:3, :3])
        return branches

    def _centre(self, T: Array) -> Array:
        return np.asarray(T[:3, :3] @ self._in_tool + T[:3, 3])

    @property
    def _in_tool(self) -> Array:
        c = self.axes.T_home[:3, :3].T @ (self.W0 - self.axes.tip)
        return np.where(np.abs(c) <= 1e-12 * self.axes.size, 0.0, c)

    def _write_centre(self, sheet: Worksheet, T: Array) -> None:
        """Write where the wrist's centre must be."""
        c = self._in_tool
        along = norm(c[:2]) == 0.0
        if norm(c) == 0.0:
            formula, remark = "p_w = p", "tool0 is at the point that the arm places."
        elif along:
            n = len(self.axes.joints)
            formula = f"p_w = p - d{n} z{n}" if c[2] < 0.0 else f"p_w = p + d{n} z{n}"
            remark = f"z{n} is the third column of the goal; d{n} = {sheet.measure(abs(float(c[2])))}."
        else:
            formula = "p_w = p + R c"
            remark = f"The wrist centre is at c = ({', '.join(sheet.length(float(x)) for x in c)}) in tool0."
        T_frame = getattr(self.arm, "T_base_link_arm", None)
        shoulder = getattr(self.arm, "shoulder", None)
        T_frame = shoulder.T_base_link_arm if shoulder is not None else T_frame
        W = self._centre(T)
        moved = T_frame is not None and not np.allclose(T_frame, np.eye(4), rtol=0.0, atol=1e-12)
        more = " x, y, z are those of p_w in frame 0." if moved else " x, y, z are those of p_w."
        sheet.step(
            "The wrist centre" if self.wrist is not None else "The point to be reached", formula, remark=remark + more
        )
        offset = T[:3, :3] @ c
        for letter, value, part, extra in zip("xyz", W, T[:3, 3], offset, strict=True):
            text = sheet.length(float(part)) + term(sheet.length(float(extra))) if norm(c) else ""
            sheet.line(f"p_w{letter}" if moved else letter, float(value), METRE, text)
        if moved and T_frame is not None:
            local = T_frame[:3, :3].T @ (W - T_frame[:3, 3])
            for letter, value in zip("xyz", local.tolist(), strict=True):
                sheet.line(letter, value, METRE, "")

    def names(self, q: Array) -> tuple[str, ...]:
        """Return the names of a configuration's branch."""
        found: tuple[str, ...] = ()
        if self.arm is not None:
            T = self.axes.motions(q[:3].tolist())
            found = self.arm.names(q, T[:3, :3] @ self.W0 + T[:3, 3])
        return found if self.wrist is None else (*found, *self.wrist.names(q))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WholePlanarArm:
    """An arm that is nothing more than a planar arm or a SCARA."""

    planar: PlanarArm

    @property
    def title(self) -> str:
        """What textbooks call it."""
        return self.planar.title

    def solve(self, sheet: Worksheet, T: Array) -> list[PartialBranch]:
        """Write the steps to a pose of tool0 in base_link, shape (4, 4), and return every way to get there."""
        self.planar.describe(sheet)
        return self.planar.solve_pose(sheet, T)

    def names(self, q: Array) -> tuple[str, ...]:
        """Return the names of a configuration's branch."""
        return self.planar.names(q, np.zeros(3))


def textbook_form(axes: ArmAxes) -> TextbookArm | WholePlanarArm | str:
    """Return the closed form that an arm has, or why the textbooks have none for it, as a sentence."""
    n = len(axes.joints)
    if n < 2 or n > 6:
        return f"Textbooks solve arms of 2 to 6 joints in closed form; this one has {n}."
    if n <= 4 and (planar := planar_arm(axes, n)) is not None:
        return WholePlanarArm(planar=planar)
    if axes.kinds == "RRR" and (centre := axes.meeting_point((0, 1, 2))) is not None:
        alone = wrist(axes, 0, np.zeros(3), centre)
        if isinstance(alone, Wrist):
            return TextbookArm(axes=axes, arm=None, wrist=alone, W0=centre)
    if n < 3:
        return f"Its two joints ({axes.kinds}) are not a planar arm."
    if n > 3 and "P" in axes.kinds[3:]:
        return "A joint behind the third slides, so that the last joints are not a wrist."
    if n == 3:
        W0: Array | None = axes.tip
    elif n == 4:
        W0 = axes.foot(3, axes.tip)
    else:
        W0 = axes.meeting_point(range(3, n))
    if W0 is None:
        last = ", ".join(str(i) for i in range(4, n)) + f" and {n}"
        return f"Axes {last} do not meet in one point, so that position and orientation do not come apart."
    arm = arm_part(axes, W0) or planar_arm(axes, 3, W0)
    if arm is None:
        return (
            f"Its first three joints ({' '.join(axes.kinds[:3])}) are not an elbow, spherical, cylindrical, "
            "Cartesian or SCARA arm, as their axes lie."
        )
    if n == 3:
        return TextbookArm(axes=axes, arm=arm, wrist=None, W0=W0)
    hand = wrist(axes, 3, arm.forearm, W0)
    return (
        f"{hand[0].upper()}{hand[1:]}."
        if isinstance(hand, str)
        else TextbookArm(axes=axes, arm=arm, wrist=hand, W0=W0)
    )
