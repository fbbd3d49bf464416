"""All checks of how a robot moves."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

from dh2sim.errors import Dh2simError
from dh2sim.model.robot_model import RobotModel
from dh2sim.simulate.mujoco_runtime import quiet_engine
from dh2sim.validate.motion.conservation import check_energy, check_momentum
from dh2sim.validate.motion.free_motion import compile_model, free_model
from dh2sim.validate.motion.self_contact import check_self_contact
from dh2sim.validate.motion.tracking import (
    check_inverse,
    check_rest,
    check_tracking,
    recorded_rollouts,
    resting_rollouts,
    tracking_rollouts,
)
from dh2sim.validate.report import Check, Quantity, finding, impossible

MOST_ROWS = 60
"""Longest table that is checked; the time that simulations take grows with the cube of its rows."""


def check_motion(model: RobotModel, *, seed: int = 0) -> tuple[Check, ...]:
    """Check that a simulated robot moves as physics requires.

    Args:
        model: The robot.
        seed: Seed of all random numbers.

    Returns:
        A check each of energy, momentum, rest, tracking, inverse dynamics and self-contact. One that cannot be made
        of this robot has ``ok`` None, and the reason.
    """
    assumed = {joint.name for joint in model.moving_joints if "effort" in joint.assumed}
    checks: dict[Quantity, Callable[[], Check]] = {
        Quantity.ENERGY: lambda: check_energy(model, free_model(model), seed=seed),
        Quantity.MOMENTUM: lambda: check_momentum(model, free_model(model, floating_base=True), seed=seed),
        Quantity.REST: lambda: check_rest(resting_rollouts(model, seed=seed), assumed),
        Quantity.TRACKING: lambda: check_tracking(tracking_rollouts(model, seed=seed), assumed),
        Quantity.INVERSE: lambda: check_inverse(recorded_rollouts(model, seed=seed)),
        Quantity.SELF_CONTACT: lambda: check_self_contact(model, compile_model(model), seed=seed),
    }
    reason = None
    if not model.moving_joints:
        reason = "the robot has no joint that moves"
    elif len(model.links) > MOST_ROWS:
        reason = f"the table has {len(model.links)} rows; at most {MOST_ROWS} are simulated"
    if reason is not None:
        return tuple(impossible(quantity, reason) for quantity in checks)
    with quiet_engine():
        return tuple(_timed(quantity, check) for quantity, check in checks.items())


def _timed(quantity: Quantity, check: Callable[[], Check]) -> Check:
    """Make a check; one that raises anything unexpected has failed."""
    start = time.perf_counter()
    try:
        found = check()
    except Dh2simError as refusal:
        found = impossible(quantity, str(refusal))
    except MemoryError:
        raise
    except Exception as error:
        found = finding(quantity, math.inf, 0.0, samples=0, failure=f"broke down: {type(error).__name__}: {error}")
    return replace(found, seconds=time.perf_counter() - start)
