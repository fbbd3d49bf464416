"""What the tests of the MJCF reader share: files to read, and MuJoCo's own kinematics to compare with."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from dh2sim.formats.mjcf.read import read_mjcf
from dh2sim.formats.serial_robot import SerialRobot
from dh2sim.kinematics.serial_chain import serial_link_poses
from dh2sim.typing import Array

BALL = '<geom size="0.1"/>'
"""A geom that gives its body mass."""


def model_text(bodies: str, before: str = "", after: str = "", name: str = "sample") -> str:
    """An MJCF with some bodies in the world."""
    return f'<mujoco model="{name}">{before}<worldbody>{bodies}</worldbody>{after}</mujoco>'


def arm_text(n: int = 2, last: str = "", before: str = "", after: str = "", joint: str = "") -> str:
    """An arm of hinges: body base, bodies link_1 …, joints joint_a, …, 0.5 m apart along z."""
    text = last
    for i in range(n, 0, -1):
        name = "abcdefghij"[i - 1]
        own = f'<joint name="joint_{name}" {joint}/>{BALL}'
        text = f'<body name="link_{i}" pos="0 0 0.5" euler="90 0 0">{own}{text}</body>'
    return model_text(f'<body name="base">{BALL}{text}</body>', before, after)


def read_text(folder: Path, text: str, base: str | None = None, tip: str | None = None) -> SerialRobot:
    """Read a text as the file robot.xml in a folder."""
    path = folder / "robot.xml"
    path.write_text(text, encoding="utf-8")
    return read_mjcf(path, file="robot.xml", base=base, tip=tip)


def frame(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> Array:
    """Pose of a site, or else of a body, in the world, shape (4, 4)."""
    T = np.eye(4)
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name)
    if number >= 0:
        T[:3, 3], T[:3, :3] = data.site_xpos[number], data.site_xmat[number].reshape(3, 3)
        return T
    body = data.body(name)
    T[:3, 3], T[:3, :3] = body.xpos, body.xmat.reshape(3, 3)
    return T


def residual(robot: SerialRobot, model: mujoco.MjModel, base: str, frames: list[str | None], seed: int = 0) -> float:
    """Greatest difference of a component of a pose to MuJoCo's at 30 configurations.

    Args:
        robot: What was read.
        model: MuJoCo's own model of the same file.
        base: Name of the base's body.
        frames: Names of the bodies of the links and, last, of the tip's site or body; None for a link without one.
        seed: Of the configurations.
    """
    n = robot.chain.n
    assert len(frames) == n + 1
    data = mujoco.MjData(model)
    rng = np.random.default_rng(seed)
    worst = 0.0
    for _ in range(30):
        q = rng.uniform(-3.0, 3.0, n)
        data.qpos[:] = rng.uniform(-1.0, 1.0, model.nq)  # joints off the arm must not matter
        for joint, value in zip(robot.chain.joints, q, strict=True):
            data.joint(joint.name).qpos[0] = value
        mujoco.mj_kinematics(model, data)
        T_base = frame(model, data, base)
        found = serial_link_poses(robot.chain, q)
        for name, T in zip(frames, found, strict=True):
            if name is not None:
                worst = max(worst, float(np.abs(T_base @ T - frame(model, data, name)).max()))
    return worst
