"""MuJoCo's process-wide state during a run: no step timer, and no log file of warnings."""

from __future__ import annotations

import ctypes
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError
from numpy.typing import NDArray

VELOCITY_STAGE = int(mujoco.mjtStage.mjSTAGE_VEL)
"""MuJoCo has computed all that follows from positions and velocities."""

_lock = threading.Lock()
_users = 0
_saved: tuple[int | None, Callable[[str], None] | None] = (None, None)


@contextmanager
def quiet_engine() -> Iterator[None]:
    """Switch off MuJoCo's step timer and its log of warnings while the context lasts.

    Importing ``mujoco`` installs a timer, called several times in every step, that takes some 30 % of the time of a
    small arm's step. It is switched off for the whole process; ``mjData.timer`` does not advance meanwhile. Warnings
    would be printed and appended to a file in the current folder; a rollout reads the counters instead.
    """
    global _users, _saved
    timer = _timer()
    with _lock:
        if _users == 0:
            _saved = (None if timer is None else timer.value, mujoco.get_mju_user_warning())
            if timer is not None:
                timer.value = None
            mujoco.set_mju_user_warning(_ignore)
        _users += 1
    try:
        yield
    finally:
        with _lock:
            _users -= 1
            if _users == 0:
                if timer is not None:
                    timer.value = _saved[0]
                mujoco.set_mju_user_warning(_saved[1])


def forward(batch: Batch, ids: NDArray[np.intp] | None = None) -> None:
    """Compute what MuJoCo derives from positions and velocities; simulations that fail keep their old values."""
    with suppress(SimulationError):
        batch.forward(ids, stage=VELOCITY_STAGE)


def _ignore(_text: str) -> None:
    pass


def _timer() -> ctypes.c_void_p | None:
    """Return the pointer to the timer that MuJoCo's C library calls, or None where it cannot be reached.

    ``mujoco.set_mjcb_time(None)`` leaves it as it is.
    """
    patterns = {"win32": "mujoco*.dll", "darwin": "libmujoco*.dylib"}
    folder = Path(mujoco.__file__).parent
    for path in sorted(folder.glob(patterns.get(sys.platform, "libmujoco.so*"))):
        try:
            return ctypes.c_void_p.in_dll(ctypes.CDLL(str(path)), "mjcb_time")
        except (OSError, ValueError):
            continue
    return None
