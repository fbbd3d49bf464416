"""What of a robot can be fitted: the constants of its table, base and tool, and how tool0 follows them.

Every constant is an elementary motion, so that the derivative of the tool's pose by it is a twist.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

import numpy as np

from dh2sim.kinematics.rotations import rotation_vectors, rotations_of_vectors
from dh2sim.kinematics.transforms import pose_from_rpy, rpy_from_rotation
from dh2sim.robot.links import Pose
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, LengthUnit, Units
from dh2sim.typing import Array, read_only


class Group(StrEnum):
    """Kinds of parameters, as ``--unknown`` names them."""

    BASE = "base"
    TOOL = "tool"
    A = "a"
    ALPHA = "alpha"
    BETA = "beta"
    D = "d"
    THETA = "theta"


AXES: Final = ("x", "y", "z")
POSE_PARTS: Final = (*AXES, *(f"r{axis}" for axis in AXES))
"""A pose is moved along x, y, z, and turned about x, y, z at its origin, of the frame that it is in."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A number that can be fitted."""

    name: str
    """Such as ``base.x``, ``joint_2.alpha``, ``tool.rz``, ``station tracker.x``."""
    group: Group | None
    """None for what belongs to the measurement, not to the robot."""
    is_angle: bool
    row: int = -1
    """Of the table, from 0; -1 for what is in no row."""
    part: int = -1
    """Of a pose, 0 … 5."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Element:
    """An elementary motion of a row: along or about x, y or z."""

    axis: int
    turns: bool
    key: str = ""
    """Column of the table, empty for the joint's own motion."""
    row: int = -1
    joint: int = -1
    """Of the joint vector."""
    sign: float = 1.0


def _of_row(index: int, row: Row, joint: int) -> list[_Element]:
    """Return the elementary motions of a row, in order."""

    def constant(axis: int, key: str, *, turns: bool) -> _Element:
        return _Element(axis=axis, turns=turns, key=key, row=index)

    theta, d = constant(2, "theta", turns=True), constant(2, "d", turns=False)
    a, alpha = constant(0, "a", turns=False), constant(0, "alpha", turns=True)
    moved = [
        _Element(axis=2, turns=row.type.turns, row=index, joint=joint, sign=-1.0 if row.flip else 1.0)
    ] * row.type.moves
    match row.convention:
        case Convention.STANDARD:
            return [*moved, theta, d, a, alpha]
        case Convention.MODIFIED:
            return [a, alpha, *moved, theta, d]
        case Convention.HAYATI:
            has_d = [d] if row.type is JointType.PRISMATIC else []
            return [*moved, theta, *has_d, a, alpha, constant(1, "beta", turns=True)]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Values:
    """Values of all parameters of a robot: numbers of the table by row and column, and two poses."""

    rows: tuple[dict[str, float], ...]
    """theta, d, a, alpha and beta of each row."""
    base: Array
    """Pose of DH frame 0 in base_link, shape (4, 4)."""
    tool: Array
    """Pose of tool0 in DH frame n, shape (4, 4)."""


