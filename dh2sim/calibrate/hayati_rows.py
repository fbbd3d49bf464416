"""A table made fit for calibration: rows between nearly parallel axes become Hayati's.

The common normal of nearly parallel axes is anywhere: a thousandth of a radian moves it by metres, so that a and d of
a standard row say nothing there. A Hayati row ends where the next axis crosses the plane at its start, which moves as
little as the axis does (S. Hayati, M. Mirmirani, J. Robotic Systems 2(4), 1985).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from dh2sim.kinematics.compaction import compact_rows
from dh2sim.kinematics.conversion import convert_rows
from dh2sim.kinematics.far_frames import far_frames
from dh2sim.kinematics.transforms import (
    compose,
    joint_part,
    move_point,
    pose_from_rpy,
    rotate_tensor,
    rpy_from_rotation,
)
from dh2sim.kinematics.trig import atan2, sin_cos
from dh2sim.robot.links import LinkSpec, Pose
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only

NEARLY_PARALLEL: Final = 0.05
"""Sine of the angle between two axes, below which the row between them becomes Hayati's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Shift:
    """Rz(turn) Tz(along): where the frame of old is, seen from the one that takes its place on the same axis."""

    turn: float = 0.0
    along: float = 0.0

    @property
    def is_identity(self) -> bool:
        return self.turn == 0.0 and self.along == 0.0

    @property
    def transform(self) -> Array:
        return joint_part(self.turn, self.along)


def fit_rows(spec: RobotSpec) -> RobotSpec:
    """Return the same arm with Hayati rows where neighbouring axes are nearly parallel, and no frame far away.

    Joint coordinates, links and tool stay what they are; where nothing has to change, the robot itself is returned. A
    modified table stays modified behind its last Hayati row. The result has the same bits on every machine.
    """
    if far_frames(spec).frames:
        spec = compact_rows(spec).spec
    if not any(_is_nearly_parallel(spec, i) for i in range(len(spec.rows) - 1)):
        return spec
    distal = spec
    if any(row.convention is Convention.MODIFIED for row in spec.rows):
        distal = convert_rows(spec, Convention.STANDARD).spec
    rows: list[Row] = []
    shift = _Shift()
    for i, row in enumerate(distal.rows):
        if not shift.is_identity:
            row = replace(row, theta=_sum(row.theta, shift.turn), d=row.d + shift.along)
        shift = _Shift()
        has_no_d = row.convention is Convention.HAYATI and row.type is not JointType.PRISMATIC and row.d != 0.0
        if has_no_d or (i + 1 < len(distal.rows) and row.convention is Convention.STANDARD and _is_level(row)):
            row, shift = _hayati(row)
        rows.append(row)
    fitted = replace(distal, rows=tuple(rows), source_file=None)
    if not shift.is_identity:  # of a last row that was Hayati's already
        T = compose(shift.transform, pose_from_rpy(distal.tool.xyz, distal.tool.rpy))
        fitted = replace(fitted, tool=replace(distal.tool, xyz=read_only(T[:3, 3]), rpy=rpy_from_rotation(T)))
    if spec.convention is Convention.MODIFIED:
        fitted = _modified_behind_hayati(fitted)
    return replace(fitted, convention=spec.convention, source_file=None)


def _modified_behind_hayati(spec: RobotSpec) -> RobotSpec:
    """Return the table with modified rows behind its last Hayati row; those whose beta is zero stay Hayati's, too."""
    beta = [row.beta for row in spec.rows]
    held = [
        replace(row, beta=1.0) if row.convention is Convention.HAYATI else row for row in spec.rows
    ]  # a conversion takes a Hayati row for a standard one only where its beta is zero
    converted = convert_rows(replace(spec, rows=tuple(held)), Convention.MODIFIED).spec
    rows = [
        replace(row, beta=was) if row.convention is Convention.HAYATI else row
        for row, was in zip(converted.rows, beta, strict=True)
    ]
    return replace(converted, rows=tuple(rows))


