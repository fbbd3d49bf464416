"""Limits of a motion: position, velocity, acceleration and jerk of every joint, and the speed of the tool."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import SettingsError
from dh2sim.messages import did_you_mean, listed
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array, read_only

RISE: Final = 0.25
"""s: where no acceleration limit is given, a joint takes this long to its velocity limit."""
ONSET: Final = 0.1
"""s: where no jerk limit is given, a joint takes this long to its acceleration limit."""
INSIDE: Final = 1.0 - 1e-6
"""Share of the limits that is used: peaks are known to that."""
SMALLEST: Final = 1e-9
"""Limit that is taken, in SI units or %; 1e9 is the greatest."""
QUANTITIES: Final = ("velocity", "acceleration", "jerk")
GIVEN: Final = (*QUANTITIES, "tool_speed", "tool_turn")
"""What ``motion_limits`` takes."""
LimitValue: TypeAlias = float | str | Mapping[str, float | str] | ArrayLike
"""A limit of all joints, of each joint, or of some by name; a text such as '50%' is a share of the robot's own."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionLimits:
    """What a motion may not exceed."""

    joints: tuple[str, ...]
    """Names of the n joints."""
    turns: tuple[bool, ...]
    """Which of them turn."""
    lower: Array
    """rad or m, shape (n,); -inf where unlimited."""
    upper: Array
    velocity: Array
    """rad/s or m/s, shape (n,)."""
    acceleration: Array
    """rad/s² or m/s², shape (n,)."""
    jerk: Array
    """rad/s³ or m/s³, shape (n,)."""
    tool_speed: float = math.inf
    """Of the tool along straight lines and arcs, m/s."""
    tool_turn: float = math.inf
    """Of its orientation on them, rad/s."""
    assumed: tuple[str, ...] = ()
    """Which of velocity, acceleration and jerk neither the robot file nor the request gives, of some joint."""
    jerk_requested: bool = False
    """Whether the request names jerk."""

    @property
    def rates(self) -> Array:
        """Velocity, acceleration and jerk, shape (3, n)."""
        return np.stack([self.velocity, self.acceleration, self.jerk])


def robot_limits(model: RobotModel) -> MotionLimits:
    """Return a robot's own limits.

    Where its file gives no acceleration limit, a joint reaches its velocity limit in 0.25 s; where it gives no jerk
    limit, it reaches its acceleration limit in 0.1 s.
    """
    joints = model.moving_joints
    velocity = [joint.velocity for joint in joints]
    given = [joint.limits for joint in joints]
    acceleration = [own.acceleration or v / RISE for v, own in zip(velocity, given, strict=True)]
    jerk = [own.jerk or a / ONSET for a, own in zip(acceleration, given, strict=True)]
    open_ = {
        "velocity": any("velocity" in joint.assumed for joint in joints),
        "acceleration": any(own.acceleration is None for own in given),
        "jerk": any(own.jerk is None for own in given),
    }
    assumed = [name for name in QUANTITIES if open_[name]]
    ranges = [joint.position_range or (-math.inf, math.inf) for joint in joints]
    return MotionLimits(
        joints=tuple(joint.name for joint in joints),
        turns=tuple(joint.type.turns for joint in joints),
        lower=read_only([low for low, _ in ranges]),
        upper=read_only([high for _, high in ranges]),
        velocity=read_only(velocity),
        acceleration=read_only(acceleration),
        jerk=read_only(jerk),
        assumed=tuple(assumed),
    )


