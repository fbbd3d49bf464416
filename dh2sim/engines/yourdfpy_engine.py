"""yourdfpy on a URDF file."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from dh2sim.errors import EngineCapacityError, EngineError
from dh2sim.limited_process import WorkerError, ask_worker, start_worker
from dh2sim.typing import Array

TIME_LIMIT: Final = 60
"""Seconds of processor time for all poses of a file."""
_WORKER: Final = "dh2sim.engines.yourdfpy_worker"


def start_yourdfpy() -> None:
    """Let yourdfpy be imported beside what this process does, where it is installed."""
    if importlib.util.find_spec("yourdfpy") is not None:
        start_worker(_WORKER)


class YourdfpyEngine:
    """One URDF file, read by yourdfpy in another process; a Python loop, so it is used for fewer configurations."""

    name = "yourdfpy"

    def __init__(self, path: Path, joints: Sequence[str], rows: int | Sequence[str]) -> None:
        """Read a file.

        Args:
            path: A .urdf file.
            joints: Names of the moving joints, in the order of a joint vector.
            rows: Number of rows of the table, or the names of a mechanism's frames.

        Raises:
            EngineError: yourdfpy refuses the file, or frames or joints are missing.
            ImportError: yourdfpy is not installed.
        """
        if importlib.util.find_spec("yourdfpy") is None:
            import yourdfpy  # noqa: F401  raises what says why
        self._path = path
        file = {"name": str(path), "path": str(path.absolute())}
        self._request = {**file, "joints": list(joints), "rows": rows if isinstance(rows, int) else list(rows)}
        self.frames, _ = self._ask(np.empty((0, len(joints))))

    def frame_poses(self, q: Array) -> Array:
        """Return the poses of ``frames`` in base_link; see ``PoseEngine``.

        Raises:
            EngineCapacityError: Something is displaced so little that yourdfpy does not notice, or it takes too long.
        """
        _, poses = self._ask(q)
        return np.frombuffer(poses).reshape(len(q), len(self.frames), 4, 4)

    def _ask(self, q: Array) -> tuple[tuple[str, ...], bytes]:
        """Return the frames of the file, and the bytes of their poses."""
        request = json.dumps({**self._request, "samples": len(q)}).encode() + b"\n" + q.tobytes()
        try:
            answer = ask_worker(_WORKER, request, seconds=TIME_LIMIT)
        except WorkerError as error:
            raise EngineCapacityError(f"yourdfpy was stopped: {error}") from None
        head, _, poses = answer.partition(b"\n")
        match json.loads(head):
            case {"absent": reason}:
                raise ImportError(reason)
            case {"incapable": reason}:
                raise EngineCapacityError(reason)
            case {"refused": reason}:
                raise EngineError(reason)
            case {"frames": [*frames]}:
                return tuple(frames), poses
        raise EngineError(f"{self._path}: yourdfpy gives no frames")