def _is_nearly_parallel(spec: RobotSpec, i: int) -> bool:
    """Whether the axes of row i, from 0, and of the next one are nearly parallel, and no Hayati row is between."""
    row, after = spec.rows[i], spec.rows[i + 1]
    twists = [0.0 if row.convention is Convention.MODIFIED else row.alpha]
    twists.append(after.alpha if after.convention is Convention.MODIFIED else 0.0)
    return row.convention is not Convention.HAYATI and abs(math.sin(sum(twists))) < NEARLY_PARALLEL


def _is_level(row: Row) -> bool:
    return abs(sin_cos(row.alpha)[0]) < NEARLY_PARALLEL


def _hayati(row: Row) -> tuple[Row, _Shift]:
    """Return a row as Hayati's, and where its frame of old is in the new one."""
    made = replace(row, convention=Convention.HAYATI)
    if row.type is JointType.PRISMATIC or row.d == 0.0:  # it may begin where it does
        return made, _Shift()
    sine, cosine = sin_cos(row.alpha)
    if row.beta == 0.0 and sine == 0.0:
        shift = _Shift(along=row.d * cosine)
        return replace(made, d=0.0, link=_moved(row.link, shift)), shift
    s_beta, c_beta = sin_cos(row.beta)
    z = (s_beta, -sine * c_beta, cosine * c_beta)  # the next axis, through (a, 0, d)
    x, y = row.a - row.d * z[0] / z[2], -row.d * z[1] / z[2]  # where it crosses the plane
    length = math.sqrt(x * x + y * y)
    flipped = row.a < 0.0
    turn = 0.0 if length == 0.0 else atan2(-y, -x) if flipped else atan2(y, x)
    s, c = sin_cos(turn)
    zx, zy = c * z[0] + s * z[1], c * z[1] - s * z[0]
    beta = atan2(zx, math.sqrt(zy * zy + z[2] * z[2]))
    alpha = atan2(-zy, z[2])
    new = replace(made, theta=_sum(row.theta, turn), d=0.0, a=-length if flipped else length, alpha=alpha, beta=beta)
    # the x axes of both frames are perpendicular to the common z axis
    old_x, new_x, new_y = (c_beta, sine * s_beta, -cosine * s_beta), _x(new, turn), _y(new, turn)
    shift = _Shift(turn=atan2(_dot(old_x, new_y), _dot(old_x, new_x)), along=row.d / z[2])
    return replace(new, link=_moved(row.link, shift)), shift


def _x(row: Row, turn: float) -> tuple[float, float, float]:
    """Return x of Rz(turn) Rx(alpha) Ry(beta)."""
    (s, c), (sa, ca), (sb, cb) = sin_cos(turn), sin_cos(row.alpha), sin_cos(row.beta)
    return c * cb - s * sa * sb, s * cb + c * sa * sb, -ca * sb


def _y(row: Row, turn: float) -> tuple[float, float, float]:
    """Return y of Rz(turn) Rx(alpha) Ry(beta)."""
    (s, c), (sa, ca) = sin_cos(turn), sin_cos(row.alpha)
    return -s * ca, c * ca, sa


def _dot(u: tuple[float, float, float], v: tuple[float, float, float]) -> float:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def _sum(angle: float, turn: float) -> float:
    """Return the sum of two angles, in (-pi, pi] if neither is zero."""
    if angle == 0.0 or turn == 0.0:
        return angle or turn
    return atan2(*sin_cos(angle + turn))


def _moved(link: LinkSpec, shift: _Shift) -> LinkSpec:
    """Return what a link says of itself, written down in its new DH frame."""
    if shift.is_identity:
        return link
    T = shift.transform
    mesh = link.mesh
    if mesh is not None:
        pose = compose(T, pose_from_rpy(mesh.pose.xyz, mesh.pose.rpy))
        mesh = replace(mesh, pose=Pose(xyz=read_only(pose[:3, 3]), rpy=rpy_from_rotation(pose)))
    return replace(
        link,
        com=None if link.com is None else read_only(move_point(T, link.com)),
        inertia=None if link.inertia is None else rotate_tensor(T, link.inertia),
        mesh=mesh,
    )
