"""Random robots against pinocchio and yourdfpy, which read the same text by themselves."""

from __future__ import annotations

import io

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

from dh2sim.formats.serial_robot import SerialRobot
from dh2sim.kinematics.serial_chain import serial_link_poses
from dh2sim.typing import Array
from tests.formats.urdf.samples import Rng, random_tree, read

TOLERANCE = 1e-12
SEEDS = range(24)


def arm(seed: int) -> tuple[str, str, str, SerialRobot, Rng]:
    """A random tree, and its arm from some link on the way to the end of it."""
    rng = np.random.default_rng(seed)
    while True:
        text, way = random_tree(rng, int(rng.integers(2, 25)), moving=float(rng.uniform(0.3, 0.9)))
        base = way[int(rng.integers(0, len(way)))] if seed % 2 else way[0]
        try:
            return text, base, way[-1], read(text, base=base, tip=way[-1]), rng
        except Exception as error:
            if "no joint moves" not in str(error):
                raise


def frames(robot: SerialRobot, tip: str) -> list[str]:
    return [*(link.name for link in robot.links), tip]


def pinocchio_vector(model: pin.Model, robot: SerialRobot, q: Array) -> Array:
    vector: Array = pin.neutral(model)
    for joint, value in zip(robot.chain.joints, q, strict=True):
        index = model.getJointId(joint.name)
        at = model.joints[index].idx_q
        if model.joints[index].nq == 2:
            vector[at : at + 2] = np.cos(value), np.sin(value)
        else:
            vector[at] = value
    return vector


@pytest.mark.parametrize("seed", SEEDS)
def test_every_link_is_where_pinocchio_puts_it(seed: int) -> None:
    text, base, tip, robot, rng = arm(seed)
    model = pin.buildModelFromXML(text)
    data = model.createData()
    for q in rng.uniform(-3, 3, size=(5, robot.chain.n)):
        pin.framesForwardKinematics(model, data, pinocchio_vector(model, robot, q))
        T_world_base = data.oMf[model.getFrameId(base)]
        for T, name in zip(serial_link_poses(robot.chain, q), frames(robot, tip), strict=True):
            expected = T_world_base.actInv(data.oMf[model.getFrameId(name)]).homogeneous
            np.testing.assert_allclose(T, expected, rtol=0, atol=TOLERANCE)


@pytest.mark.parametrize("seed", SEEDS)
def test_every_link_is_where_yourdfpy_puts_it(seed: int) -> None:
    text, base, tip, robot, rng = arm(seed)
    urdf = yourdfpy.URDF.load(io.BytesIO(text.encode()), load_meshes=False, build_scene_graph=True)
    for q in rng.uniform(-3, 3, size=(3, robot.chain.n)):
        urdf.update_cfg({joint.name: float(value) for joint, value in zip(robot.chain.joints, q, strict=True)})
        for T, name in zip(serial_link_poses(robot.chain, q), frames(robot, tip), strict=True):
            np.testing.assert_allclose(T, urdf.get_transform(name, base), rtol=0, atol=TOLERANCE)


@pytest.mark.parametrize("seed", SEEDS)
def test_every_link_weighs_with_all_that_is_fixed_to_it_what_it_weighs_in_pinocchio(seed: int) -> None:
    text, _, _, robot, _ = arm(seed)
    model = pin.buildModelFromXML(text)
    for joint, link in zip(robot.chain.joints, robot.links, strict=True):
        expected = model.inertias[model.getJointId(joint.name)]
        if link.mass is None or link.com is None or link.inertia is None:
            assert (link.mass, link.com, link.inertia, expected.mass) == (None, None, None, 0.0)
            continue
        assert link.mass == pytest.approx(expected.mass, rel=TOLERANCE)
        np.testing.assert_allclose(link.com, expected.lever, rtol=0, atol=TOLERANCE)
        scale = float(np.trace(expected.inertia))
        np.testing.assert_allclose(link.inertia, expected.inertia, rtol=0, atol=TOLERANCE * scale)


@pytest.mark.parametrize("seed", range(8))
def test_the_mass_matrix_of_the_arm_is_the_one_of_the_whole_file_where_that_is_one_arm(seed: int) -> None:
    rng = np.random.default_rng(1000 + seed)
    text, way = random_tree(rng, 8, moving=1.0)
    while len(way) < 9:  # a tree without branches
        text, way = random_tree(rng, 8, moving=1.0)
    robot = read(text)
    model = pin.buildModelFromXML(text)
    data = model.createData()
    q = rng.uniform(-3, 3, size=robot.chain.n)
    expected = pin.crba(model, data, pinocchio_vector(model, robot, q))
    expected = np.triu(expected) + np.triu(expected, 1).T
    np.testing.assert_allclose(mass_matrix(robot, q), expected, rtol=0, atol=1e-10 * float(np.trace(expected)))


def mass_matrix(robot: SerialRobot, q: Array) -> Array:
    """Sum of Jᵀ M J over the links, with Jacobians from the joints' axes in the base."""
    poses = serial_link_poses(robot.chain, q)
    n = robot.chain.n
    total = np.zeros((n, n))
    for i, link in enumerate(robot.links):
        if link.mass is None or link.com is None or link.inertia is None:
            continue
        R = poses[i, :3, :3]
        com = R @ link.com + poses[i, :3, 3]
        Jv, Jw = np.zeros((3, n)), np.zeros((3, n))
        for k, joint in enumerate(robot.chain.joints[: i + 1]):
            axis = poses[k, :3, :3] @ joint.axis
            if joint.type.turns:
                Jv[:, k], Jw[:, k] = np.cross(axis, com - poses[k, :3, 3]), axis
            else:
                Jv[:, k] = axis
        total += link.mass * Jv.T @ Jv + Jw.T @ R @ link.inertia @ R.T @ Jw
    return total
