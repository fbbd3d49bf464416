"""Forward kinematics and Jacobians of many different Denavit-Hartenberg tables at once.

The tables have rows of the same types and conventions; their numbers differ. One array a component, a block of
configurations at a time: nothing is turned into a chain, or multiplied as matrices.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.batch_frame import keep_freed_memory
from dh2sim.kinematics.trig import sin_cos
from dh2sim.robot.row import Convention, JointType
from dh2sim.robot.spec import SpecLike, spec_of
from dh2sim.robot.variation import CELLS, Variation
from dh2sim.typing import Array, read_only

BLOCK: Final = 4096
"""Configurations that are computed together, so that their arrays stay in the processor's cache."""


@dataclass(frozen=True, slots=True)
class _RowKind:
    """What the tables have in common of a row."""

    type: JointType
    convention: Convention
    sign: float


class TableBatch:
    """T tables of the same types of joints and conventions.

    ``a``, ``alpha``, ``d``, ``theta`` and ``beta`` are the tables, m and rad, each of shape (T, rows) and read-only;
    ``T_base_link_dh0`` and ``T_dhn_tool0`` the poses before and behind them, of shape (4, 4), or (T, 4, 4) where each
    table has its own.
    """

    def __init__(
        self,
        *,
        a: ArrayLike,
        alpha: ArrayLike,
        d: ArrayLike,
        theta: ArrayLike,
        beta: ArrayLike = 0.0,
        types: Sequence[JointType | str] | JointType | str = JointType.REVOLUTE,
        convention: Sequence[Convention | str] | Convention | str = Convention.STANDARD,
        flip: Sequence[bool] | bool = False,
        base: ArrayLike | None = None,
        tool: ArrayLike | None = None,
    ) -> None:
        """Take tables.

        Args:
            a: m; shape (T, rows), as all numbers of tables; those that are the same in all tables may have the shape
                (rows,), or be one number.
            alpha: rad.
            d: m; a prismatic coordinate adds to it.
            theta: rad; a revolute coordinate adds to it.
            beta: rad; of Hayati rows.
            types: 'revolute', 'continuous', 'prismatic' or 'fixed', of each row or of all.
            convention: 'standard', 'modified' or 'hayati', of each row or of all.
            flip: Whether the joint coordinate subtracts, of each row or of all.
            base: Pose of DH frame 0 in base_link, shape (4, 4) or (T, 4, 4); by default the identity.
            tool: Pose of tool0 in the last DH frame, likewise.

        Raises:
            ConfigurationError: Shapes do not fit, or something is not finite or not known.
        """
        given = [np.asarray(array, dtype=np.float64) for array in (a, alpha, d, theta, beta)]
        try:
            shape = np.broadcast_shapes(*(array.shape for array in given))
        except ValueError:
            shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(CELLS, given, strict=True))
            raise ConfigurationError(f"tables must have numbers of one shape (T, rows), got {shapes}") from None
        if len(shape) != 2 or not all(shape):
            raise ConfigurationError(f"expected numbers of tables of shape (T, rows), got shape {shape}")
        if not all(np.isfinite(array).all() for array in given):
            raise ConfigurationError("the numbers of tables must be finite")
        self.a, self.alpha, self.d, self.theta, self.beta = (
            read_only(np.broadcast_to(array, shape)) for array in given
        )
        rows = shape[1]
        try:
            kinds = [JointType(kind) for kind in _of_rows(types, rows, "types")]
            conventions = [Convention(word) for word in _of_rows(convention, rows, "convention")]
        except ValueError as error:
            raise ConfigurationError(f"{error}") from None
        signs = [-1.0 if flipped else 1.0 for flipped in _of_rows(flip, rows, "flip")]
        self._rows = [_RowKind(*row) for row in zip(kinds, conventions, signs, strict=True)]
        self.T_base_link_dh0 = self._pose(base, "base")
        self.T_dhn_tool0 = self._pose(tool, "tool")

    @classmethod
    def from_robot(cls, robot: SpecLike, values: Mapping[str, ArrayLike] | None = None) -> TableBatch:
        """Take the tables of robots that differ from one in some numbers of its file.

        Args:
            robot: The robot, in any form.
            values: By name, as ``dh2sim rollout --designs`` has them: parameters of the robot file, cells such as
                ``a2``, or paths such as ``tool.xyz[2]``; in the units of the file, each of shape (T,).

        Raises:
            RobotError: A name is not that of a number of the table, the base or the tool's pose, or of a parameter.
            ConfigurationError: Values have other shapes, or are not finite.
        """
        spec = spec_of(robot)
        columns = {name: np.asarray(column, dtype=np.float64) for name, column in (values or {}).items()}
        if any(column.ndim != 1 or not np.isfinite(column).all() for column in columns.values()):
            raise ConfigurationError("values must be finite numbers, a list of them for each name")
        if len({len(column) for column in columns.values()}) > 1:
            lengths = ", ".join(f"{len(column)} of {name}" for name, column in columns.items())
            raise ConfigurationError(f"expected as many values for each name, got {lengths}")
        count = next((len(column) for column in columns.values()), 1)
        stacked = np.stack([*columns.values()], axis=1) if columns else np.zeros((1, 0))
        with np.errstate(all="ignore"):  # what is not finite is refused with the tables
            own = Variation(spec, list(columns)).geometry(stacked)
        table = {
            cell: np.stack(
                [
                    np.broadcast_to(own.get(("joints", i, cell), getattr(row, cell)), count)
                    for i, row in enumerate(spec.rows)
                ],
                axis=1,
            )
            for cell in CELLS
        }
        poses = {}
        for owner, pose in (("base", spec.base.pose), ("tool", spec.tool.pose)):
            parts = [
                [own.get((owner, key, i), number) for i, number in enumerate(getattr(pose, key).tolist())]
                for key in ("xyz", "rpy")
            ]
            poses[owner] = _poses(*parts)
        return cls(
            **table,
            types=[row.type for row in spec.rows],
            convention=[row.convention for row in spec.rows],
            flip=[row.flip for row in spec.rows],
            **poses,
        )

    def __len__(self) -> int:
        """Return the number of tables."""
        return len(self.a)

    @property
    def n(self) -> int:
        """Number of joints that move: the length of a joint vector."""
        return sum(row.type.moves for row in self._rows)

    def fk(self, q: ArrayLike, *, out: Array | None = None) -> Array:
        """Return the pose of tool0 in base_link of every table.

        Args:
            q: Joint vectors, rad and m: one for all tables, shape (n,); one for each, (T, n); or k for each,
                (T, k, n).
            out: Takes the result, of its shape; by default a new array.

        Returns:
            Shape (T, 4, 4), or (T, k, 4, 4).

        Raises:
            ConfigurationError: ``q`` or ``out`` has the wrong shape, or a coordinate is not finite.
        """
        vectors, shape = self._vectors(q)
        result = _result(out, (*shape, 4, 4))
        flat = result.reshape(-1, 4, 4)
        for part, numbers, columns in self._blocks(vectors):
            frame = _Frame(numbers.base)
            for _ in self._walk(frame, numbers, columns):
                pass
            frame.then(numbers.tool)
            frame.write(flat[part])
        return result

    def jacobian(self, q: ArrayLike, *, out: Array | None = None) -> Array:
        """Return the geometric Jacobian of tool0 in base_link of every table.

        Args:
            q: As for :meth:`fk`.
            out: Takes the result, of its shape; by default a new array.

        Returns:
            Shape (T, 6, n), or (T, k, 6, n): rows 0-2 linear, rows 3-5 angular.

        Raises:
            ConfigurationError: ``q`` or ``out`` has the wrong shape, or a coordinate is not finite.
        """
        vectors, shape = self._vectors(q)
        result = _result(out, (*shape, 6, self.n))
        flat = result.reshape(-1, 6, self.n)
        for part, numbers, columns in self._blocks(vectors):
            frame = _Frame(numbers.base)
            axes = list(self._walk(frame, numbers, columns))
            frame.then(numbers.tool)
            for j, (kind, z, p) in enumerate(axes):
                column = flat[part, :, j]
                if kind.type.turns:
                    x, y, w = (tip - own for tip, own in zip(frame.p, p, strict=True))
                    linear = (z[1] * w - z[2] * y, z[2] * x - z[0] * w, z[0] * y - z[1] * x)
                    columns6 = (*linear, *z)
                else:
                    columns6 = (*z, 0.0, 0.0, 0.0)
                for i, component in enumerate(columns6):
                    np.multiply(component, kind.sign, out=column[:, i])
        return result

    def _walk(
        self, frame: _Frame, numbers: _Numbers, columns: Array
    ) -> Iterator[tuple[_RowKind, list[Any], list[Any]]]:
        """Move a frame through all rows; yield each moving row with the axis and the origin of its joint."""
        coordinates = iter(columns)
        for i, row in enumerate(self._rows):
            a, alpha, d, theta, beta = (numbers.cells[cell][i] for cell in CELLS)
            if row.convention is Convention.MODIFIED:
                frame.slide("x", a)
                frame.turn("x", alpha)
            if row.type.moves:
                yield row, list(frame.z), list(frame.p)
                coordinate = next(coordinates)
                if row.type.turns:
                    theta = theta + row.sign * coordinate
                else:
                    d = d + row.sign * coordinate
            frame.turn("z", theta)
            frame.slide("z", d)
            if row.convention is not Convention.MODIFIED:
                frame.slide("x", a)
                frame.turn("x", alpha)
            if row.convention is Convention.HAYATI:
                frame.turn("y", beta)

    def _vectors(self, q: ArrayLike) -> tuple[Array, tuple[int, ...]]:
        """Return joint vectors of shape (T, k, n), and the shape of what is computed of them."""
        vectors = np.asarray(q, dtype=np.float64)
        count, n = len(self), self.n
        shape: tuple[int, ...] = (count,)
        match vectors.shape:
            case (joints,) if joints == n:
                vectors = np.broadcast_to(vectors, (count, 1, n))
            case (tables, joints) if (tables, joints) == (count, n):
                vectors = vectors[:, None]
            case (tables, poses, joints) if (tables, joints) == (count, n):
                shape = (count, poses)
            case _:
                raise ConfigurationError(
                    f"expected an array of shape ({n},), ({count}, {n}) or ({count}, k, {n}), got shape "
                    f"{vectors.shape}"
                )
        if not np.isfinite(vectors).all():
            raise ConfigurationError("joint coordinates must be finite")
        return vectors, shape

    def _blocks(self, vectors: Array) -> Iterator[tuple[slice, _Numbers, Array]]:
        """Yield parts of all configurations, (T, k, n), with the numbers of their tables and coordinates (n, N)."""
        count, poses, n = vectors.shape
        keep_freed_memory()
        tables = max(1, BLOCK // max(1, poses))
        for first in range(0, count, tables):
            part = slice(first, min(first + tables, count))
            for begin in range(0, poses, BLOCK):
                own = vectors[part, begin : begin + BLOCK]
                width = own.shape[1]
                start = first * poses + begin
                yield (
                    slice(start, start + own.shape[0] * width),
                    _Numbers(self, part, width),
                    np.ascontiguousarray(own.reshape(-1, n).T),
                )

    def _pose(self, given: ArrayLike | None, name: str) -> Array:
        pose = np.eye(4) if given is None else np.asarray(given, dtype=np.float64)
        if pose.shape not in ((4, 4), (len(self), 4, 4)):
            raise ConfigurationError(f"{name} must have shape (4, 4) or ({len(self)}, 4, 4), got shape {pose.shape}")
        if not np.isfinite(pose).all():
            raise ConfigurationError(f"{name} must be finite")
        return read_only(pose)


class _Numbers:
    """What a block's configurations have of their tables; a float where all have the same."""

    def __init__(self, tables: TableBatch, part: slice, repeated: int) -> None:
        def spread(array: Array) -> Any:
            first = float(array.flat[0])
            if (array == first).all():
                return first
            return np.repeat(array, repeated) if repeated > 1 else np.ascontiguousarray(array)

        self.cells = {cell: [spread(column) for column in getattr(tables, cell)[part].T] for cell in CELLS}
        self.base, self.tool = (
            [
                [spread(np.atleast_1d(pose[..., i, j][part] if pose.ndim == 3 else pose[i, j])) for j in range(4)]
                for i in range(3)
            ]
            for pose in (tables.T_base_link_dh0, tables.T_dhn_tool0)
        )


class _Frame:
    """A frame's axes and origin in base_link, each of three components: floats, or arrays of shape (N,)."""

    def __init__(self, T: list[list[Any]]) -> None:
        self.x, self.y, self.z, self.p = ([row[j] for row in T] for j in range(4))

    def turn(self, about: str, angle: Any) -> None:
        """Turn the frame about one of its own axes."""
        if isinstance(angle, float):
            sine, cosine = sin_cos(angle)
            if cosine == 1.0:
                return
        else:
            sine, cosine = np.sin(angle), np.cos(angle)
        first, second = {"x": ("y", "z"), "y": ("z", "x"), "z": ("x", "y")}[about]
        u, v = getattr(self, first), getattr(self, second)
        setattr(self, first, _combined(u, cosine, v, sine))
        setattr(self, second, _combined(v, cosine, u, -sine))

    def slide(self, along: str, distance: Any) -> None:
        """Move the frame along one of its own axes."""
        if isinstance(distance, float) and distance == 0.0:
            return
        self.p = [origin + axis * distance for origin, axis in zip(self.p, getattr(self, along), strict=True)]

    def then(self, T: list[list[Any]]) -> None:
        """Move on to a frame that has the pose ``T`` in this one."""
        x, y, z = self.x, self.y, self.z
        columns = [
            [sum((a * T[k][j] for k, a in enumerate(axes)), 0.0) for axes in zip(x, y, z, strict=True)]
            for j in range(4)
        ]
        self.p = [origin + moved for origin, moved in zip(self.p, columns[3], strict=True)]
        self.x, self.y, self.z = columns[:3]

    def write(self, out: Array) -> None:
        """Put the poses into ``out``, shape (N, 4, 4)."""
        for j, column in enumerate((self.x, self.y, self.z, self.p)):
            for i, component in enumerate(column):
                out[:, i, j] = component
        out[:, 3] = (0.0, 0.0, 0.0, 1.0)


def _combined(u: list[Any], a: Any, v: list[Any], b: Any) -> list[Any]:
    """Return a u + b v of two columns; a factor of 0 or 1 costs nothing."""
    if isinstance(a, float) and a == 0.0:
        return [second * b for second in v]
    if isinstance(b, float) and b == 0.0:
        return [first * a for first in u]
    return [first * a + second * b for first, second in zip(u, v, strict=True)]


def _of_rows(given: Any, rows: int, name: str) -> list[Any]:
    """Return a value for each row, of one for all or of as many as there are rows."""
    if isinstance(given, str | bool):
        return [given] * rows
    values = list(given)
    if len(values) != rows:
        raise ConfigurationError(f"{name} must have one value for each of {rows} rows, got {len(values)}")
    return values


def _result(out: Array | None, shape: tuple[int, ...]) -> Array:
    if out is None:
        return np.empty(shape)
    if out.shape != shape or out.dtype != np.float64 or not out.flags.c_contiguous or not out.flags.writeable:
        raise ConfigurationError(f"out must be a writeable array of doubles of shape {shape}, in C order")
    return out


def _poses(xyz: list[Any], rpy: list[Any]) -> Array:
    """Return Rz(yaw) Ry(pitch) Rx(roll) with a position, shape (4, 4), or (T, 4, 4) where numbers are arrays."""
    frame = _Frame([[1.0, 0.0, 0.0, xyz[0]], [0.0, 1.0, 0.0, xyz[1]], [0.0, 0.0, 1.0, xyz[2]]])
    for axis, angle in zip("zyx", reversed(rpy), strict=True):
        frame.turn(axis, angle)
    columns = np.broadcast_arrays(*frame.x, *frame.y, *frame.z, *frame.p)
    poses = np.zeros((*columns[0].shape, 4, 4))
    poses[..., :3, :] = np.stack(columns, axis=-1).reshape(*columns[0].shape, 4, 3).swapaxes(-1, -2)
    poses[..., 3, 3] = 1.0
    return poses
