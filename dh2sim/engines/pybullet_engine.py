"""PyBullet on a URDF file; an optional engine."""

from __future__ import annotations

import ctypes
import os
import sys
import weakref
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import numpy as np

from dh2sim.engines.engine import DynamicTerms, present_frames, require_joints
from dh2sim.errors import EngineCapacityError, EngineError
from dh2sim.kinematics.transforms import invert
from dh2sim.typing import Array

MAX_LINKS = 120
"""Beside the base. PyBullet has room for 127 links, but its poses are wrong from 123 moving ones."""


class PybulletEngine:
    """One URDF file in a simulation of its own, its base fixed."""

    name = "pybullet"
    inertia_rounding = 1e-5
    """It turns a tensor until what is left beside the diagonal is below 1e-6 of its trace, and drops that."""

    def __init__(self, path: Path, joints: Sequence[str], rows: int | Sequence[str]) -> None:
        """Read a file.

        Args:
            path: A .urdf file.
            joints: Names of the moving joints, in the order of a joint vector.
            rows: Number of rows of the table, or the names of a mechanism's frames.

        Raises:
            ImportError: PyBullet is not installed.
            EngineCapacityError: The file has more links than PyBullet can hold.
            EngineError: PyBullet refuses the file, or frames or joints are missing.
        """
        with _printed():  # on import it prints when it was built
            import pybullet
        self._bullet: Any = pybullet
        self._path = path
        self._require_capacity()
        self._client = int(pybullet.connect(pybullet.DIRECT))
        weakref.finalize(self, _disconnect, pybullet, self._client)
        flags = (
            pybullet.URDF_USE_INERTIA_FROM_FILE
            | pybullet.URDF_IGNORE_VISUAL_SHAPES
            | pybullet.URDF_IGNORE_COLLISION_SHAPES
        )
        with _printed() as printed:
            try:
                self._body = pybullet.loadURDF(
                    str(path.absolute()), useFixedBase=True, flags=flags, physicsClientId=self._client
                )
            except (pybullet.error, SystemError):
                self._body = -1
        if self._body < 0:
            raise EngineError(f"{path}: PyBullet refuses the file: {printed()}")
        info = [
            pybullet.getJointInfo(self._body, index, physicsClientId=self._client)
            for index in range(pybullet.getNumJoints(self._body, physicsClientId=self._client))
        ]
        moving = {entry[1].decode(): entry[0] for entry in info if entry[2] != pybullet.JOINT_FIXED}
        links = {entry[12].decode(): entry[0] for entry in info}  # a link's index is that of the joint that moves it
        require_joints(str(path), list(moving), joints)
        self._joints = [moving[name] for name in joints]
        self._dofs = np.array([list(moving).index(name) for name in joints], dtype=int)
        self.frames = present_frames(str(path), list(links), rows, dh_frames_required=False)
        self._links = [links[name] for name in self.frames]
        self._no_dynamics = self._refusal()
        self._T_com_link = [invert(self._pose(*self._center_of_mass(link))) for link in self._links]

    def _require_capacity(self) -> None:
        try:
            count = sum(1 for element in ET.parse(self._path).getroot() if element.tag == "link")
        except (ET.ParseError, OSError) as error:
            raise EngineError(f"{self._path}: PyBullet refuses the file: no well-formed XML: {error}") from error
        if count - 1 > MAX_LINKS:
            raise EngineCapacityError(
                f"PyBullet holds at most {MAX_LINKS} links beside the base, and the file has {count - 1}"
            )

    def frame_poses(self, q: Array) -> Array:
        """Return the poses of ``frames`` in the world, which is base_link; see ``PoseEngine``.

        PyBullet gives poses of links in single precision, but those of their centres of mass in double.
        """
        bullet, client = self._bullet, self._client
        poses = np.empty((len(q), len(self._links), 4, 4))
        for k, row in enumerate(q):
            for joint, value in zip(self._joints, row.tolist(), strict=True):
                bullet.resetJointState(self._body, joint, value, physicsClientId=client)
            states = bullet.getLinkStates(
                self._body, self._links, computeForwardKinematics=True, physicsClientId=client
            )
            for i, state in enumerate(states):
                poses[k, i] = self._pose(state[0], state[1]) @ self._T_com_link[i]
        return poses

    def jacobian(self, q: Array) -> Array:
        """Return the geometric Jacobian of tool0; see ``DynamicsEngine``."""
        result = np.empty((len(q), 6, len(self._dofs)))
        rest = [0.0] * len(self._dofs)
        tool = self._links[-1]
        origin = self._T_com_link[-1][:3, 3].tolist()
        for k in range(len(q)):
            parts = self._computed("calculateJacobian", tool, origin, self._ordered(q[k]), rest, rest)
            result[k] = np.concatenate(parts)[:, self._dofs]
        return result

    def dynamic_terms(self, q: Array, velocity: Array, gravity: Array) -> DynamicTerms:
        """Return mass matrix, bias and gravity terms; see ``DynamicsEngine``.

        Raises:
            EngineCapacityError: A link is too large for PyBullet's inverse dynamics.
        """
        self._bullet.setGravity(*map(float, gravity), physicsClientId=self._client)
        n = len(self._dofs)
        mass, bias, load = np.zeros((len(q), n, n)), np.zeros((len(q), n)), np.zeros((len(q), n))
        rest = [0.0] * n
        order = np.ix_(self._dofs, self._dofs)
        for k in range(len(q)):
            position, speed = self._ordered(q[k]), self._ordered(velocity[k])
            mass[k] = np.asarray(self._computed("calculateMassMatrix", position))[order]
            bias[k] = np.asarray(self._computed("calculateInverseDynamics", position, speed, rest))[self._dofs]
            load[k] = np.asarray(self._computed("calculateInverseDynamics", position, rest, rest))[self._dofs]
        return DynamicTerms(mass_matrix=mass, bias=bias, gravity=load)

    def _refusal(self) -> EngineError | EngineCapacityError | None:
        """Let PyBullet prepare its inverse dynamics; it says only once why it cannot."""
        if not self._joints:
            return None
        rest = [0.0] * len(self._joints)
        with _printed() as printed, suppress(self._bullet.error, SystemError):
            self._bullet.calculateInverseDynamics(self._body, rest, rest, rest, physicsClientId=self._client)
            return None
        if "invalid inertia" in printed():
            return EngineCapacityError(
                "no inverse dynamics of links so large or so thin in PyBullet: its own rounding makes inertias of "
                "them that it refuses"
            )
        return EngineError(f"{self._path}: PyBullet refuses inverse dynamics: {printed()}")

    def _computed(self, function: str, *arguments: object) -> Any:
        if self._no_dynamics is not None:
            raise self._no_dynamics
        return getattr(self._bullet, function)(self._body, *arguments, physicsClientId=self._client)

    def _ordered(self, row: Array) -> list[float]:
        """Return a joint vector in PyBullet's order."""
        values = np.empty(len(row))
        values[self._dofs] = row
        return values.tolist()

    def _center_of_mass(self, link: int) -> tuple[Sequence[float], Sequence[float]]:
        info = self._bullet.getDynamicsInfo(self._body, link, physicsClientId=self._client)
        return info[3], info[4]

    @staticmethod
    def _pose(position: Sequence[float], quaternion: Sequence[float]) -> Array:
        x, y, z, w = quaternion
        T = np.eye(4)
        T[:3, :3] = [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
        T[:3, 3] = position
        return T


def _disconnect(bullet: Any, client: int) -> None:
    if bullet.isConnected(client):
        bullet.disconnect(client)


@contextmanager
def _printed() -> Iterator[Callable[[], str]]:
    """Keep what C++ prints away from standard output, where our results are, and from standard error.

    Yields:
        A function that returns the text, once the context is left.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    words: list[str] = []
    with TemporaryFile() as file:
        saved = {stream: os.dup(stream) for stream in (1, 2) if _is_open(stream)}
        for stream in saved:
            os.dup2(file.fileno(), stream)
        try:
            yield lambda: " ".join(words)
        finally:
            if os.name == "posix":
                ctypes.CDLL(None).fflush(None)
            for stream, copy in saved.items():
                os.dup2(copy, stream)
                os.close(copy)
            file.seek(0)
            words += file.read().decode(errors="replace").split()


def _is_open(stream: int) -> bool:
    try:
        os.fstat(stream)
    except OSError:
        return False
    return True
