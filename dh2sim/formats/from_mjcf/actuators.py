"""What drives the joints of an MJCF's arm: servos and motors that a robot file knows, and limits of force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from dh2sim.formats.from_mjcf.chain import Selection
from dh2sim.formats.from_mjcf.compile import Compiled
from dh2sim.formats.from_mjcf.tree import MjcfJoint
from dh2sim.formats.notes import Notes
from dh2sim.formats.serial_robot import GREATEST
from dh2sim.robot.spec import ActuatorSpec, ActuatorType
from dh2sim.robot.words import shown

if TYPE_CHECKING:
    import mujoco

_ODD: Final = "Actuators that a robot file has no place for are left out: {}."


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drive:
    """What drives a joint, and what that adds to the joint."""

    actuator: ActuatorSpec
    effort: float | None = None
    """N·m or N."""
    damping: float = 0.0
    """Of the actuators, seen at the joint, N·m·s/rad or N·s/m."""
    armature: float = 0.0
    """Likewise, kg·m² or kg."""
    nonlinear: bool = False
    """Whether an actuator's damping has a nonlinear part."""


def read_drives(compiled: Compiled, selection: Selection, names: Sequence[str], notes: Notes) -> tuple[Drive, ...]:
    """Return what drives each joint between base and tip.

    A position or velocity servo or a motor that acts on a joint alone, with gear 1 and without dynamics, is carried
    over; other actuators are noted.
    """
    import mujoco

    model = compiled.model
    direct = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    drivers: dict[int, list[int]] = {joint.id: [] for joint in selection.joints}
    for i in range(model.nactuator):
        joint = int(model.actuator_trnid[i, 0]) if int(model.actuator_trntype[i]) in direct else -1
        if joint in drivers:
            drivers[joint].append(i)
        else:
            notes.group("Actuators that act on no joint of the arm are left out: {}.", _name(model, i))
    return tuple(
        _drive(compiled, joint, name, drivers[joint.id], notes)
        for joint, name in zip(selection.joints, names, strict=True)
    )


def _drive(compiled: Compiled, joint: MjcfJoint, name: str, drivers: list[int], notes: Notes) -> Drive:
    model = compiled.model
    actuator = ActuatorSpec(type=ActuatorType.NONE)
    if len(drivers) == 1:
        actuator = _read(compiled, drivers[0], notes)
    for i in drivers if len(drivers) > 1 else ():
        notes.group(_ODD, _name(model, i), f"one of {len(drivers)} on joint {shown(name)}")
    gears = [float(model.actuator_gear[i, 0]) for i in drivers]
    squares = [(i, gear * gear) for i, gear in zip(drivers, gears, strict=True)]
    if actuator.type in (ActuatorType.POSITION, ActuatorType.VELOCITY):
        _note_control(model, drivers[0], joint, notes)
    return Drive(
        actuator=actuator,
        effort=_effort(model, joint, name, drivers, notes),
        damping=sum(float(model.actuator_damping[i]) * square for i, square in squares),
        armature=sum(float(model.actuator_armature[i]) * square for i, square in squares),
        nonlinear=any(np.any(model.actuator_dampingpoly[i]) for i in drivers),
    )


def _read(compiled: Compiled, i: int, notes: Notes) -> ActuatorSpec:
    """Return an actuator that is the only one of its joint."""
    model = compiled.model
    gain, bias = model.actuator_gainprm[i].tolist(), model.actuator_biasprm[i].tolist()
    reason = _oddity(model, i)
    if reason is None:
        if _is_motor(model, i):
            if gain[0] == 1.0:
                return ActuatorSpec(type=ActuatorType.MOTOR)
            reason = f"gain {gain[0]:g}"
        elif 0.0 < gain[0] <= GREATEST and bias[0] == 0.0 and -GREATEST <= bias[2] <= 0.0 and not any(bias[3:]):
            damping = -bias[2] + 0.0
            if bias[1] == -gain[0]:
                kv = None if i in compiled.unknown_kv else damping
                if kv is None:
                    notes.group(
                        "A damping ratio is left out, as masses are not known, of actuators {}.", _name(model, i)
                    )
                return ActuatorSpec(type=ActuatorType.POSITION, kp=gain[0], kv=kv)
            if bias[1] == 0.0 and damping == gain[0]:
                return ActuatorSpec(type=ActuatorType.VELOCITY, kv=damping)
    notes.group(_ODD, _name(model, i), reason or "neither a motor nor a position or velocity servo")
    return ActuatorSpec(type=ActuatorType.NONE)


