"""The inverse kinematics of an arm as a textbook derives it: by hand, in steps, with the numbers of one pose.

The closed forms are those of planar arms, SCARA, spherical wrists, and elbow, spherical, cylindrical and Cartesian
arms with a wrist or without. The class is recognised from how the joint axes lie; conventions, offsets, flips, moved
zeros, base and tool make no difference. Every branch is compared with the table's own product.
"""

from __future__ import annotations

import itertools
import textwrap
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.arguments import real_array
from dh2sim.errors import ConfigurationError
from dh2sim.inverse.branches import names_of_form
from dh2sim.inverse.textbook_axes import EXACT, arm_axes, wrapped
from dh2sim.inverse.textbook_forms import textbook_form
from dh2sim.inverse.textbook_steps import Line, Signs, Step, Worksheet
from dh2sim.kinematics.chain import build_chain, serial_spec_of
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import pose_errors
from dh2sim.robot.spec import SpecLike
from dh2sim.typing import Array, read_only

ROUNDED: Final = 1e-5
"""Angles, rad, and lengths as a share of the arm's size, by which a table's rounding may miss a textbook's class."""

_EXACT_ENOUGH: Final = 1e-5
"""Share of the arm's size, and rad: a double root has half the digits of a double."""

_WIDTH: Final = 80


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TextbookBranch:
    """A configuration that the closed form gives."""

    q: Array
    """rad and m, shape (n,)."""
    name: str
    """Such as ``left, above, no flip``; empty where no name applies."""
    signs: Signs
    """The choice of every sign."""
    position_error: float
    """Distance of tool0 from the goal by the table's product, m."""
    rotation_error: float
    """Angle from the goal by the table's product, rad."""

    def as_json(self) -> dict[str, Any]:
        """Return the branch as plain data."""
        return {
            "q": self.q.tolist(),
            "name": self.name,
            "signs": dict(self.signs),
            "position_error": self.position_error,
            "rotation_error": self.rotation_error,
        }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Explanation:
    """A derivation for one pose of tool0."""

    robot: str
    form: str
    """What textbooks call the arm; empty where they have no closed form for it."""
    reason: str
    """Why there is none, or empty."""
    steps: tuple[Step, ...] = ()
    branches: tuple[TextbookBranch, ...] = ()
    """Those that reach the pose."""
    position_only: tuple[TextbookBranch, ...] = ()
    """Those that reach the point with another orientation, of an arm with fewer than six joints."""
    notes: tuple[str, ...] = ()
    """Singular cases, and what is out of reach, in whole sentences."""
    _table: tuple[str, ...] = field(default=(), repr=False)

    def __repr__(self) -> str:
        return f"<Explanation of '{self.robot}': {self.form or self.reason}; print it>"

    def __str__(self) -> str:
        """Return the derivation as one text."""
        return self.text

    def __bool__(self) -> bool:
        """Return whether there is a closed form."""
        return bool(self.form)

    def as_json(self) -> dict[str, Any]:
        """Return the derivation as plain data."""
        return {
            "robot": self.robot,
            "form": self.form,
            "reason": self.reason,
            "steps": [step.as_json() for step in self.steps],
            "branches": [branch.as_json() for branch in self.branches],
            "position_only": [branch.as_json() for branch in self.position_only],
            "notes": list(self.notes),
        }

    @property
    def lines(self) -> tuple[str, ...]:
        """The derivation as text, at most 80 columns wide."""
        if not self.form:
            return tuple(_filled(f"{self.robot}: no closed form of the textbooks. {self.reason}"))
        lines = _filled(f"{self.robot}: {self.form}")
        for number, step in enumerate(self.steps, start=1):
            lines += ["", *_step_lines(number, step)]
        shown = self.branches or self.position_only
        letters = " ".join(letter for letter, _ in shown[0].signs) if shown else ""
        lines += ["", "Branches" + (f", by the signs of {letters}" if letters else ""), *self._table]
        for note in self.notes:
            lines += ["", *_filled(note)]
        return tuple(lines)

    @property
    def text(self) -> str:
        """The derivation as one text."""
        return "\n".join(self.lines)


