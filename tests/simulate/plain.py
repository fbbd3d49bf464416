"""The oracle of rollouts: a plain loop over ``mujoco.mj_step``, with an MjData for each of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from dh2sim.typing import Array

Control = Callable[[mujoco.MjModel, mujoco.MjData, int, int], Array]
"""Gives the controls of a rollout (third) at a time step (fourth), by what it sees; shape (actuators,)."""

FIELDS = {
    "mass": ("body_mass", "body_inertia"),
    "friction": ("dof_frictionloss",),
    "damping": ("dof_damping",),
    "armature": ("dof_armature",),
    "gain": ("actuator_gainprm", "actuator_biasprm"),
}
REASONS = {
    mujoco.mjtWarning.mjWARN_INERTIA: 1,
    mujoco.mjtWarning.mjWARN_BADQPOS: 4,
    mujoco.mjtWarning.mjWARN_BADQVEL: 5,
    mujoco.mjtWarning.mjWARN_BADQACC: 6,
    mujoco.mjtWarning.mjWARN_BADCTRL: 7,
}
"""Value of ``status`` by MuJoCo's warning."""
AT_INSTANTS = ("qpos", "qvel", "base_pose", "base_twist", "tool_pose", "energy")


@dataclass(frozen=True, kw_only=True)
class Track:
    """What one rollout went through, at every time step."""

    qpos: Array
    qvel: Array
    tool_pose: Array
    energy: Array
    ctrl: Array
    qacc: Array
    torque: Array
    contacts: NDArray[Any]
    touching: NDArray[Any]
    """Bodies that touch with the least distance, or -1, at the beginning of every step."""
    saturation: NDArray[Any]
    status: int
    stop_step: int


def scaled(mjcf: str, factors: Mapping[str, Array]) -> mujoco.MjModel:
    """The model of one rollout: compiled, its fields multiplied, and what follows from them computed anew."""
    model = mujoco.MjModel.from_xml_string(mjcf)
    heavy = np.flatnonzero(model.body_mass > 0.0)
    free = 6 if model.njnt and model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE else 0
    for name, values in factors.items():
        for field in FIELDS[name]:
            own = getattr(model, field)
            for i, factor in enumerate(values):
                row = heavy[i] if name == "mass" else free + i if field.startswith("dof") else i
                own[row] *= factor
    if factors:
        mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


