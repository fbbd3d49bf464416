"""What turns a hand about the centre of a wrist: one, two or three axes through it, solved from a rotation.

Sources: M. W. Spong, S. Hutchinson, M. Vidyasagar, Robot Modeling and Control, 2006, sections 2.5.1 and 3.3.4 (Euler
angles z-y-z); R. P. Paul, Robot Manipulators, 1981, section 3.4 (each angle from what is left of the matrix, which
stays accurate near the singularity).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from dh2sim.inverse.textbook_axes import ArmAxes, turn_about
from dh2sim.inverse.textbook_parts import FromAngle, Names, PartialBranch, from_angle, with_signs, wrist_name
from dh2sim.inverse.textbook_steps import RAD, Signs, Worksheet, number
from dh2sim.kinematics.rotations import rotations_about
from dh2sim.typing import Array

SINGULAR: Final = 1e-12
"""Sine of the wrist's bend, within which its outer axes are one line."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wrist:
    """Turning axes through one point; the last joints of the arm."""

    axes: ArmAxes = field(repr=False)
    first: int
    """Its first joint, counted from 0."""
    frame: Array
    """z along the first axis, y along the second, in base_link at zero; shape (3, 3)."""

    title: ClassVar[str] = ""

    def left_over(self, branch: PartialBranch, R: Array) -> Array:
        """Return the rotation that the wrist must do, in its frame, shape (3, 3)."""
        arm = self.axes.motions(branch.q)[:3, :3]
        return np.asarray(self.frame.T @ arm.T @ R @ self.axes.T_home[:3, :3].T @ self.frame)

    def solve(self, sheet: Worksheet, branches: list[PartialBranch], R: Array) -> list[PartialBranch]:
        """Write the steps to a rotation of tool0, shape (3, 3), and return every way to get there."""
        raise NotImplementedError

    def names(self, q: Array) -> list[Names]:
        """Return the names of configurations' branches, q of shape (k, n)."""
        return [()] * len(q)


