"""Protocols of the engines: poses of frames, Jacobians and dynamics read from a model file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from dh2sim.errors import EngineError
from dh2sim.typing import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DynamicTerms:
    """Terms of M(q) q̈ + b(q, q̇) = τ for N states of n joints, without friction, damping and rotor inertia."""

    mass_matrix: Array
    """M, shape (N, n, n)."""
    bias: Array
    """b(q, q̇): Coriolis, centrifugal and gravity terms, shape (N, n)."""
    gravity: Array
    """b(q, 0), shape (N, n)."""


class PoseEngine(Protocol):
    """Reads a model file and computes the poses of its frames."""

    name: str
    """Such as ``mujoco-mjcf``."""
    frames: tuple[str, ...]
    """The requested frames that the file has."""

    def frame_poses(self, q: Array) -> Array:
        """Return the poses of ``frames`` in base_link, shape (N, frames, 4, 4); q in rad and m, shape (N, n)."""
        ...


class DynamicsEngine(PoseEngine, Protocol):
    """Computes velocities and dynamics, too."""

    inertia_rounding: float
    """How far it may round the inertias that it reads, as a share of the joint's own."""

    def jacobian(self, q: Array) -> Array:
        """Return the Jacobian of tool0 in base_link, linear rows first, shape (N, 6, n); q of shape (N, n)."""
        ...

    def dynamic_terms(self, q: Array, velocity: Array, gravity: Array) -> DynamicTerms:
        """Return the dynamic terms; q and velocity of shape (N, n), gravity in m/s² in base_link, shape (3,)."""
        ...


def present_frames(
    path: str, found: Sequence[str], rows: int | Sequence[str], *, dh_frames_required: bool
) -> tuple[str, ...]:
    """Return those of dh_0 … dh_n and tool0 that a file has, or the frames of a mechanism.

    Args:
        path: Of the file, for the message.
        found: Names of all frames in the file.
        rows: Number of rows of the table; or the names of a mechanism's frames, all of which must be there.
        dh_frames_required: Whether a file may leave out all DH frames (never only some of them).

    Raises:
        EngineError: tool0 or a DH frame is missing.
    """
    known = set(found)
    if isinstance(rows, int):
        dh = [f"dh_{i}" for i in range(rows + 1)]
        some = dh_frames_required or any(name in known for name in dh)
        wanted = [*dh, "tool0"] if some else ["tool0"]
    else:
        wanted = list(rows)
    missing = [name for name in wanted if name not in known]
    if missing:
        raise EngineError(f"{path}: frame not found: {', '.join(missing)}")
    return tuple(wanted)


def require_joints(path: str, found: Sequence[str], wanted: Sequence[str]) -> None:
    """Check that a file's moving joints are those of the robot, in any order.

    Raises:
        EngineError: A joint is missing, or another one moves.
    """
    missing = [name for name in wanted if name not in set(found)]
    extra = [name for name in found if name not in set(wanted)]
    if missing:
        raise EngineError(f"{path}: moving joint not found: {', '.join(missing)}")
    if extra:
        raise EngineError(f"{path}: the joint {', '.join(extra)} moves, but the robot file has no such moving row")
