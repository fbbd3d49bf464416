"""A table rewritten in another convention; the arm, its links and its joint coordinates stay what they are.

Every table is one product base · … X Z X Z … · tool of link parts X = Tx(a) Rx(alpha) and joint parts
Z = Rz(theta) Tz(d); a Hayati row has Ry(beta) after its X. The conventions cut it into rows at different places, so a
conversion hands link parts from row to row and computes next to nothing: two that meet add up, as numbers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeVar

from dh2sim.kinematics.transforms import (
    compose,
    link_part,
    move_point,
    pose_from_rpy,
    rotate_tensor,
    rpy_from_rotation,
)
from dh2sim.kinematics.trig import atan2, sin_cos
from dh2sim.robot.links import BaseSpec, LinkSpec, MeshSpec, PayloadSpec, Pose, ToolSpec
from dh2sim.robot.row import Convention, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only


@dataclass(frozen=True, slots=True, kw_only=True)
class XPart:
    """X = Tx(a) Rx(alpha): a shift along x and a turn about it, in either order."""

    a: float = 0.0
    """m."""
    alpha: float = 0.0
    """rad."""

    @property
    def is_identity(self) -> bool:
        """Whether it leads nowhere."""
        return self.a == 0.0 and self.alpha == 0.0

    @property
    def transform(self) -> Array:
        """As a pose, shape (4, 4)."""
        return link_part(self.a, self.alpha)


def merged(first: XPart, second: XPart) -> XPart:
    """Return the product of two: a and alpha add.

    A sum of two angles is brought to (-pi, pi]; a number that meets a zero is handed on as it is.
    """
    if first.alpha == 0.0 or second.alpha == 0.0:
        alpha = first.alpha or second.alpha
    else:
        alpha = _wrapped(_wrapped(first.alpha) + _wrapped(second.alpha))
    return XPart(a=first.a + second.a, alpha=alpha)


def inverse(part: XPart) -> XPart:
    """Return the link part that leads back."""
    return XPart(a=0.0 - part.a, alpha=0.0 - part.alpha)


def x_part_of(pose: Pose) -> XPart | None:
    """Return a pose that is written as a pure Tx(a) Rx(alpha) as such, or None."""
    (x, y, z), (roll, pitch, yaw) = pose.xyz.tolist(), pose.rpy.tolist()
    return XPart(a=x, alpha=roll) if y == z == pitch == yaw == 0.0 else None


def as_pose(part: XPart) -> Pose:
    """Return a link part as a pose."""
    return Pose(xyz=read_only([part.a, 0.0, 0.0]), rpy=read_only([part.alpha, 0.0, 0.0]))


def before(part: XPart, pose: Pose) -> Pose:
    """Return X · T, the pose of a frame seen from where X begins."""
    return _product(part, pose, pose_first=False)


def behind(pose: Pose, part: XPart) -> Pose:
    """Return T · X, the pose of where X ends."""
    return _product(part, pose, pose_first=True)


def _product(part: XPart, pose: Pose, *, pose_first: bool) -> Pose:
    if part.is_identity:
        return pose
    if (other := x_part_of(pose)) is not None:
        return as_pose(merged(other, part))
    T = pose_from_rpy(pose.xyz, pose.rpy)
    product = compose(T, part.transform) if pose_first else compose(part.transform, T)
    return Pose(xyz=read_only(product[:3, 3]), rpy=rpy_from_rotation(product))


def _wrapped(angle: float) -> float:
    """The angle in (-pi, pi], rad; one that is in it already stays as it is."""
    if -math.pi < angle <= math.pi:
        return angle
    return atan2(*sin_cos(angle))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Conversion:
    """A converted robot, and what could not be converted."""

    spec: RobotSpec
    notes: tuple[str, ...]
    """A sentence for each row that is not of the convention asked for, base first."""


def convert_rows(spec: RobotSpec, to: Convention) -> Conversion:
    """Rewrite a robot's table in the standard or the modified convention, by the index shift.

    Joint parts and all else of a joint stay. Link parts move: a modified row takes the X before its Z, a standard one
    the X after it. Where that leaves a choice:

    * Two X that meet, where conventions were mixed, become one: a and alpha add, and the sum of two alpha that are
      not zero is brought to (-pi, pi]. Every other number of the table is handed on as it is.
    * To modified: row 1, unless it was modified, takes over a base pose that is written as a pure Tx(a) Rx(alpha),
      and DH frame 0 becomes base_link. The X behind the last Z goes into the tool.
    * To standard: the X before the first Z goes into the base. The last row, if it was modified, takes over a tool
      that is written as a pure Tx(a) Rx(alpha), and DH frame n becomes tool0.

    An all-standard table comes back from modified with the same numbers, bit for bit, unless there is a tool and it
    is a pure Tx(a) Rx(alpha) or the last row has an X too; an all-modified one comes back from standard so, unless
    there is a base pose and it is a pure Tx(a) Rx(alpha) or the first row has an X too. Then the ends are cut another
    way, and the arm is the same.

    A Hayati row whose beta is not zero stays, since no other row has a second twist. It takes only what comes after
    its Z, so that rows before it may have to stay standard, and rows after it modified. One whose beta is zero is a
    standard row.

    DH frames move with the cuts. Centres of mass, inertias and mesh poses, which the file gives in them, are
    written down in the new ones, rounded; every body stays where it is.

    Args:
        spec: The robot; rows of all conventions may be mixed.
        to: ``Convention.STANDARD`` or ``Convention.MODIFIED``.

    Returns:
        The robot, without a source file, and a note on every row that stays what it was.

    Raises:
        ValueError: ``to`` is neither of the two.
    """
    if to not in (Convention.STANDARD, Convention.MODIFIED):
        raise ValueError(f"a table is converted to standard or modified, not to {to}")
    stays = _stays_modified(spec.rows) if to is Convention.STANDARD else _stays_distal(spec.rows)
    cut = _cut_behind_links if to is Convention.STANDARD else _cut_before_links
    links, base, tool = cut(spec, stays)
    rows = tuple(
        _kept(row) if keep else _rewritten(row, link, to)
        for row, keep, link in zip(spec.rows, stays, links, strict=True)
    )
    T_new_old = _shift(spec.rows[-1], rows[-1])
    converted = replace(
        spec,
        rows=rows,
        convention=to,
        base=base,
        tool=_moved_tool(spec.tool, tool, T_new_old),
        payload=_moved_payload(spec.payload, T_new_old),
        source_file=None,
    )
    notes = tuple(_note(spec.rows, i, to) for i, keep in enumerate(stays) if keep)
    return Conversion(spec=converted, notes=notes)


def _cut_before_links(spec: RobotSpec, stays: Sequence[bool]) -> tuple[list[XPart], BaseSpec, Pose]:
    """The X before every Z, and what is left of base and tool; what is said of rows that stay does not count."""
    rows, base, tool = spec.rows, spec.base, spec.tool.pose
    links = [_head(rows[0])]
    for (before_it, row), keep in zip(pairwise(rows), stays[:-1], strict=True):
        links.append(_head(row) if keep else merged(_tail(before_it), _head(row)))
    of_base = x_part_of(base.pose)
    if not stays[0] and rows[0].convention is not Convention.MODIFIED and of_base and not of_base.is_identity:
        links[0] = of_base
        base = replace(base, pose=Pose(), mesh=_moved_mesh(base.mesh, of_base))
    if not stays[-1]:
        tool = before(_tail(rows[-1]), tool)
    return links, base, tool


def _cut_behind_links(spec: RobotSpec, stays: Sequence[bool]) -> tuple[list[XPart], BaseSpec, Pose]:
    """The X behind every Z, and what is left of base and tool; what is said of rows that stay does not count."""
    rows, base, tool = spec.rows, spec.base, spec.tool.pose
    links = [*(merged(_tail(row), _head(behind_it)) for row, behind_it in pairwise(rows)), _tail(rows[-1])]
    of_tool = x_part_of(tool)
    if not stays[-1] and rows[-1].convention is Convention.MODIFIED and of_tool and not of_tool.is_identity:
        links[-1], tool = of_tool, Pose()
    first = _head(rows[0])
    if not first.is_identity:
        base = replace(base, pose=behind(base.pose, first), mesh=_moved_mesh(base.mesh, inverse(first)))
    return links, base, tool


def _stays_distal(rows: Sequence[Row]) -> list[bool]:
    """Which rows cannot become modified: those with a second twist, and those whose X nobody behind can take."""
    stays = [_twists_twice(row) for row in rows]
    for i in reversed(range(len(rows) - 1)):
        stays[i] = stays[i] or (stays[i + 1] and not _tail(rows[i]).is_identity)
    return stays


def _stays_modified(rows: Sequence[Row]) -> list[bool]:
    """Which rows cannot become standard: those with a second twist, and those whose X nobody before can take."""
    stays = [_twists_twice(row) for row in rows]
    for i in range(1, len(rows)):
        stays[i] = stays[i] or (stays[i - 1] and not _head(rows[i]).is_identity)
    return stays


def _twists_twice(row: Row) -> bool:
    return row.convention is Convention.HAYATI and row.beta != 0.0


def _head(row: Row) -> XPart:
    """The X before a row's Z."""
    return XPart(a=row.a, alpha=row.alpha) if row.convention is Convention.MODIFIED else XPart()


