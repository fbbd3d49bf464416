"""How far a program is from the table, and from dynamics that are computed in another way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from dh2sim.errors import MismatchError
from dh2sim.kinematics.forward import geometric_jacobian, joint_poses
from dh2sim.kinematics.sampling import scattered_configurations
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array

SAMPLES = 20
TOLERANCE = 1e-12
"""Of poses and Jacobians, as a share of the larger of 1 m and the reach."""
FORCE_TOLERANCE = 1e-10
"""Of forces, as a share of the greatest."""
FAR_TOLERANCE = 1e-14
"""Of forces, times the square of how far frames get, m: where a table puts them far from the arm, moments cancel."""


def sampled_states(spec: RobotSpec) -> tuple[Array, Array, Array]:
    """Return q, its rate and the rate of that, rad and m, each of shape (SAMPLES, n); always the same."""
    ranges = [row.limits.position or (-np.pi, np.pi) for row in spec.moving_rows]
    lower, upper = zip(*ranges, strict=True) if ranges else ((), ())
    n = len(ranges)
    q, qd, qdd = np.split(
        scattered_configurations((*lower, *[-2.0] * n, *[-5.0] * n), (*upper, *[2.0] * n, *[5.0] * n), SAMPLES), 3, 1
    )
    return q, qd, qdd


def pose_error(spec: RobotSpec, fk: Callable[[Array], Any]) -> float:
    """Return the greatest difference of an entry to the table's own product."""
    q, _, _ = sampled_states(spec)
    return _checked(spec, "pose", [fk(row) for row in q], table_tool_pose(spec, q), TOLERANCE * _size(spec, q))


def jacobian_error(spec: RobotSpec, jacobian: Callable[[Array], Any]) -> float:
    """Return the greatest difference of an entry to the Jacobian of the chain."""
    q, _, _ = sampled_states(spec)
    found = [jacobian(row) for row in q]
    return _checked(spec, "Jacobian", found, geometric_jacobian(spec, q), TOLERANCE * _size(spec, q))


def force_error(model: RobotModel, function: Callable[[Array, Array, Array], Any]) -> float:
    """Return the greatest difference of a force to ``reference_forces``, as a share of the greatest force."""
    q, qd, qdd = sampled_states(model.spec)
    expected = reference_forces(model, q, qd, qdd)
    size = float(np.abs(expected).max(initial=0.0)) or 1.0
    found = [function(*state) for state in zip(q, qd, qdd, strict=True)]
    allowed = max(FORCE_TOLERANCE, FAR_TOLERANCE * _size(model.spec, q) ** 2)
    return _checked(model.spec, "inverse dynamics", found, expected, allowed * size) / size


def _size(spec: RobotSpec, q: Array) -> float:
    """Return the larger of 1 m and how far any frame gets, m."""
    frames, tool = table_frame_poses(spec, q), table_tool_pose(spec, q)
    return max(1.0, float(np.abs(frames[..., :3, 3]).max()), float(np.abs(tool[..., :3, 3]).max()))


def _checked(spec: RobotSpec, what: str, found: list[Any], expected: Array, allowed: float) -> float:
    error = float(np.abs(np.array(found, dtype=np.float64).reshape(expected.shape) - expected).max(initial=0.0))
    if not error <= allowed:
        raise MismatchError(
            f"{spec.name}: the code of the {what} is off by {error:.3g} (allowed: {allowed:.3g}). "
            "This is a defect of dh2sim: please report it with the robot file"
        )
    return error


def reference_forces(model: RobotModel, q: Array, qd: Array, qdd: Array) -> Array:
    """Return the forces on the joints by Kane's equations, along the axes of base_link, body by body.

    T. R. Kane, D. A. Levinson, The use of Kane's dynamical equations in robotics, Int. J. Robotics Research 2(3),
    1983. Nothing is regrouped and nothing is left out; armature is included.

    Args:
        model: The robot.
        q: Joint vectors, rad and m, shape (N, n).
        qd: Their rates, shape (N, n).
        qdd: The rates of these, shape (N, n).

    Returns:
        N·m or N, shape (N, n).
    """
    count = len(q)
    poses = joint_poses(model.chain, q)
    result = np.zeros(q.shape)
    spin, spin_rate, acceleration, point = (np.zeros((count, 3)) for _ in range(4))
    axes: list[tuple[bool, Array, Array]] = []
    for i, (joint, body) in enumerate(zip(model.joints, model.bodies, strict=True)):
        R, origin = poses[:, i, :3, :3], poses[:, i, :3, 3]
        arm = origin - point
        acceleration = acceleration + np.cross(spin_rate, arm) + np.cross(spin, np.cross(spin, arm))
        point = origin
        if joint.type.moves:
            axis = joint.sign * R[:, :, 2]
            k = len(axes)
            moved, moved_rate = axis * qd[:, k : k + 1], axis * qdd[:, k : k + 1]
            axes.append((joint.type.turns, axis, origin))
            if joint.type.turns:
                spin_rate = spin_rate + moved_rate + np.cross(spin, moved)
                spin = spin + moved
            else:
                acceleration = acceleration + moved_rate + 2 * np.cross(spin, moved)
        if body is None:
            continue
        com = R @ body.com
        inertia = R @ body.inertia @ R.transpose(0, 2, 1)
        force = body.mass * (
            acceleration + np.cross(spin_rate, com) + np.cross(spin, np.cross(spin, com)) - model.spec.gravity
        )
        moment = _times(inertia, spin_rate) + np.cross(spin, _times(inertia, spin))
        for k, (turns, axis, place) in enumerate(axes):
            effect = moment + np.cross(origin + com - place, force) if turns else force
            result[:, k] += (axis * effect).sum(axis=1)
    return result + qdd * [joint.dynamics.armature for joint in model.moving_joints]


def _times(matrices: Array, vectors: Array) -> Array:
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])
