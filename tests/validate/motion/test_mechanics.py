"""Energy and momentum from the table and the masses are MuJoCo's, and those of textbooks."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from dh2sim.formats.mjcf.elements import MjcfOptions
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import with_base_mass, without_meshes
from dh2sim.typing import Array
from dh2sim.validate.motion.mechanics import BaseMotion, bodies, energy
from tests.robot_files import ODD, RICH
from tests.validate.motion.robots import PENDULUM, built

MODELS = pytest.mark.parametrize("robot", ["stanford", "ssrms", "cylindrical", ODD, RICH], ids=lambda text: text[:12])


def states(model: RobotModel, count: int = 5) -> tuple[Array, Array]:
    generator = np.random.default_rng(3)
    shape = (count, len(model.moving_joints))
    return generator.uniform(-3.0, 3.0, shape), generator.uniform(-3.0, 3.0, shape)


@MODELS
def test_energies_are_those_of_mujoco(robot: str) -> None:
    model = built(robot)
    q, v = states(model)
    compiled = mujoco.MjModel.from_xml_string(to_mjcf(without_meshes(model), MjcfOptions(energy=True)))
    data = mujoco.MjData(compiled)
    found = []
    for position, velocity in zip(q, v, strict=True):
        data.qpos[:], data.qvel[:] = position, velocity
        mujoco.mj_forward(compiled, data)
        found.append(data.energy.copy())
    potential, kinetic = energy(model, q, v)
    np.testing.assert_allclose(kinetic, np.array(found)[:, 1], rtol=1e-12)
    np.testing.assert_allclose(potential, np.array(found)[:, 0], rtol=0, atol=1e-12 * np.abs(found).max())


@MODELS
def test_momenta_of_a_floating_robot_are_those_of_mujoco(robot: str) -> None:
    model = with_base_mass(built(robot))
    q, v = states(model, 1)
    compiled = mujoco.MjModel.from_xml_string(to_mjcf(without_meshes(model), MjcfOptions(floating_base=True)))
    data = mujoco.MjData(compiled)
    data.qpos[:7] = [0.3, -0.2, 0.7, *np.array([0.1, 0.5, -0.7, 0.3]) / math.sqrt(0.84)]
    data.qpos[7:] = q[0]
    data.qvel[:6] = [0.4, -1.0, 0.3, 0.9, 0.2, -0.6]
    data.qvel[6:] = v[0]
    mujoco.mj_forward(compiled, data)
    mujoco.mj_subtreeVel(compiled, data)
    R = data.body("base_link").xmat.reshape(3, 3)
    base = BaseMotion(
        rotation=R[None],
        position=data.qpos[None, :3],
        velocity=data.qvel[None, :3],
        angular_velocity=(R @ data.qvel[3:6])[None],
    )
    links = bodies(model, q, v, base)
    root = compiled.body("base_link").id
    linear, angular = links.momentum.sum(axis=1)[0], links.angular_momentum.sum(axis=1)[0]
    size = np.linalg.norm(links.angular_momentum, axis=2).sum()
    np.testing.assert_allclose(linear, compiled.body_subtreemass[root] * data.subtree_linvel[root], rtol=1e-11)
    np.testing.assert_allclose(angular, data.subtree_angmom[root], rtol=0, atol=1e-12 * size)
    com = (links.mass[:, None] * links.com[0]).sum(axis=0) / links.mass.sum()
    np.testing.assert_allclose(com, data.subtree_com[root], rtol=0, atol=1e-12 * model.reach)


def test_the_energies_of_a_pendulum_are_those_of_the_textbook() -> None:
    model = built(PENDULUM)
    angle, rate = np.array([[0.0], [0.7]]), np.array([[0.0], [1.5]])
    potential, kinetic = energy(model, angle, rate)
    np.testing.assert_allclose(potential, 2 * 9.81 * 0.4 * np.sin(angle[:, 0]), atol=1e-12)
    inertia = 0.05 + 2 * 0.4**2 + 0.2  # about the axis, with the rotor's
    np.testing.assert_allclose(kinetic, 0.5 * inertia * rate[:, 0] ** 2, rtol=1e-12)
