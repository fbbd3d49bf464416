"""MuJoCo's process-wide state during a run: no step timer, and no log file of warnings."""

from __future__ import annotations

import ctypes
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import mujoco
import numpy as np
from mujoco.batch import MODEL_FIELDS, Batch, SimulationError
from numpy.typing import NDArray

from dh2sim.mujoco_warnings import mujoco_warnings

if TYPE_CHECKING:
    from dh2sim.simulate.plant import Plant

POSITION_STAGE = int(mujoco.mjtStage.mjSTAGE_POS)
"""MuJoCo has computed all that follows from positions, contacts among them."""
VELOCITY_STAGE = int(mujoco.mjtStage.mjSTAGE_VEL)
"""MuJoCo has computed all that follows from positions and velocities."""

_lock = threading.Lock()
_users = 0
_saved: int | None = None


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
            _saved = None if timer is None else timer.value
            if timer is not None:
                timer.value = None
        _users += 1
    try:
        with mujoco_warnings():
            yield
    finally:
        with _lock:
            _users -= 1
            if _users == 0 and timer is not None:
                timer.value = _saved


def forward(batch: Batch, ids: NDArray[np.intp] | None = None, *, stage: int = VELOCITY_STAGE) -> None:
    """Compute what MuJoCo derives from positions and velocities; simulations that fail keep their old values."""
    with suppress(SimulationError):
        batch.forward(ids, stage=stage)


def set_models(batch: Batch, plant: Plant, *, as_fields: bool = False) -> None:
    """Give the simulations of a batch the models of their designs, if they have such.

    Args:
        batch: The batch, made of ``plant.model``.
        plant: What its simulations are of.
        as_fields: Whether every field in which the models differ becomes one of the batch's own, so that it can be
            changed afterwards; slower, with the same bits.
    """
    if not plant.each:
        return
    if not as_fields:
        batch.set_models(list(plant.models))
        return
    first = plant.model
    distinct = {id(model): model for model in plant.models}
    for name in sorted(MODEL_FIELDS):
        own = _field(first, name)
        if own is None or all(np.array_equal(own, _field(model, name)) for model in distinct.values()):
            continue
        values = batch.expand(name)
        for i, model in enumerate(plant.models):  # of bvh_aabb a batch holds the beginning
            values[i] = np.ravel(_field(model, name))[: values[i].size].reshape(values[i].shape)


_PACKAGES: Final = ("mujoco-core", "mujoco")
"""Since 4.0 the second only names the first; of two versions that were both installed, the last one is there."""


def mujoco_package() -> str:
    """Return the package that MuJoCo was installed from; empty if it was from none of that version."""
    for name in _PACKAGES:
        with suppress(PackageNotFoundError):
            if version(name) == mujoco.__version__:
                return name
    return ""


def _field(model: mujoco.MjModel, name: str) -> Any:
    owner, _, rest = name.partition(".")
    return getattr(model.opt, rest, None) if rest else getattr(model, owner, None)


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
