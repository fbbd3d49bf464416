"""Which closed form of the textbooks an arm has: recognised from its axes alone."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from dh2sim.inverse.textbook_arms import ArmPart, arm_part
from dh2sim.inverse.textbook_axes import ArmAxes
from dh2sim.inverse.textbook_offset_wrist import OffsetWristArm, offset_wrist_arm
from dh2sim.inverse.textbook_parts import Names, PartialBranch, placed_point
from dh2sim.inverse.textbook_planar import PlanarArm, planar_arm
from dh2sim.inverse.textbook_steps import Worksheet
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
            title = "The wrist centre" if self.wrist is not None else "The point to be reached"
            point = placed_point(sheet, self.axes, self.W0, T, self.arm.T_base_link_arm, title)
            branches = self.arm.solve(sheet, point)
        if self.wrist is not None and branches:
            branches = self.wrist.solve(sheet, branches, T[:3, :3])
        return branches

    def names(self, q: Array) -> list[Names]:
        """Return the names of configurations' branches, q of shape (k, n)."""
        found: list[Names] = [()] * len(q)
        if self.arm is not None:
            T = self.axes.motions(q[:, :3])
            found = self.arm.names(q, T[:, :3, :3] @ self.W0 + T[:, :3, 3])
        if self.wrist is None:
            return found
        return [(*arm, *hand) for arm, hand in zip(found, self.wrist.names(q), strict=True)]


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

    def names(self, q: Array) -> list[Names]:
        """Return the names of configurations' branches, q of shape (k, n)."""
        return self.planar.names(q, np.zeros((len(q), 3)))


TextbookForm: TypeAlias = TextbookArm | WholePlanarArm | OffsetWristArm


def textbook_form(axes: ArmAxes) -> TextbookForm | str:
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
    if W0 is None and (offset := offset_wrist_arm(axes)) is not None:
        return offset
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
