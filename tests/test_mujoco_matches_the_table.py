"""The promise of dh2sim: MuJoCo puts every frame where the Denavit-Hartenberg table has it.

Every robot of ``robots/`` is exported, MuJoCo reads the file, and the poses of its sites are compared at 1000 random
configurations with analytic forward kinematics that share no code with the export: closed forms from textbooks and
lecture notes, one scalar expression an entry, and the textbook product of the rows' matrices.
"""

from __future__ import annotations

import inspect
from pathlib import Path

import mujoco
import numpy as np
import pytest

from dh2sim import Robot
from dh2sim.kinematics.table_oracle import table_frame_poses
from dh2sim.typing import Array
from tests.robots.closed_forms import ROBOTS as CLOSED_FORMS

CATALOGUE = sorted(path.stem for path in (Path(__file__).parents[1] / "robots").glob("*.yaml"))
CONFIGURATIONS = 1000
TOLERANCE = 1e-13
"""Of rotations, and of positions as a share of the larger of 1 m and the robot's reach: rounding."""


def mujoco_frame_poses(robot: Robot, q: Array, folder: Path) -> Array:
    """Export a robot and return the poses of its sites dh_0 … dh_n in base_link, shape (len(q), n + 1, 4, 4)."""
    robot.export(folder)
    model = mujoco.MjModel.from_xml_path(str(folder / robot.name / f"{robot.name}.xml"))
    data = mujoco.MjData(model)
    frames = [f"dh_{i}" for i in range(len(robot.spec.rows) + 1)]
    poses = np.tile(np.eye(4), (len(q), len(frames), 1, 1))
    for coordinates, pose in zip(q, poses, strict=True):
        data.qpos[:] = coordinates
        mujoco.mj_kinematics(model, data)
        for i, frame in enumerate(frames):
            pose[i, :3, :3] = data.site(frame).xmat.reshape(3, 3)
            pose[i, :3, 3] = data.site(frame).xpos
    return poses


@pytest.mark.parametrize(
    "name", ["stanford", "scara", "ssrms", *sorted({*CLOSED_FORMS} - {"stanford", "scara", "ssrms"})]
)
def test_the_last_frame_in_mujoco_is_that_of_the_closed_form(name: str, tmp_path: Path) -> None:
    robot = Robot.load(name)
    q = robot.random_configurations(CONFIGURATIONS, seed=1)
    closed_form = CLOSED_FORMS[name]
    names = [p.name for p in inspect.signature(closed_form).parameters.values() if p.kind is p.KEYWORD_ONLY]
    expected = closed_form(*q.T, **{key: robot.spec.parameters[key] for key in names})
    poses = mujoco_frame_poses(robot, q, tmp_path)[:, -1]
    np.testing.assert_allclose(poses, expected, rtol=0, atol=TOLERANCE * max(1.0, robot.model.reach))


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_frame_in_mujoco_is_that_of_the_product_of_the_rows(name: str, tmp_path: Path) -> None:
    robot = Robot.load(name)
    q = robot.random_configurations(CONFIGURATIONS, seed=2)
    poses = mujoco_frame_poses(robot, q, tmp_path)
    expected = table_frame_poses(robot.spec, q)
    np.testing.assert_allclose(poses, expected, rtol=0, atol=TOLERANCE * max(1.0, robot.model.reach))