def _entries(sheet: Worksheet, E: Array, places: tuple[tuple[int, int], ...], signs: Signs) -> None:
    """Write the entries of a rotation that the formulas use."""
    for i, k in places:
        sheet.line(f"r{i}{k}", float(E[i - 1, k - 1]), "", "", signs)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SphericalWrist(Wrist):
    """Three axes through one point, each at right angles to the next."""

    bend: FromAngle
    """Of the last axis from the first, about the middle one."""
    outwards: int
    """+1 or -1: whether the bend that is zero or half a turn stretches the wrist."""

    title: ClassVar[str] = "spherical wrist"

    def solve(self, sheet: Worksheet, branches: list[PartialBranch], R: Array) -> list[PartialBranch]:
        """Write the steps to a rotation of tool0, shape (3, 3), and return every way to get there."""
        i, k, m = (self.first + n for n in (1, 2, 3))
        c, s = f"c{i}", f"s{i}"
        sheet.step(
            f"Joints {i} to {m}: the rotation that is left for the wrist" if self.first else "The rotation",
            f"R = Rz(q{i}) Ry({self.bend.symbol}) Rz(q{m})",
            f"q{i} = atan2(σ{k} r23, σ{k} r13),  σ{k} = +1 or -1;  {c}, {s} = cos q{i}, sin q{i}",
            f"{self.bend.symbol} = atan2({c} r13 + {s} r23, r33)",
            self.bend.formula,
            f"q{m} = atan2({c} r21 - {s} r11, {c} r22 - {s} r12)",
            remark=(
                f"R = [r11 … r33] is {'what the arm leaves to do' if self.first else 'the goal, turned from zero'}; "
                f"z along axis {i}, y along axis {k} at q{i} = 0."
            ),
        )
        self.bend.describe(sheet)
        H = rotations_about(self.axes.joints[self.first + 1].direction, self.bend.at_zero)
        found = []
        for branch in branches:
            E = self.left_over(branch, R) @ self.frame.T @ H @ self.frame
            _entries(sheet, E, ((1, 1), (1, 2), (1, 3), (2, 1), (2, 2), (2, 3), (3, 3)), branch.signs)
            singular = math.hypot(E[0, 2], E[1, 2]) <= SINGULAR
            if singular:
                sense = "+" if E[2, 2] > 0.0 else "-"
                sheet.note(
                    f"Wrist singular{with_signs(branch.signs)}: axes {i} and {m} are one line, and only "
                    f"q{i} {sense} q{m} is determined; q{i} = 0 is taken here."
                )
            for sign in (1,) if singular else (1, -1):
                signs: Signs = (*branch.signs, (f"σ{k}", sign))
                if singular:
                    first = 0.0
                    sheet.line(f"q{i}", first, RAD, "any", signs)
                else:
                    first = math.atan2(sign * E[1, 2], sign * E[0, 2])
                    text = f"atan2({number(sign * E[1, 2])}, {number(sign * E[0, 2])})"
                    sheet.line(f"q{i}", first, RAD, text, signs)
                cos, sin = math.cos(first), math.sin(first)
                across = cos * E[0, 2] + sin * E[1, 2]
                text = f"atan2({number(across)}, {number(E[2, 2])})"
                second = self.bend.write(sheet, math.atan2(across, E[2, 2]), text, signs)
                sine, cosine = cos * E[1, 0] - sin * E[0, 0], cos * E[1, 1] - sin * E[0, 1]
                third = math.atan2(sine, cosine)
                sheet.line(f"q{m}", third, RAD, f"atan2({number(sine)}, {number(cosine)})", signs)
                found.append(PartialBranch(signs=signs, q=(*branch.q, first, second, third)))
        return found

    def names(self, q: Array) -> list[Names]:
        """Return the names of configurations' branches: which way the middle joint bends the stretched wrist."""
        return [(wrist_name(self.outwards * math.sin(bend)),) for bend in self.bend.angles(q)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TwoAxisWrist(Wrist):
    """Two axes at right angles through one point."""

    title: ClassVar[str] = "wrist of two axes"

    def solve(self, sheet: Worksheet, branches: list[PartialBranch], R: Array) -> list[PartialBranch]:
        """Write the steps to a rotation of tool0, shape (3, 3), and return every way to get there."""
        i, k = self.first + 1, self.first + 2
        sheet.step(
            f"Joints {i} and {k}: the rotation that is left for the wrist",
            f"R = Rz(q{i}) Ry(q{k})",
            f"q{i} = atan2(-r12, r22)",
            f"q{k} = atan2(-r31, r33)",
            remark=(
                f"R = [r11 … r33] is what the arm leaves to do, z along axis {i} and y along axis {k} at q{i} = 0. "
                "Two joints cannot do every rotation: r32 must be 0."
            ),
        )
        found = []
        for branch in branches:
            E = self.left_over(branch, R)
            _entries(sheet, E, ((1, 2), (2, 2), (3, 1), (3, 2), (3, 3)), branch.signs)
            first, second = math.atan2(-E[0, 1], E[1, 1]), math.atan2(-E[2, 0], E[2, 2])
            for symbol, value, pair in (
                (f"q{i}", first, (-E[0, 1], E[1, 1])),
                (f"q{k}", second, (-E[2, 0], E[2, 2])),
            ):
                sheet.line(symbol, value, RAD, f"atan2({number(pair[0])}, {number(pair[1])})", branch.signs)
            found.append(PartialBranch(signs=branch.signs, q=(*branch.q, first, second)))
        return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OneAxisWrist(Wrist):
    """One axis through the point that the arm places."""

    title: ClassVar[str] = "turning hand"

    def solve(self, sheet: Worksheet, branches: list[PartialBranch], R: Array) -> list[PartialBranch]:
        """Write the steps to a rotation of tool0, shape (3, 3), and return every way to get there."""
        i = self.first + 1
        sheet.step(
            f"Joint {i}: the rotation that is left for the hand",
            f"q{i} = atan2(r21, r11)",
            remark=(
                f"R = [r11 … r33] is what the arm leaves to do, z along axis {i}. "
                "One joint cannot do every rotation: r33 must be 1."
            ),
        )
        found = []
        for branch in branches:
            E = self.left_over(branch, R)
            _entries(sheet, E, ((3, 3),), branch.signs)
            angle = math.atan2(E[1, 0], E[0, 0])
            sheet.line(f"q{i}", angle, RAD, f"atan2({number(E[1, 0])}, {number(E[0, 0])})", branch.signs)
            found.append(PartialBranch(signs=branch.signs, q=(*branch.q, angle)))
        return found


def wrist(axes: ArmAxes, first: int, forearm: Array, W0: Array) -> Wrist | str:
    """Return the last joints as a wrist about a point, or why they are none.

    Args:
        axes: The robot's axes.
        first: Its first joint, counted from 0; one to three follow.
        forearm: What carries it, towards it, in base_link at zero, m, shape (3,); zero where nothing tells.
        W0: The point, at zero in base_link, m, shape (3,).
    """
    count = len(axes.joints) - first
    if "P" in axes.kinds[first:] or count > 3:
        return f"joints {first + 1} to {first + count} are not a wrist"
    directions = [joint.direction for joint in axes.joints[first:]]
    for k in range(count - 1):
        if not axes.perpendicular(first + k, first + k + 1):
            return f"axes {first + k + 1} and {first + k + 2} of the wrist are not at right angles"
    z = directions[0]
    if count == 1:
        across = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
        y = across / math.sqrt(float(across @ across))
    else:
        y = directions[1] - z * float(z @ directions[1])
        y = y / math.sqrt(float(y @ y))
    frame = np.column_stack([np.cross(y, z), y, z])
    if count < 3:
        made = OneAxisWrist if count == 1 else TwoAxisWrist
        return made(axes=axes, first=first, frame=frame)
    carried, tool = float(forearm @ z), float((axes.tip - W0) @ directions[2])
    outwards = (-1 if carried < -0.1 * math.sqrt(float(forearm @ forearm)) else 1) * (
        -1 if tool < 0.0 and not axes.is_short(tool) else 1
    )
    return SphericalWrist(
        axes=axes,
        first=first,
        frame=frame,
        bend=from_angle(first + 2, "ω", turn_about(directions[1], z, directions[2])),
        outwards=outwards,
    )