def explain_inverse_kinematics(robot: SpecLike, T: ArrayLike) -> Explanation:
    """Derive the inverse kinematics of an arm for one pose as a textbook does.

    Args:
        robot: The robot.
        T: Pose of tool0 in base_link, m, shape (4, 4).

    Returns:
        The steps and branches; false, with the reason, where textbooks have no closed form for such an arm.

    Raises:
        ModelError: The robot has branches or closed loops.
        ConfigurationError: ``T`` is not a pose.
    """
    spec = serial_spec_of(robot)
    goal = real_array("T", T)
    if goal.shape != (4, 4) or not np.isfinite(goal).all():
        raise ConfigurationError(f"a pose must be an array of finite numbers of shape (4, 4), got shape {goal.shape}")
    chain = build_chain(spec)
    for tolerance in (EXACT, ROUNDED):
        axes = arm_axes(chain, tolerance)
        form = textbook_form(axes)
        if not isinstance(form, str):
            break
    if isinstance(form, str):
        return Explanation(robot=spec.name, form="", reason=form)
    sheet = Worksheet(spec.units, axes.size, spec.parameters)
    found = []
    for branch in form.solve(sheet, goal):
        q = read_only([x if joint.slides else wrapped(x) for x, joint in zip(branch.q, axes.joints, strict=True)])
        position, rotation = (float(error) for error in pose_errors(table_tool_pose(spec, q), goal))
        [name] = names_of_form(form, q[None])
        found.append(
            TextbookBranch(q=q, name=name, signs=branch.signs, position_error=position, rotation_error=rotation)
        )
    small = _EXACT_ENOUGH if tolerance == EXACT else 100.0 * tolerance
    branches = tuple(b for b in found if b.position_error <= small * axes.size and b.rotation_error <= small)
    others = tuple(b for b in found if b not in branches)
    for other in others:
        signs = ", ".join(f"{letter} = {sign:+d}" for letter, sign in other.signs)
        off = f"turned from its orientation by {sheet.angle(other.rotation_error)}"
        if other.position_error <= small * axes.size:
            sheet.note(f"{signs or 'The one choice'} reaches the goal's position, {off}.")
        else:
            far = sheet.measure(other.position_error)
            sheet.note(f"{signs or 'The one choice'} misses the goal's position by {far}, {off}.")
    worst = max((max(b.position_error / axes.size, b.rotation_error) for b in branches), default=0.0)
    if tolerance > EXACT:
        sheet.note(
            "The table misses the textbook's right angles and meeting points by a little, as rounded numbers do; "
            f"so these branches miss the pose by up to {worst:.0e} of the arm's size or rad."
        )
    table = _branch_table(sheet, branches or others, tuple(joint.slides for joint in axes.joints))
    return Explanation(
        robot=spec.name,
        form=form.title,
        reason="",
        steps=sheet.steps,
        branches=branches,
        position_only=others,
        notes=tuple(sheet.notes),
        _table=tuple(table),
    )


def _filled(text: str, indent: str = "") -> list[str]:
    return textwrap.wrap(text, _WIDTH, initial_indent=indent, subsequent_indent=indent)


def _step_lines(number: int, step: Step) -> list[str]:
    """Return a step: title, formulas, remark, and its lines below the signs that lead to them."""
    lines = textwrap.wrap(f"{number}. {step.title}", _WIDTH, subsequent_indent=" " * (len(str(number)) + 2))
    lines += [f"      {formula}" for formula in step.formulas]
    lines += _filled(step.remark, "   ")
    if step.lines and (step.formulas or step.remark):
        lines.append("")
    for signs, group in itertools.groupby(step.lines, key=lambda line: line.signs):
        if signs:
            lines.append("   " + ", ".join(f"{letter} = {sign:+d}" for letter, sign in signs))
        lines += _group_lines(list(group))
    return lines


def _group_lines(group: list[Line]) -> list[str]:
    """Return lines of the same signs; values that no formula gives stand side by side."""
    width = max(len(line.symbol) for line in group)
    lines = []
    for plain, some in itertools.groupby(group, key=lambda line: line.is_plain):
        if plain:
            values = [f"{line.symbol} = {line.numbers}".replace(" ", "\N{NO-BREAK SPACE}") for line in some]
            lines += [text.replace("\N{NO-BREAK SPACE}", " ") for text in _filled(", ".join(values), "      ")]
            continue
        for line in some:
            lines += textwrap.wrap(
                f"{line.symbol:<{width}} = {line.numbers}",
                _WIDTH,
                initial_indent="      ",
                subsequent_indent=" " * (9 + width),
                replace_whitespace=False,
            )
    return lines


def _branch_table(sheet: Worksheet, branches: tuple[TextbookBranch, ...], slides: tuple[bool, ...]) -> list[str]:
    """Return a table of branches: signs, coordinates, name."""
    if not branches:
        return ["   none"]
    header = ["", *(f"q{i}" for i in range(1, len(slides) + 1)), ""]
    rows = [
        [
            "".join("+" if sign > 0 else "-" for _, sign in branch.signs),
            *(
                sheet.length(x) if slide else sheet.angle(x).rstrip("° rad")
                for x, slide in zip(branch.q.tolist(), slides, strict=True)
            ),
            branch.name,
        ]
        for branch in branches
    ]
    widths = [max(len(row[k]) for row in [header, *rows]) for k in range(len(header) - 1)]
    return [
        f" {' '.join(f'{cell:>{w}}' for cell, w in zip(row, widths, strict=False))}  {row[-1]}".rstrip()
        for row in [header, *rows]
    ]