def _tail(row: Row) -> XPart:
    """The X behind a row's Z."""
    return XPart() if row.convention is Convention.MODIFIED else XPart(a=row.a, alpha=row.alpha)


def _kept(row: Row) -> Row:
    """A row that stays; a Hayati row without a second twist is a standard one."""
    plain = row.convention is Convention.HAYATI and not _twists_twice(row)
    return replace(row, convention=Convention.STANDARD) if plain else row


def _rewritten(row: Row, link: XPart, to: Convention) -> Row:
    new = replace(row, convention=to, a=link.a, alpha=link.alpha, beta=0.0)
    return replace(new, link=_moved_body(row.link, _shift(row, new)))


def _shift(row: Row, new: Row) -> XPart:
    """The old DH frame of a row in the new one: both follow the same Z, and differ only in what comes after it."""
    return merged(_tail(row), inverse(_tail(new)))


_BodySpec = TypeVar("_BodySpec", LinkSpec, ToolSpec)


def _moved_body(body: _BodySpec, T_new_old: XPart) -> _BodySpec:
    if T_new_old.is_identity:
        return body
    T = T_new_old.transform
    return replace(
        body,
        com=_moved_point(body.com, T_new_old),
        inertia=None if body.inertia is None else rotate_tensor(T, body.inertia),
        mesh=_moved_mesh(body.mesh, T_new_old),
    )


