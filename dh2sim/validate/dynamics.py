"""Dynamics: link inertias in the files, and the equations of motion that engines derive from them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dh2sim.engines.engine import DynamicsEngine, DynamicTerms
from dh2sim.engines.mujoco_engine import MujocoEngine
from dh2sim.errors import EngineError
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.row import JointType
from dh2sim.typing import Array
from dh2sim.validate.report import Check, Quantity, Worst

TOLERANCE = 1e-9
"""Relative."""
LEAST_INERTIA = 1e-6
"""Lower bound of the inertia that errors are relative to, as a share of that of the robot's mass at its reach."""
LEAST_FORCE = 1e-3
"""Lower bound of the force that errors are relative to, as a share of that of the robot's weight at its reach."""
LEAST_LEVER = 0.1
"""m; lower bound of the reach in both."""
ROUNDING = 1e-6
"""Lower bound of both, as a share of those of its mass at its longest lever, of which ``TOLERANCE`` is rounding."""


def check_inertias(engine: MujocoEngine, model: RobotModel) -> Check:
    """Compare mass, centre of mass and inertia of every link in a file with those of the model.

    Errors are relative: to the mass, to the reach, and to the inertia's trace. A link without mass must have none.
    """
    errors: list[tuple[float, str]] = []
    for link in model.moving_links:
        try:
            found = engine.mass_properties(link.name)
        except EngineError as refusal:
            return Check(engine=engine.name, quantity=Quantity.INERTIA, ok=False, reason=str(refusal))
        body = link.inertial
        if body is None:
            errors.append((found.mass, link.name))
            continue
        errors += [
            (abs(found.mass - body.mass) / body.mass, link.name),
            (float(np.max(np.abs(found.com - body.com))) / max(1.0, model.extent), link.name),
            (float(np.max(np.abs(found.inertia - body.inertia))) / float(np.trace(body.inertia)), link.name),
        ]
    worst, where = errors[int(np.argmax([error for error, _ in errors]))]  # a NaN is worse than any number
    return Check(
        engine=engine.name,
        quantity=Quantity.INERTIA,
        ok=bool(worst <= TOLERANCE),
        reference="dh2sim",
        max_error=worst,
        tolerance=TOLERANCE,
        worst=Worst(where=where, q=()),
    )


def check_dynamics(
    engine: DynamicsEngine, reference: DynamicTerms, model: RobotModel, q: Array, velocity: Array
) -> list[Check]:
    """Compare an engine's dynamic terms with those of MuJoCo on the MJCF.

    Args:
        engine: The engine.
        reference: What MuJoCo computed from the MJCF for the N states.
        model: The robot.
        q: Joint vectors of the states, shape (N, n).
        velocity: Joint velocities of the states, shape (N, n).

    Returns:
        A check for each of the three terms. Entries of the mass matrix are relative to sqrt(M_ii M_jj), forces to the
        greatest force on the same joint in any of the states, so that light wrists count as much as heavy shoulders.
        Inertias and forces that are tiny beside those of the robot's mass and weight at its reach are only rounding:
        they have the lower bounds ``LEAST_INERTIA`` and ``LEAST_FORCE``. Where an engine rounds inertias, so are
        entries and forces that are small beside those which the links' own inertias can make.
    """
    terms = engine.dynamic_terms(q, velocity, model.spec.gravity)
    lever = max(model.reach, LEAST_LEVER)
    inertia, rounded = _inertia(model, lever), _inertia(model, max(model.longest_lever, LEAST_LEVER))
    least = np.sqrt(max(LEAST_INERTIA * inertia, ROUNDING * rounded))
    diagonal = np.maximum(np.sqrt(np.maximum(np.einsum("kii->ki", reference.mass_matrix), 0.0)), least)
    rounds = engine.inertia_rounding > TOLERANCE
    carried, rate = _carried_inertia(model), _rate(model, velocity)
    if rounds:
        diagonal = np.maximum(diagonal, np.sqrt(carried))
    mass = np.abs(terms.mass_matrix - reference.mass_matrix) / (diagonal[:, :, None] * diagonal[:, None, :])
    weight = model.mass * (1.0 + float(np.linalg.norm(model.spec.gravity)))  # 1 m/s^2 for what the motion makes
    made_far_out = weight * model.longest_lever + rounded * max(1.0, rate) ** 2
    least_force = max(LEAST_FORCE * weight * lever, ROUNDING * made_far_out)
    force = np.maximum(np.abs(reference.bias).max(axis=0), least_force)
    names = [joint.name for joint in model.moving_joints]
    # at most the torque with which links keep turning
    made = np.maximum(force, carried * rate**2) if rounds else force
    bias, gravity = np.abs(terms.bias - reference.bias) / made, np.abs(terms.gravity - reference.gravity) / force
    tolerance = max(TOLERANCE, engine.inertia_rounding)
    return [
        _check(engine.name, Quantity.MASS_MATRIX, mass.max(axis=2), names, q, tolerance),
        _check(engine.name, Quantity.BIAS, bias, names, q, tolerance),
        _check(engine.name, Quantity.GRAVITY, gravity, names, q, TOLERANCE),
    ]


def _inertia(model: RobotModel, lever: float) -> float:
    """Return the inertia, kg·m², of the robot's mass at the end of a lever, and of its links about themselves."""
    own = [float(np.trace(body.inertia)) for body in model.bodies if body is not None]
    return model.mass * lever * lever + math.fsum(own)


def _carried_inertia(model: RobotModel) -> Array:
    """Return the inertia about themselves, kg·m², of the links that each moving joint carries, shape (n,).

    Of a rod, say, it is far more than that about its length.
    """
    own = [0.0 if body is None else float(np.trace(body.inertia)) for body in model.bodies]
    carried = np.cumsum(own[::-1])[::-1]
    moving: Array = carried[[joint.type.moves for joint in model.joints]]
    return moving


def _rate(model: RobotModel, velocity: Array) -> float:
    """Return an upper bound, rad/s, of how fast links turn at these joint velocities, shape (N, n)."""
    turning = [joint.type is not JointType.PRISMATIC for joint in model.moving_joints]
    return float(np.abs(velocity[:, turning]).sum(axis=1).max(initial=0.0))


def _check(engine: str, quantity: Quantity, error: Array, names: Sequence[str], q: Array, tolerance: float) -> Check:
    """Return a check of errors by state and joint, shape (N, n)."""
    sample, joint = divmod(int(np.argmax(error)), error.shape[1])
    largest = float(error[sample, joint])
    return Check(
        engine=engine,
        quantity=quantity,
        ok=bool(largest <= tolerance),
        reference="mujoco-mjcf",
        samples=len(q),
        max_error=largest,
        tolerance=tolerance,
        worst=Worst(where=names[joint], q=tuple(q[sample].tolist()), sample=sample),
    )