def _oddity(model: mujoco.MjModel, i: int) -> str | None:
    """Return what about an actuator a robot file cannot say, or None."""
    import mujoco

    gear = model.actuator_gear[i].tolist()
    affine = int(mujoco.mjtBias.mjBIAS_AFFINE)
    if gear[0] != 1.0:
        return f"gear {gear[0]:g}"
    if int(model.actuator_dyntype[i]) != int(mujoco.mjtDyn.mjDYN_NONE):
        return "with dynamics of its own"
    if model.actuator_ctrlnum[i] != 1 or model.actuator_outnum[i] != 1:
        return "of several controls"
    if model.actuator_delay[i] > 0.0:
        return "with a delay"
    if int(model.actuator_gaintype[i]) != int(mujoco.mjtGain.mjGAIN_FIXED) or model.actuator_biastype[i] > affine:
        return "neither a motor nor a position or velocity servo"
    return None


def _is_motor(model: mujoco.MjModel, i: int) -> bool:
    import mujoco

    fixed = int(model.actuator_gaintype[i]) == int(mujoco.mjtGain.mjGAIN_FIXED)
    return fixed and int(model.actuator_biastype[i]) == int(mujoco.mjtBias.mjBIAS_NONE)


def _effort(model: mujoco.MjModel, joint: MjcfJoint, name: str, drivers: list[int], notes: Notes) -> float | None:
    """Return the greatest force at a joint: the least of what limits it, where the file limits it."""
    ranges = [model.jnt_actfrcrange[joint.id].tolist()] if model.jnt_actfrclimited[joint.id] else []
    if len(drivers) == 1:
        i = drivers[0]
        gear = float(model.actuator_gear[i, 0])
        if model.actuator_forcelimited[i]:
            ranges.append([gear * value for value in model.actuator_forcerange[i].tolist()])
        control = int(model.actuator_ctrladr[i])
        if (
            _is_motor(model, i)
            and _oddity(model, i) in (None, f"gear {gear:g}")
            and model.actuator_ctrllimited[control]
        ):
            factor = gear * float(model.actuator_gainprm[i, 0])
            ranges.append([factor * value for value in model.actuator_ctrlrange[control].tolist()])
    efforts = []
    for lower, upper in map(sorted, ranges):
        efforts.append(min(-lower, upper))
        if -lower != upper:
            notes.group(
                "Limits of force that differ in the two directions: the smaller one is used, for joints {}.",
                name,
                f"{lower:g}, {upper:g}",
            )
    effort = min(efforts, default=None)
    if effort is None or 0.0 < effort <= GREATEST:
        return effort
    notes.group("Limits of force that cannot be used are left out, of joints {}.", name, f"{effort:g}")
    return None


def _note_control(model: mujoco.MjModel, i: int, joint: MjcfJoint, notes: Notes) -> None:
    control = int(model.actuator_ctrladr[i])
    limited = bool(model.actuator_ctrllimited[control])
    limits = model.jnt_range[joint.id].tolist() if model.jnt_limited[joint.id] else None
    if limited and model.actuator_ctrlrange[control].tolist() != limits:
        lower, upper = model.actuator_ctrlrange[control].tolist()
        notes.group(
            "Ranges of controls other than the joint's own are not carried over, of actuators {}.",
            _name(model, i),
            f"{lower:g}, {upper:g}",
        )


def _name(model: mujoco.MjModel, i: int) -> str:
    return model.actuator(i).name or f"actuator {i + 1}"