def _moved_tool(tool: ToolSpec, pose: Pose, T_new_old: XPart) -> ToolSpec:
    """Return the tool with tool0 at ``pose`` in the new DH frame n."""
    shape = tool.shape if tool.shape is None else replace(tool.shape, pose=before(T_new_old, tool.shape.pose))
    return replace(_moved_body(tool, T_new_old), xyz=pose.xyz, rpy=pose.rpy, shape=shape)


def _moved_payload(payload: PayloadSpec, T_new_old: XPart) -> PayloadSpec:
    return replace(payload, com=_moved_point(payload.com, T_new_old))


def _moved_point(point: Array | None, T_new_old: XPart) -> Array | None:
    if point is None or T_new_old.is_identity:
        return point
    return read_only(move_point(T_new_old.transform, point))


def _moved_mesh(mesh: MeshSpec | None, T_new_old: XPart) -> MeshSpec | None:
    return None if mesh is None else replace(mesh, pose=before(T_new_old, mesh.pose))


def _note(rows: Sequence[Row], i: int, to: Convention) -> str:
    row = rows[i]
    if _twists_twice(row):
        return f"{row.name} stays a Hayati row: its beta is {row.beta!r} rad, and a {to} row has no second twist."
    if to is Convention.MODIFIED:
        kept, other, place = "standard", rows[i + 1], "behind"
    else:
        kept, other, place = "modified", rows[i - 1], "before"
    kind = "Hayati" if _twists_twice(other) else kept
    return f"{row.name} stays {kept}: {other.name}, {place} it, stays {kind} and cannot take over its a and alpha."