class RobotParameters:
    """The parameters of a robot's table, base and tool."""

    def __init__(self, spec: RobotSpec) -> None:
        """Take a serial robot, whose rows between nearly parallel axes are Hayati's."""
        self.spec = spec
        self._elements: list[_Element] = []
        joint = 0
        for index, row in enumerate(spec.rows):
            self._elements += _of_row(index, row, joint)
            joint += row.type.moves
        self.n = joint
        base, tool = (
            [
                Parameter(name=f"{group}.{part}", group=group, is_angle=k >= 3, part=k)
                for k, part in enumerate(POSE_PARTS)
            ]
            for group in (Group.BASE, Group.TOOL)
        )
        rows = [
            Parameter(
                name=f"{spec.rows[each.row].name}.{each.key}",
                group=Group(each.key),
                is_angle=each.turns,
                row=each.row,
            )
            for each in self._elements
            if each.key
        ]
        self.parameters: tuple[Parameter, ...] = (*base, *rows, *tool)
        """Base first, the order of the columns of a Jacobian."""

    @property
    def start(self) -> Values:
        """The robot's own values."""
        keys = ("theta", "d", "a", "alpha", "beta")
        return Values(
            rows=tuple({key: getattr(row, key) for key in keys} for row in self.spec.rows),
            base=pose_from_rpy(self.spec.base.pose.xyz, self.spec.base.pose.rpy),
            tool=pose_from_rpy(self.spec.tool.xyz, self.spec.tool.rpy),
        )

    def before_first_motion(self) -> list[int]:
        """Return columns of the table's constants that no joint moves: they place the arm as a whole.

        Those are all up to the first moving joint, and its own theta and d.
        """
        found, moved = [], False
        columns = iter(range(6, len(self.parameters)))
        for element in self._elements:
            if not element.key:
                if moved:
                    break
                moved = True
                continue
            column = next(columns)
            if moved and element.axis != 2:
                break
            found.append(column)
        return found

    def tool_poses(self, values: Values, q: Array) -> tuple[Array, Array]:
        """Return rotations and positions of tool0 in base_link, shapes (N, 3, 3) and (N, 3)."""
        R, p, _ = self._walk(values, q, derive=False)
        return R, p

    def jacobian(self, values: Values, q: Array) -> tuple[Array, Array, Array]:
        """Return poses of tool0 and their derivatives by all parameters.

        Args:
            values: Where.
            q: Joint vectors, rad and m, shape (N, n).

        Returns:
            Rotations, shape (N, 3, 3), positions, shape (N, 3), and the derivatives of position and rotation, shape
            (N, 6, number of parameters): a change dx moves the tool by J[:, :3] dx and turns it about J[:, 3:] dx, in
            base_link.
        """
        R, p, twists = self._walk(values, q, derive=True)
        J = np.empty((len(q), 6, len(twists)))
        for k, (turns, axis, origin) in enumerate(twists):
            if turns:
                J[:, :3, k] = np.cross(axis, p - origin)
                J[:, 3:, k] = axis
            else:
                J[:, :3, k] = axis
                J[:, 3:, k] = 0.0
        return R, p, J

    def _walk(
        self, values: Values, q: Array, *, derive: bool
    ) -> tuple[Array, Array, list[tuple[bool, Array, Array]]]:
        count = len(q)
        twists: list[tuple[bool, Array, Array]] = []
        still = np.zeros((count, 3))
        R, p = np.tile(values.base[:3, :3], (count, 1, 1)), np.tile(values.base[:3, 3], (count, 1))
        if derive:
            twists += [(turns, still + np.eye(3)[k], p) for turns in (False, True) for k in range(3)]
        for each in self._elements:
            if each.key:
                value: Array | float = values.rows[each.row][each.key]
                if derive:
                    twists.append((each.turns, R[:, :, each.axis].copy(), p))
            else:
                value = each.sign * q[:, each.joint]
            if each.turns:
                c, s = (np.reshape(f(value), (-1, 1)) for f in (np.cos, np.sin))
                k, m = (each.axis + 1) % 3, (each.axis + 2) % 3
                R_k, R_m = R[:, :, k], R[:, :, m]
                R = R.copy()
                R[:, :, k], R[:, :, m] = R_k * c + R_m * s, R_m * c - R_k * s
            elif np.ndim(value) or value:
                p = p + R[:, :, each.axis] * np.reshape(value, (-1, 1))
        end = p + R @ values.tool[:3, 3]
        if derive:
            twists += [(turns, R[:, :, k].copy(), end) for turns in (False, True) for k in range(3)]
        return R @ values.tool[:3, :3], end, twists

    def moved(self, values: Values, step: Array) -> Values:
        """Return values changed by a step, one number a parameter."""
        rows = [dict(row) for row in values.rows]
        for parameter, change in zip(self.parameters[6:-6], step[6:-6].tolist(), strict=True):
            assert parameter.group is not None
            rows[parameter.row][parameter.group.value] += change
        return Values(
            rows=tuple(rows), base=moved_pose(values.base, step[:6]), tool=moved_pose(values.tool, step[-6:])
        )

    def change(self, values: Values, since: Values) -> Array:
        """Return by how much values differ from others, one number a parameter, m and rad."""
        rows = [
            values.rows[parameter.row][parameter.group.value] - since.rows[parameter.row][parameter.group.value]
            for parameter in self.parameters[6:-6]
            if parameter.group is not None
        ]
        return np.concatenate([pose_change(values.base, since.base), rows, pose_change(values.tool, since.tool)])

    def rounded(self, values: Values) -> Values:
        """Return values as they are written: to a billionth of a metre and of a radian, or about that in its units.

        What a fit leaves beyond that differs from machine to machine.
        """
        units = self.spec.units
        rows = []
        for row, own in zip(values.rows, self.start.rows, strict=True):
            rows.append(
                {
                    key: value
                    if value == own[key]
                    else _rounded(value, units, turns=key in ("theta", "alpha", "beta"))
                    for key, value in row.items()
                }
            )
        start = self.start
        base, tool = (
            was if np.array_equal(now, was) else _rounded_pose(now, units)
            for now, was in ((values.base, start.base), (values.tool, start.tool))
        )
        return Values(rows=tuple(rows), base=base, tool=tool)

    def robot(self, values: Values) -> RobotSpec:
        """Return the robot with other values; what does not change keeps its numbers."""
        spec, start = self.spec, self.start
        rows = []
        for row, new, own in zip(spec.rows, values.rows, start.rows, strict=True):
            rows.append(
                row
                if new == own
                else replace(row, theta=new["theta"], d=new["d"], a=new["a"], alpha=new["alpha"], beta=new["beta"])
            )
        base, tool = spec.base, spec.tool
        if not np.array_equal(values.base, start.base):
            base = replace(base, pose=_pose(values.base, spec.units))
        if not np.array_equal(values.tool, start.tool):
            pose = _pose(values.tool, spec.units)
            tool = replace(tool, xyz=pose.xyz, rpy=pose.rpy)
        return replace(spec, rows=tuple(rows), base=base, tool=tool, source_file=None)