def requested_limits(own: MotionLimits, request: Mapping[str, LimitValue]) -> MotionLimits:
    """Return a robot's limits with those that are requested in their place.

    Args:
        own: The robot's own limits.
        request: By name: 'velocity', 'acceleration', 'jerk' of joints, rad and m and their rates; 'tool_speed', m/s,
            and 'tool_turn', rad/s. Those of joints are one number, n numbers, or numbers by the names of joints; a
            text such as '50%' is a share of the robot's own limit.

    Raises:
        SettingsError: Something in the request is wrong; the error holds everything that is.
    """
    problems: list[str] = []
    values = {name: np.array(getattr(own, name)) for name in QUANTITIES}
    given = {name: np.zeros(len(own.joints), dtype=np.bool_) for name in QUANTITIES}
    tool = {"tool_speed": own.tool_speed, "tool_turn": own.tool_turn}
    for name, value in request.items():
        if name not in GIVEN:
            problems.append(f"must not contain {name!r}.{did_you_mean(str(name), GIVEN)} Allowed: {listed(GIVEN)}")
        elif name in tool:
            speed = _number(value, math.inf)
            if isinstance(speed, str) or not math.isfinite(speed):
                problems.append(f"{name} {speed if isinstance(speed, str) else 'has no share: give a number'}")
            else:
                tool[name] = speed
        else:
            for joint, number in enumerate(_by_joint(name, value, own, problems)):
                if number is not None:
                    values[name][joint], given[name][joint] = number, True
    if "velocity" not in own.assumed:
        most = own.velocity
        problems += [
            f"velocity of {own.joints[joint]} must be at most the robot's own, {most[joint]:.6g}, "
            f"got {values['velocity'][joint]:.6g}"
            for joint in np.flatnonzero(values["velocity"] > most * (1.0 + 1e-9))
        ]
    if problems:
        raise SettingsError([("limits", problem) for problem in problems])
    # what is assumed follows from the velocity that is requested
    if "acceleration" in own.assumed:
        share = values["velocity"] / own.velocity
        values["acceleration"] = np.where(
            given["acceleration"], values["acceleration"], own.acceleration * np.minimum(share, 1.0)
        )
    if "jerk" in own.assumed:
        values["jerk"] = np.where(given["jerk"], values["jerk"], values["acceleration"] / ONSET)
    return MotionLimits(
        joints=own.joints,
        turns=own.turns,
        lower=own.lower,
        upper=own.upper,
        velocity=read_only(values["velocity"]),
        acceleration=read_only(values["acceleration"]),
        jerk=read_only(values["jerk"]),
        tool_speed=tool["tool_speed"],
        tool_turn=tool["tool_turn"],
        assumed=tuple(name for name in own.assumed if not given[name].all()),
        jerk_requested=bool(given["jerk"].any()),
    )


def _by_joint(name: str, value: object, own: MotionLimits, problems: list[str]) -> list[float | None]:
    """Return what a request gives for each joint; None for joints that it leaves out."""
    robots: Array = getattr(own, name)
    count = len(own.joints)
    if isinstance(value, Mapping):
        unknown = [joint for joint in value if joint not in own.joints]
        problems += [
            f"{name}: there is no joint {joint!r} that moves.{did_you_mean(str(joint), own.joints)}"
            for joint in unknown
        ]
        each: list[object] = [value.get(joint) for joint in own.joints]
    elif isinstance(value, str) or np.ndim(value) == 0:  # type: ignore[arg-type]
        each = [value] * count
    else:
        each = list(value) if isinstance(value, Sequence | np.ndarray) else [value]
        if len(each) != count:
            problems.append(f"{name} must be one number or {count}, got {len(each)}")
            return []
    found: list[float | None] = []
    wrong: dict[str, None] = {}
    for each_value, robots_own in zip(each, robots.tolist(), strict=True):
        read: float | str | None = None if each_value is None else _number(each_value, robots_own)
        if isinstance(read, str):
            wrong[f"{name} {read}"] = None
        found.append(None if isinstance(read, str) else read)
    problems += wrong
    return found


def _number(value: object, own: float) -> float | str:
    """Return a limit, or what is wrong with it."""
    share = isinstance(value, str) and value.strip().endswith("%")
    try:
        number = float(str(value).strip().removesuffix("%") if share else value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return f"must be a number, or a share such as '50%', got {value!r}"
    if isinstance(value, bool) or not (math.isfinite(number) and number > 0.0):
        return f"must be a finite number above 0, got {value!r}"
    if not SMALLEST <= number <= 1.0 / SMALLEST:
        return f"must be from {SMALLEST:g} to {1.0 / SMALLEST:g}, got {value!r}"
    return number / 100.0 * own if share else number
