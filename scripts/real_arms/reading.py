"""The same files, read by pinocchio and MuJoCo, which share no code with the import."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dh2sim.kinematics.sampling import random_configurations
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array

CONFIGURATIONS = 200
SEED = 1


def other_reader(path: Path) -> str:
    """Name of the program that reads a file beside the import."""
    return "MuJoCo" if path.suffix == ".xml" else "pinocchio"


def joint_vectors(spec: RobotSpec, configurations: int = CONFIGURATIONS) -> Array:
    """Random joint vectors, a turn and a metre to both sides of zero, shape (configurations, n)."""
    bound = np.array([np.pi if row.type.turns else 1.0 for row in spec.moving_rows])
    return random_configurations(-bound, bound, configurations, SEED)


def poses_from_file(path: Path, base: str, tip: str, joints: Sequence[str], q: Array) -> Array:
    """Return the tip's poses in the base, read from a URDF by pinocchio or from an MJCF by MuJoCo.

    Args:
        path: The file.
        base: Name of the link or body that the poses are in.
        tip: Name of the link, body or site.
        joints: Names of the joints that move; all others stay where they are at zero.
        q: Joint vectors, shape (N, n).

    Returns:
        Shape (N, 4, 4).
    """
    read = _mujoco if path.suffix == ".xml" else _pinocchio
    return read(path, base, tip, joints, q)


def _pinocchio(path: Path, base: str, tip: str, joints: Sequence[str], q: Array) -> Array:
    import pinocchio as pin

    model = pin.buildModelFromXML(path.read_text(encoding="utf-8"))
    data = model.createData()
    moving = [model.joints[model.getJointId(name)] for name in joints]
    first, last = (model.getFrameId(name, pin.FrameType.BODY) for name in (base, tip))
    if max(first, last) >= model.nframes:
        raise ValueError(f"{path.name}: pinocchio knows no link {base} or {tip}")
    poses = np.empty((len(q), 4, 4))
    for k, vector in enumerate(q):
        pin.framesForwardKinematics(model, data, _configuration(pin.neutral(model), moving, vector))
        poses[k] = data.oMf[first].actInv(data.oMf[last]).homogeneous
    return poses


def _configuration(neutral: Array, moving: Sequence[Any], vector: Array) -> Array:
    """A continuous joint is stored as cosine and sine."""
    for joint, value in zip(moving, vector.tolist(), strict=True):
        if joint.nq == 2:
            neutral[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
        else:
            neutral[joint.idx_q] = value
    return neutral


def _mujoco(path: Path, base: str, tip: str, joints: Sequence[str], q: Array) -> Array:
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    places = [int(model.joint(name).qposadr[0]) for name in joints]
    poses = np.empty((len(q), 4, 4))
    for k, vector in enumerate(q):
        data.qpos[places] = vector
        mujoco.mj_kinematics(model, data)
        poses[k] = np.linalg.inv(_pose(data.body(base))) @ _pose(data.body(tip))
    return poses


def _pose(body: Any) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = body.xmat.reshape(3, 3), body.xpos
    return T
