"""Models that differ from rollout to rollout: what is drawn, put into the fields of MuJoCo's models."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from dh2sim.kinematics.chain import build_chain
from dh2sim.robot.row import Convention, Row
from dh2sim.simulate.plant import Plant
from dh2sim.simulate.randomization import links
from dh2sim.typing import Array

FIELDS: Final = {
    "mass_scale": ("body_mass", "body_inertia"),
    "friction_scale": ("dof_frictionloss",),
    "damping_scale": ("dof_damping",),
    "armature_scale": ("dof_armature",),
    "gain_scale": ("actuator_gainprm", "actuator_biasprm"),
}
"""Which fields of an MjModel each factor multiplies, link by link, joint by joint or actuator by actuator."""


class Models(Protocol):
    """A batch of simulations whose models may differ."""

    def expand(self, field: str) -> NDArray[Any]:
        """Return a field of all models, shape (batch, …), to write to."""
        ...

    def set_const(self) -> None:
        """Compute again what follows from fields."""
        ...


def apply_draws(models: Models, plant: Plant, drawn: Mapping[str, Array]) -> None:
    """Give every simulation its own model.

    Args:
        models: The simulations, with the plant's model.
        plant: The robot.
        drawn: By variable of the dataset, rollouts first; those that concern no model are left alone.
    """
    columns = {"mass_scale": links(plant), "gain_scale": list(range(len(plant.actuators)))}
    for variable, fields in FIELDS.items():
        if variable in drawn:
            values = drawn[variable]
            which = columns.get(variable, plant.velocities)
            for field in fields:
                expanded = models.expand(field)
                expanded[:, which] *= values.reshape(values.shape + (1,) * (expanded.ndim - 2))
    _apply_gains(models, plant, drawn)
    if "effort_scale" in drawn:
        _apply_effort(models, plant, drawn["effort_scale"])
    if "gravity" in drawn:
        models.expand("opt.gravity")[:] = drawn["gravity"]
    moved = {"com_offset", "payload", "zero_offset", "row_length_error", "row_angle_error"} & {*drawn}
    if {"zero_offset", "row_length_error", "row_angle_error"} & moved:
        for part, own in _by_design(plant):
            _apply_errors(_Part(models, part), own, {name: values[part] for name, values in drawn.items()})
    if "com_offset" in drawn:
        models.expand("body_ipos")[:, links(plant)] += drawn["com_offset"]
    if "payload" in drawn:
        for part, own in _by_design(plant):
            _apply_payload(_Part(models, part), own, {name: values[part] for name, values in drawn.items()})
    if any(variable in drawn for variable in (*FIELDS, "kp_scale", "kv_scale")) or moved:
        models.set_const()


def _by_design(plant: Plant) -> Iterator[tuple[slice, Plant]]:
    """Yield which simulations have a table in common, and the robot that has it."""
    if not plant.each:
        yield slice(None), plant
    for k, own in enumerate(plant.each):
        yield slice(k, k + 1), own


class _Part:
    """Some of the models."""

    def __init__(self, models: Models, part: slice) -> None:
        self._models, self._part = models, part

    def expand(self, field: str) -> NDArray[Any]:
        """Return a field of these models, to write to."""
        return self._models.expand(field)[self._part]

    def set_const(self) -> None:
        """Compute again what follows from fields, of all models."""
        self._models.set_const()


def _apply_gains(models: Models, plant: Plant, drawn: Mapping[str, Array]) -> None:
    """Multiply stiffness and damping: of position actuators both, of velocity actuators the damping alone."""
    position = plant.model.actuator_biasprm[:, 1] != 0.0
    velocity = ~position & (plant.model.actuator_biastype != mujoco.mjtBias.mjBIAS_NONE)
    if "kp_scale" in drawn:
        kp = drawn["kp_scale"]
        models.expand("actuator_gainprm")[:, position, 0] *= kp[:, position]
        models.expand("actuator_biasprm")[:, position, 1] *= kp[:, position]
    if "kv_scale" in drawn:
        kv = drawn["kv_scale"]
        models.expand("actuator_gainprm")[:, velocity, 0] *= kv[:, velocity]
        models.expand("actuator_biasprm")[:, :, 2] *= np.where(position | velocity, kv, 1.0)


def _apply_effort(models: Models, plant: Plant, factors: Array) -> None:
    """Multiply the greatest forces of actuators, and of motors the range of controls, which are forces."""
    joints = [joint + (1 if plant.floating else 0) for joint in plant.driven]
    models.expand("jnt_actfrcrange")[:, joints] *= factors[:, :, None]
    models.expand("actuator_forcerange")[:] *= factors[:, :, None]
    models.expand("actuator_ctrlrange")[:, motors(plant)] *= factors[:, motors(plant), None]


def motors(plant: Plant) -> NDArray[np.bool_]:
    """Return which actuators take forces."""
    return np.asarray(plant.model.actuator_biastype == mujoco.mjtBias.mjBIAS_NONE)


def _apply_payload(models: Models, plant: Plant, drawn: Mapping[str, Array]) -> None:
    """Add a point mass to the last link: its centre of mass and its inertia follow."""
    last = plant.model.body(f"link_{len(plant.spec.rows)}").id
    chain = build_chain(plant.spec)
    T = chain.joints[-1].T_joint_dh @ chain.T_dhn_tool0
    added = drawn["payload"]
    offset = drawn.get("payload_com", np.zeros((len(added), 3)))
    p = T[:3, 3] + offset @ T[:3, :3].T
    mass, com = models.expand("body_mass"), models.expand("body_ipos")
    inertia, axes = models.expand("body_inertia"), models.expand("body_iquat")
    for k, more in enumerate(added.tolist()):
        if not more:
            continue
        R = _pose(np.zeros(3), axes[k, last])[:3, :3]
        own = float(mass[k, last])
        total = own + more
        apart = p[k] - com[k, last]
        # two bodies about their common centre: the reduced mass at their distance
        tensor = (R * inertia[k, last]) @ R.T
        tensor += own * more / total * (apart @ apart * np.eye(3) - np.outer(apart, apart))
        values, vectors = np.linalg.eigh(tensor)
        if np.linalg.det(vectors) < 0.0:
            vectors[:, 0] *= -1.0
        quat = np.empty(4)
        mujoco.mju_mat2Quat(quat, np.ascontiguousarray(vectors).ravel())
        com[k, last] += more / total * apart
        mass[k, last], inertia[k, last], axes[k, last] = total, values, quat


def _apply_errors(models: Models, plant: Plant, drawn: Mapping[str, Array]) -> None:
    """Move the bodies to where the table with its errors has the joints, and the tool with the last of them."""
    rows, chain = plant.spec.rows, build_chain(plant.spec)
    batch = len(next(iter(drawn.values())))
    lengths = drawn.get("row_length_error", np.zeros((batch, len(rows), 2)))
    angles = drawn.get("row_angle_error", np.zeros((batch, len(rows), 3))).copy()
    lengths = lengths.copy()
    zeros = iter(drawn["zero_offset"].T) if "zero_offset" in drawn else None
    for i, row in enumerate(rows):
        if row.type.moves and zeros is not None:  # a flipped joint moves the other way
            (angles if row.type.turns else lengths)[:, i, 1] += next(zeros) * (-1.0 if row.flip else 1.0)
    position, orientation = models.expand("body_pos"), models.expand("body_quat")
    T_parent_dh = np.broadcast_to(chain.T_base_link_dh0, (batch, 4, 4))
    for i, row in enumerate(rows):
        T_dh_joint, T_joint_dh = _row_parts(row, lengths[:, i], angles[:, i])
        body = plant.model.body(f"link_{i + 1}").id
        _put(T_parent_dh @ T_dh_joint, position[:, body], orientation[:, body])
        T_parent_dh = T_joint_dh
    # tool0 and the last frame move with the last link part, wherever they are fixed
    moved = T_parent_dh @ np.linalg.inv(chain.joints[-1].T_joint_dh)
    for name in ("tool0", f"dh_{len(rows)}"):
        found = mujoco.mj_name2id(plant.model, mujoco.mjtObj.mjOBJ_SITE, name)
        if found < 0:
            continue
        carrier = int(plant.model.site_bodyid[found])
        if carrier == plant.model.body(f"link_{len(rows)}").id:
            places = models.expand("site_pos")[:, found], models.expand("site_quat")[:, found]
        else:  # a site beside its body's frame has a body of its own
            places = position[:, carrier], orientation[:, carrier]
        _put(moved @ _pose(places[0][0], places[1][0]), *places)


def _row_parts(row: Row, lengths: Array, angles: Array) -> tuple[Array, Array]:
    """Return the part of a row before its joint and that after it, with errors of a, d and alpha, theta, beta.

    Each of shape (batch, 4, 4); see ``build_chain``.
    """
    joint = _moved(2, row.theta + angles[:, 1], row.d + lengths[:, 1])
    link = _moved(0, row.alpha + angles[:, 0], row.a + lengths[:, 0])
    match row.convention:
        case Convention.STANDARD:
            return joint, link
        case Convention.MODIFIED:
            return link @ joint, np.broadcast_to(np.eye(4), joint.shape)
        case Convention.HAYATI:
            return joint, link @ _moved(1, row.beta + angles[:, 2], np.zeros(len(lengths)))


def _moved(axis: int, angle: Array, distance: Array) -> Array:
    """Return turns about an axis and slides along it, shape (batch, 4, 4)."""
    T = np.zeros((len(angle), 4, 4))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    T[:, i, i] = T[:, j, j] = np.cos(angle)
    T[:, j, i] = np.sin(angle)
    T[:, i, j] = -T[:, j, i]
    T[:, axis, axis] = T[:, 3, 3] = 1.0
    T[:, axis, 3] = distance
    return T


def _pose(position: Array, quaternion: Array) -> Array:
    T, R = np.eye(4), np.empty(9)
    mujoco.mju_quat2Mat(R, quaternion)
    T[:3, :3], T[:3, 3] = R.reshape(3, 3), position
    return T


def _put(T: Array, position: Array, quaternion: Array) -> None:
    """Write poses, shape (batch, 4, 4), as positions and quaternions."""
    position[:] = T[:, :3, 3]
    for k, R in enumerate(T[:, :3, :3]):
        mujoco.mju_mat2Quat(quaternion[k], np.ascontiguousarray(R).ravel())