def moved_pose(T: Array, step: Array) -> Array:
    """Return a pose moved along the axes of the frame that it is in, and turned about them at its own origin."""
    new = np.eye(4)
    new[:3, :3] = rotations_of_vectors(step[3:]) @ T[:3, :3]
    new[:3, 3] = T[:3, 3] + step[:3]
    return new


def pose_change(T: Array, since: Array) -> Array:
    """Return the step that leads from one pose to another, as ``moved_pose`` takes it, shape (6,)."""
    turn = rotation_vectors(T[:3, :3] @ since[:3, :3].T)
    return np.concatenate([T[:3, 3] - since[:3, 3], turn])


_ANGLE_DECIMALS: Final = {AngleUnit.RAD: 9, AngleUnit.DEG: 7}
_LENGTH_DECIMALS: Final = {LengthUnit.M: 9, LengthUnit.MM: 6, LengthUnit.CM: 7, LengthUnit.IN: 7}


def _rounded(value: float, units: Units, *, turns: bool) -> float:
    if turns:
        decimals = _ANGLE_DECIMALS[units.angle]
        return units.radians(round(math.degrees(value) if units.angle is AngleUnit.DEG else value, decimals))
    return units.metres(round(value / units.metres(1.0), _LENGTH_DECIMALS[units.length]))


def _pose(T: Array, units: Units) -> Pose:
    xyz = [_rounded(value, units, turns=False) for value in T[:3, 3].tolist()]
    rpy = [_rounded(value, units, turns=True) for value in rpy_from_rotation(T).tolist()]
    return Pose(xyz=read_only(xyz), rpy=read_only(rpy))


def _rounded_pose(T: Array, units: Units) -> Array:
    pose = _pose(T, units)
    return pose_from_rpy(pose.xyz, pose.rpy)
