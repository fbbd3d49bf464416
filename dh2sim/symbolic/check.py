"""Forms compared with the oracle at random configurations, before anybody sees them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, Final

import numpy as np

from dh2sim.errors import MismatchError
from dh2sim.kinematics.table_oracle import row_matrix, table_frame_poses, table_tool_pose
from dh2sim.robot.row import Convention
from dh2sim.symbolic.angles import slide_row, trig_of
from dh2sim.symbolic.expression import evaluated
from dh2sim.symbolic.form import Form
from dh2sim.symbolic.polynomial import Atom
from dh2sim.symbolic.table import SymbolicTable
from dh2sim.typing import Array

SAMPLES: Final = 20
TOLERANCE: Final = 1e-13
"""Of entries without a unit; times the reach for lengths."""


def scattered(count: int, dimensions: int, seed: int) -> Array:
    """Return points of the unit cube that no hyperplane through few of them explains, shape (count, dimensions).

    Multiples of the square roots of primes, less their whole parts (H. Weyl, 1916): numpy.random takes longer to
    import than most forms take to compute.
    """
    primes = [p for p in range(2, 8 * dimensions + 16) if all(p % d for d in range(2, math.isqrt(p) + 1))]
    steps = np.arange(1, count + 1)[:, None] + 1009 * seed
    points: Array = np.modf(steps * np.sqrt(np.array(primes[:dimensions], dtype=np.float64)))[0]
    return points


class SampledConfigurations:
    """Random configurations of a robot, and what atoms and frames are there."""

    def __init__(self, table: SymbolicTable, *, seed: int = 0, q: Array | None = None) -> None:
        """``q`` are configurations to take instead, rad and m, shape (samples, n)."""
        self.table = table
        spec = table.spec
        self._metre = spec.units.metres(1.0)
        rows = spec.moving_rows
        lengths = [abs(v) for row in spec.rows for v in (row.a, row.d)]
        lengths += [abs(v) for pose in (spec.base.pose, spec.tool.pose) for v in pose.xyz.tolist()]
        self.reach = max(math.fsum(lengths), self._metre)
        """Sum of the lengths of the table, m, and how far slides are moved."""
        shares = 2.0 * scattered(SAMPLES, len(rows), seed) - 1.0
        scale = np.array([math.pi if row.type.turns else self.reach for row in rows])
        self.q: Array = shares * scale if q is None else q
        """rad and m, shape (samples, n)."""
        self._frames = table_frame_poses(spec, self.q)
        self._known: dict[str, Array] = {}

    @property
    def length(self) -> float:
        """The reach in the file's unit."""
        return self.reach / self._metre

    @property
    def pose_scale(self) -> Array:
        """Sizes of the columns of a pose: 1 of its rotation, the reach of its position."""
        return np.array([1.0, 1.0, 1.0, self.length])

    def values(self, atoms: Iterable[Atom]) -> dict[Atom, Any]:
        """Return what atoms are: lengths in the file's unit, arrays of shape (samples,)."""
        column = {row: self.q[:, k] for k, row in enumerate(self.table.moving)}
        letters = self.table.letters
        result: dict[Atom, Any] = {}
        for atom in atoms:
            trig, row = trig_of(atom), slide_row(atom)
            if trig is not None:
                angle: Any = math.radians(trig.angle.degrees)
                for i, n in trig.angle.coordinates:
                    angle = angle + float(n) * column[i]
                for name, n in trig.angle.names:
                    angle = angle + float(n) * letters[name].value
                result[atom] = np.cos(angle) if trig.function == "cos" else np.sin(angle)
            elif row is not None:
                result[atom] = column[row] / self._metre
            elif atom in letters:
                result[atom] = letters[atom].value
        return result

    def pose(self, source: str, target: str) -> Array:
        """Return the oracle's pose of a frame in another, lengths in the file's unit, shape (samples, 4, 4)."""
        T_source, T_target = self._in_base(source), self._in_base(target)
        R = T_source[:, :3, :3].transpose(0, 2, 1)
        pose = np.zeros_like(T_target)
        pose[:, :3, :3] = R @ T_target[:, :3, :3]
        pose[:, :3, 3] = np.einsum("nij,nj->ni", R, T_target[:, :3, 3] - T_source[:, :3, 3]) / self._metre
        pose[:, 3, 3] = 1.0
        return pose

    def jacobian(self, source: str, target: str) -> Array:
        """Return the Jacobian of a frame, in the axes of another one, from the oracle's frames.

        Columns are z x (p - o) and z, of each joint's axis z through o; the target is taken as a frame of the last
        body. Lengths are in the file's unit.

        Returns:
            Shape (samples, 6, n).
        """
        R = self._in_base(source)[:, :3, :3].transpose(0, 2, 1)
        point = self._in_base(target)[:, :3, 3]
        result = np.zeros((len(self.q), 6, len(self.table.moving)))
        for k, i in enumerate(self.table.moving):
            row, frame = self.table.spec.rows[i - 1], self._in_base(f"link_{i}")
            z = (-1.0 if row.flip else 1.0) * frame[:, :3, 2]
            if row.type.turns:
                moment = np.cross(z, point - frame[:, :3, 3]) / self._metre
                result[:, :3, k] = np.einsum("nij,nj->ni", R, moment)
                result[:, 3:, k] = np.einsum("nij,nj->ni", R, z)
            else:
                result[:, :3, k] = np.einsum("nij,nj->ni", R, z)
        return result

    def body_jacobian(self, frame: str, com: Array) -> tuple[Array, Array]:
        """Return the Jacobian in base_link of a point that a frame carries, and the frame's rotation.

        Args:
            frame: The frame.
            com: The point in it, in the file's unit, shape (3,).

        Returns:
            Shapes (samples, 6, n) and (samples, 3, 3).
        """
        J = self.jacobian("base_link", frame)
        carried = [self.table.frames[f"link_{i}"] <= self.table.frames[frame] for i in self.table.moving]
        J = J * np.array(carried, dtype=np.float64)
        R = self._in_base(frame)[:, :3, :3]
        arm = np.einsum("nij,j->ni", R, com)
        J[:, :3] += np.cross(J[:, 3:], arm[:, :, None], axis=1)
        return J, R

    def _in_base(self, frame: str) -> Array:
        if frame not in self._known:
            self._known[frame] = self._pose_in_base(frame)
        return self._known[frame]

    def _pose_in_base(self, frame: str) -> Array:
        spec = self.table.spec
        if frame == "base_link":
            return np.broadcast_to(np.eye(4), (len(self.q), 4, 4))
        if frame == "tool0":
            return table_tool_pose(spec, self.q)
        poses = self._frames
        kind, _, number = frame.rpartition("_")
        i = int(number)
        if kind == "dh":
            return poses[:, i]
        return self._joint_frame(poses, i)

    def _joint_frame(self, poses: Array, i: int) -> Array:
        """Return the frame of link i: DH frame i, or where row i's joint part leads to."""
        from dataclasses import replace

        row = self.table.spec.rows[i - 1]
        if row.convention is Convention.MODIFIED:
            return poses[:, i]
        joint = replace(row, a=0.0, alpha=0.0, beta=0.0)
        moving = self.table.moving
        q = self.q[:, moving.index(i)] if i in moving else np.zeros(len(self.q))
        return poses[:, i - 1] @ row_matrix(joint, q).transpose(2, 0, 1)


