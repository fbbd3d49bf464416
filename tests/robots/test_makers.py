"""Arms that people have, against their makers' own descriptions, which know nothing of a table."""

from __future__ import annotations

from functools import cache
from typing import Any

import mujoco
import numpy as np
import pytest

from dh2sim import Robot, build_chain, forward_kinematics
from dh2sim.typing import Array
from scripts.real_arms.packages import EXAMPLES, PYBULLET, Package, installed
from tests.sample_robots import ROBOTS_DIR, robot

from .makers import ARMS, Described
from .samples import random_configurations

pin: Any = pytest.importorskip(
    "pinocchio", reason="the makers' descriptions are computed by pinocchio (pip install pin)"
)

ROUNDED = 3e-5
"""By which poses may differ from files that have 1.5708 for π/2."""

URDFS = [
    ("franka_panda", EXAMPLES, "panda_description/urdf/panda.urdf", "panda_link0", "panda_link8", 0.0, 1e-9),
    ("kuka_iiwa14", PYBULLET, "kuka_iiwa/model.urdf", "lbr_iiwa_link_0", "lbr_iiwa_link_7", 0.045, 1e-9),
    ("so101", EXAMPLES, "so_arm_description/urdf/so101.urdf", "base_link", "gripper_frame_link", 0.0, ROUNDED),
    ("xarm7", EXAMPLES, "xarm_description/urdf/xarm7.urdf", "link_base", "link7", 0.0, ROUNDED),
]
"""Robot, package, file, base, tip, where tool0 is along the tip's z (m), tolerance (m and entries of a rotation)."""

WEIGHED = [name for name, arm in ARMS.items() if arm.weighed]


@cache
def _described(name: str) -> Described:
    return Described(ARMS[name], pin)


def _configurations(name: str) -> Array:
    """Anywhere inside the limits, and at the named configurations."""
    spec = robot(name)
    return np.vstack([random_configurations(spec, seed=5, count=20), *spec.configurations.values()])


@pytest.mark.parametrize("name", ARMS)
def test_tool_is_where_the_maker_has_it(name: str) -> None:
    q = _configurations(name)
    expected = np.stack([_described(name).tool_pose(each) for each in q])
    np.testing.assert_allclose(forward_kinematics(build_chain(robot(name)), q), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", WEIGHED)
def test_mass_matrix_and_gravity_torques_are_those_of_the_makers_inertials(name: str) -> None:
    compiled = Robot.load(ROBOTS_DIR / f"{name}.yaml").mjmodel()
    data, matrix = mujoco.MjData(compiled), np.zeros((compiled.nv, compiled.nv))
    for q in _configurations(name):
        data.qpos[:] = q
        mujoco.mj_forward(compiled, data)
        mujoco.mj_fullM(compiled, data, matrix)
        matrix -= np.diag(compiled.dof_armature)  # of the rotors, which are no link's
        expected = _described(name).mass_matrix(q)
        np.testing.assert_allclose(matrix, expected, rtol=0, atol=1e-9 * np.max(expected))
        np.testing.assert_allclose(data.qfrc_bias, _described(name).gravity_torques(q), rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", WEIGHED)
def test_no_mass_of_a_described_arm_is_estimated(name: str) -> None:
    assert not Robot.load(ROBOTS_DIR / f"{name}.yaml").model.estimates


@pytest.mark.parametrize(("name", "package", "file", "base", "tip", "along", "tolerance"), URDFS)
def test_tool_is_where_a_urdf_of_others_has_it(
    name: str, package: Package, file: str, base: str, tip: str, along: float, tolerance: float
) -> None:
    root = installed(package)
    if root is None:
        pytest.skip(f"{package.name} {package.version} is not installed")
    model = pin.buildModelFromUrdf(str(root / file))
    data, T_tip_tool = model.createData(), pin.SE3(np.eye(3), np.array([0.0, 0.0, along]))
    for q in _configurations(name):
        pin.framesForwardKinematics(model, data, np.concatenate([q, np.zeros(model.nq - len(q))]))
        T_base_tip = data.oMf[model.getFrameId(base)].inverse() * data.oMf[model.getFrameId(tip)]
        tool = forward_kinematics(build_chain(robot(name)), q)
        np.testing.assert_allclose(tool, (T_base_tip * T_tip_tool).homogeneous, rtol=0, atol=tolerance)