@contextmanager
def _silent() -> Iterator[None]:
    """Without the file of warnings that MuJoCo appends to."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def track(model: mujoco.MjModel, qpos: Array, qvel: Array, control: Control, steps: int, rollout: int = 0) -> Track:
    """Simulate one rollout by a plain loop."""
    data, seen = mujoco.MjData(model), mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = qpos, qvel
    limited = model.actuator_ctrllimited.astype(bool)
    lower = np.where(limited, model.actuator_ctrlrange[:, 0], -np.inf)
    upper = np.where(limited, model.actuator_ctrlrange[:, 1], np.inf)
    kept: dict[str, list[Any]] = {
        name: [] for name in (*Track.__annotations__,) if name not in ("status", "stop_step")
    }
    kept["saturation"] = [np.zeros(model.nu, dtype=np.int64)]
    status, stop_step = 0, -1

    def look() -> None:
        seen.qpos[:], seen.qvel[:], seen.ctrl[:] = data.qpos, data.qvel, data.ctrl
        mujoco.mj_forward(model, seen)

    def state() -> None:
        kept["qpos"].append(data.qpos.copy())
        kept["qvel"].append(data.qvel.copy())

    def derived() -> None:
        look()
        tool = (seen.sensor("tool0_pos").data, seen.sensor("tool0_quat").data)
        kept["tool_pose"].append(np.concatenate(tool))
        kept["energy"].append(seen.energy.copy())

    state()
    for step in range(steps):
        wanted = control(model, data, rollout, step)
        data.ctrl[:] = np.clip(wanted, lower, upper)
        derived()
        kept["ctrl"].append(data.ctrl.copy())
        kept["torque"].append(seen.qfrc_actuator[model.nv - _joints(model) :].copy())
        kept["contacts"].append(seen.ncon)
        kept["touching"].append(_deepest(model, seen))
        mujoco.mj_step(model, data)
        kept["qacc"].append(data.qacc.copy())
        state()
        status = _reason(data)
        if status:
            stop_step = step
            break
        kept["saturation"][0] += (wanted < lower) | (wanted > upper)
    else:
        derived()
        mujoco.mj_checkPos(model, data)
        mujoco.mj_checkVel(model, data)
        status = _reason(data)
        stop_step = steps if status else -1
    arrays = {name: np.array(values) for name, values in kept.items()}
    arrays["saturation"] = kept["saturation"][0]
    return Track(**arrays, status=status, stop_step=stop_step)


def _deepest(model: mujoco.MjModel, data: mujoco.MjData) -> list[int]:
    contacts = [data.contact[i] for i in range(data.ncon)]
    if not contacts:
        return [-1, -1]
    geoms = min(contacts, key=lambda contact: contact.dist).geom
    return sorted(int(model.geom(int(geom)).bodyid[0]) for geom in geoms)


def _reason(data: mujoco.MjData) -> int:
    return next((reason for kind, reason in REASONS.items() if data.warning[kind].number), 0)


def _joints(model: mujoco.MjModel) -> int:
    return sum(model.jnt_type[i] != mujoco.mjtJoint.mjJNT_FREE for i in range(model.njnt))


def expected(run: xr.Dataset, control: Control, *, rollouts: Sequence[int] | None = None) -> dict[str, NDArray[Any]]:
    """What the variables of a run must be, by the plain loop from where its rollouts start."""
    settings, n = run.attrs["settings"], run.sizes["joint"]
    every, steps = settings["every"], settings["steps"]
    which = range(run.sizes["rollout"]) if rollouts is None else rollouts
    tracks = []
    for i in which:
        factors = {name: run[f"{name}_scale"].values[i] for name in run.attrs["randomize"]}
        model = scaled(run.attrs["mjcf"], factors)
        base_q, base_v = np.zeros(0), np.zeros(0)
        if model.nq > n:
            base_q, base_v = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]), np.zeros(6)
        q = np.concatenate([base_q, run.qpos.values[i, 0]])
        v = np.concatenate([base_v, run.qvel.values[i, 0]])
        with _silent():
            tracks.append(track(model, q, v, control, steps, i))
    return {
        str(name): np.stack([_recorded(str(name), one, n, every, steps) for one in tracks])
        for name in run.data_vars
        if not str(name).endswith(("_scale", "_ref"))
    }


def _recorded(name: str, one: Track, n: int, every: int, steps: int) -> Any:
    """The part of a track that is recorded, blank after an early stop."""
    match name:
        case "status" | "stop_step" | "saturation":
            return getattr(one, name)
        case "contact_step" | "contact_link_a" | "contact_link_b":
            seen = one.touching if one.stop_step < 0 else one.touching[: one.stop_step]
            first = next((k for k, links in enumerate(seen.tolist()) if links[0] >= 0), None)
            if first is None:
                return -1
            return {"step": first, "link_a": seen[first, 0], "link_b": seen[first, 1]}[name.removeprefix("contact_")]
        case "base_pose":
            values = one.qpos[:, :-n]
        case "base_twist":
            values = one.qvel[:, :-n]
        case "qpos" | "qvel" | "qacc":
            values = getattr(one, name)[:, -n:]
        case _:
            values = getattr(one, name)
    blank = -1 if name == "contacts" else np.nan
    count = steps + 1 if name in AT_INSTANTS else steps
    # the state that the failed step began with is the last one that there is
    last = one.stop_step + (name in ("qpos", "qvel", "base_pose", "base_twist")) if one.stop_step >= 0 else count
    whole = np.full((count, *values.shape[1:]), blank, dtype=values.dtype)
    whole[:last] = values[:last]
    return whole[::every]


def assert_equal(run: xr.Dataset, wanted: Mapping[str, NDArray[Any]], rollouts: Any = slice(None)) -> None:
    """Compare bit for bit."""
    for name, values in wanted.items():
        found = run[name].values[rollouts]
        narrow = name in ("status", "contacts", "contact_link_a", "contact_link_b")
        assert found.dtype == values.dtype or narrow, name
        np.testing.assert_array_equal(found, values, err_msg=name, strict=not narrow)


def replayed(run: xr.Dataset) -> Control:
    """The controls that a run recorded at every time step."""
    controls = run.ctrl.values
    return lambda _model, _data, rollout, step: controls[rollout, step]


def wave(model: mujoco.MjModel, _data: mujoco.MjData, rollout: int, step: int) -> Array:
    """Controls of ``drivers.Wave``."""
    return np.array([1.1 * math.sin(0.05 * step + rollout + i) for i in range(model.nu)])


def spring(model: mujoco.MjModel, data: mujoco.MjData, _rollout: int, _step: int) -> Array:
    """Controls of ``drivers.Spring``; what balances gravity is known of another MjData at rest."""
    n = _joints(model)
    q, v = data.qpos[model.nq - n :], data.qvel[model.nv - n :]
    wanted: Array = 30.0 * (0.1 - q) - 3.0 * v
    if model.nv == n:
        still = mujoco.MjData(model)
        still.qpos[:] = data.qpos
        mujoco.mj_forward(model, still)
        wanted = wanted + 0.5 * still.qfrc_bias
    driven: Array = wanted[model.actuator_trnid[:, 0] - (model.njnt - n)]
    return driven