def check_form(
    form: Form,
    expected: Mapping[str, Array],
    configurations: SampledConfigurations,
    extra: Mapping[Atom, Any] | None = None,
    scales: Mapping[str, Array | float] | None = None,
) -> float:
    """Compare the equations of a form with numbers.

    Args:
        form: What is to be shown.
        expected: For names of equations, arrays of shape (samples, rows, columns).
        configurations: Where they hold.
        extra: Values of atoms that are no part of the table.
        scales: For names of equations, the sizes that differences are measured by, of the shape of the equation or of
            one that broadcasts to it; by default the reach for poses, 1 for their rotations.

    Returns:
        The largest difference as a share of those sizes.

    Raises:
        MismatchError: A difference is larger than 1e-13.
    """
    values = configurations.values(form.atoms) | dict(extra or {})
    worst = 0.0
    for equation in form.equations:
        wanted = expected[equation.name]
        rows, columns = len(equation.entries), len(equation.entries[0])
        found = np.empty(wanted.shape)
        for k, value in enumerate(evaluated(equation.flat, form.named, values)):
            found[:, k // columns, k % columns] = value
        assert wanted.shape[1:] == (rows, columns)
        scale = (scales or {}).get(equation.name, configurations.pose_scale)
        error = float((np.abs(found - wanted).max(axis=0) / scale).max())
        if not error <= TOLERANCE:
            raise MismatchError(
                f"{form.table.spec.name}: {equation.name} in symbols differs from the table by {error:.2g} of its "
                "size; nothing is printed"
            )
        worst = max(worst, error)
    return worst
