"""Links without mass weigh nothing in any reader: the torques that hold the arm are those of its masses alone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pinocchio
import pytest

from dh2sim.formats.urdf.write import to_urdf
from dh2sim.kinematics.table_oracle import table_frame_poses
from dh2sim.kinematics.transforms import invert
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from tests.sample_robots import in_limits, model

NAMES = ["odd", "stanford", "puma560"]
STEP = 1e-5


def potential_energy(built: RobotModel, q: Array) -> float:
    """Of the links' masses at the poses of the table."""
    T = table_frame_poses(built.spec, q[None])[0, 1:]
    heights = [
        -link.inertial.mass * (T[i] @ invert(joint.T_joint_dh) @ [*link.inertial.com, 1.0])[:3] @ built.spec.gravity
        for i, (link, joint) in enumerate(zip(built.links, built.joints, strict=True))
        if link.inertial is not None
    ]
    return float(sum(heights))


def holding_torques(built: RobotModel, q: Array) -> Array:
    """By differences of the potential energy, to about 1e-8 of the largest."""
    steps = STEP * np.eye(len(q))
    return np.array([potential_energy(built, q + h) - potential_energy(built, q - h) for h in steps]) / (2 * STEP)


def in_mujoco(path: Path, built: RobotModel, q: Array) -> Array:
    mj = mujoco.MjModel.from_xml_path(str(path))
    mj.opt.gravity[:] = built.spec.gravity
    data = mujoco.MjData(mj)
    data.qpos[:] = q
    mujoco.mj_forward(mj, data)
    return np.array(data.qfrc_bias)


def in_pinocchio(path: Path, built: RobotModel, q: Array) -> Array:
    pin = pinocchio.buildModelFromUrdf(str(path))
    pin.gravity.linear = np.array(built.spec.gravity)
    values = [
        [np.cos(value), np.sin(value)] if joint.nq == 2 else [value]
        for joint, value in zip(list(pin.joints)[1:], q, strict=True)
    ]
    return np.array(pinocchio.computeGeneralizedGravity(pin, pin.createData(), np.concatenate(values)))


def in_pybullet(path: Path, built: RobotModel, q: Array, *, own_inertia: bool = False) -> Array:
    bullet = pytest.importorskip("pybullet", reason="PyBullet has wheels for few versions of Python")
    client = bullet.connect(bullet.DIRECT)
    try:
        bullet.setGravity(*built.spec.gravity, physicsClientId=client)
        flags = 0 if own_inertia else bullet.URDF_USE_INERTIA_FROM_FILE
        body = bullet.loadURDF(str(path), useFixedBase=True, flags=flags, physicsClientId=client)
        rest = [0.0] * len(q)
        return np.array(bullet.calculateInverseDynamics(body, q.tolist(), rest, rest, physicsClientId=client))
    finally:
        bullet.disconnect(client)


def in_pybullet_with_its_own_inertias(path: Path, built: RobotModel, q: Array) -> Array:
    return in_pybullet(path, built, q, own_inertia=True)


def in_drake(path: Path, built: RobotModel, q: Array) -> Array:
    parsing = pytest.importorskip("pydrake.multibody.parsing", reason="drake is not installed (pip install drake)")
    plants = pytest.importorskip("pydrake.multibody.plant")
    plant = plants.MultibodyPlant(0.0)
    parsing.Parser(plant).AddModels(str(path))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base_link"))
    plant.mutable_gravity_field().set_gravity_vector(built.spec.gravity)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    return -np.array(plant.CalcGravityGeneralizedForces(context))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "reader", [in_mujoco, in_pinocchio, in_pybullet, in_pybullet_with_its_own_inertias, in_drake]
)
def test_every_reader_holds_the_arm_with_the_torques_of_its_masses(
    reader: Callable[[Path, RobotModel, Array], Array], name: str, tmp_path: Path
) -> None:
    built = model(name)
    path = tmp_path / "robot.urdf"
    path.write_text(to_urdf(built), encoding="utf-8")
    for q in in_limits(built, 3, seed=31):
        expected = holding_torques(built, q)
        np.testing.assert_allclose(reader(path, built, q), expected, rtol=0, atol=1e-7 * np.abs(expected).max())


def test_the_total_mass_in_pybullet_is_the_arms(tmp_path: Path) -> None:
    bullet = pytest.importorskip("pybullet", reason="PyBullet has wheels for few versions of Python")
    built = model("odd")
    path = tmp_path / "robot.urdf"
    path.write_text(to_urdf(built), encoding="utf-8")
    client = bullet.connect(bullet.DIRECT)
    try:
        body = bullet.loadURDF(str(path), useFixedBase=True, physicsClientId=client)
        links = range(bullet.getNumJoints(body, physicsClientId=client))
        total = sum(bullet.getDynamicsInfo(body, link, physicsClientId=client)[0] for link in links)
    finally:
        bullet.disconnect(client)
    assert total == pytest.approx(built.mass, rel=1e-12)
