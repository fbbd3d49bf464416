"""Forces of generated code against MuJoCo and pinocchio, on files that dh2sim exports."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.codegen.generate import generate_code
from dh2sim.engines.mujoco_engine import keep_centers_of_mass
from dh2sim.engines.pinocchio_engine import PinocchioEngine
from dh2sim.errors import ModelError
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.links import ToolSpec
from dh2sim.robot.row import Dynamics
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.codegen.running import python_functions
from tests.sample_robots import NAMES, ODD_ROBOT, in_limits, model
from tests.strategies import massless_robot_specs, robot_specs

GENERATED = Path(__file__).parents[2] / "generated"
TOLERANCE = 1e-9
"""Of the greatest force on a joint; of a joint with next to none, of a thousandth of the greatest on any."""


def states(built: RobotModel, count: int, seed: int) -> tuple[Array, Array, Array]:
    generator = np.random.default_rng(seed)
    q = in_limits(built, count, seed)
    return q, generator.uniform(-2, 2, q.shape), generator.uniform(-5, 5, q.shape)


def mj_inverse(compiled: mujoco.MjModel, built: RobotModel, q: Array, qd: Array, qdd: Array) -> Array:
    """Forces by MuJoCo without contacts, limits, damping and friction."""
    compiled.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    compiled.dof_damping[:] = 0.0
    keep_centers_of_mass(compiled)
    data = mujoco.MjData(compiled)
    dofs = [compiled.joint(joint.name).dofadr[0] for joint in built.moving_joints]
    forces = np.zeros(q.shape)
    for k in range(len(q)):
        data.qpos[dofs], data.qvel[dofs], data.qacc[dofs] = q[k], qd[k], qdd[k]
        mujoco.mj_inverse(compiled, data)
        forces[k] = data.qfrc_inverse[dofs]
    return forces


def assert_equal_forces(found: Array, expected: Array) -> None:
    greatest = np.abs(expected).max(axis=0)
    allowed = TOLERANCE * np.maximum(greatest, 1e-3 * greatest.max())
    assert (np.abs(found - expected) <= allowed).all(), np.abs(found - expected).max(axis=0) / allowed


def forces_of(built: RobotModel, q: Array, qd: Array, qdd: Array) -> Array:
    function = python_functions(generate_code(built, "numpy", "inverse-dynamics"))["inverse_dynamics"]
    return np.asarray(function(q, qd, qdd))


@pytest.mark.parametrize("name", NAMES)
def test_forces_equal_those_of_mujoco_on_the_exported_mjcf(name: str) -> None:
    built = model(name)
    q, qd, qdd = states(built, 20, seed=7)
    compiled = mujoco.MjModel.from_xml_path(str(GENERATED / name / f"{name}.xml"))
    assert_equal_forces(forces_of(built, q, qd, qdd), mj_inverse(compiled, built, q, qd, qdd))


@pytest.mark.parametrize("name", NAMES)
def test_forces_equal_those_of_pinocchio_on_the_exported_urdf(name: str) -> None:
    pytest.importorskip("pinocchio", reason="pinocchio is not installed")
    built = model(name)
    q, qd, qdd = states(built, 20, seed=8)
    names = [joint.name for joint in built.moving_joints]
    engine = PinocchioEngine(GENERATED / name / f"{name}.urdf", names, len(built.joints))
    terms = engine.dynamic_terms(q, qd, built.spec.gravity)
    armature = np.array([joint.dynamics.armature for joint in built.moving_joints])  # a URDF cannot hold it
    expected = np.einsum("kij,kj->ki", terms.mass_matrix, qdd) + terms.bias + armature * qdd
    assert_equal_forces(forces_of(built, q, qd, qdd), expected)


def compare_with_mujoco(spec: RobotSpec) -> None:
    try:
        built = build_model(spec)
    except ModelError:  # nothing is known of what the last joint moves
        return
    q, qd, qdd = states(built, 5, seed=9)
    compiled = mujoco.MjModel.from_xml_string(to_mjcf(built))
    assert_equal_forces(forces_of(built, q, qd, qdd), mj_inverse(compiled, built, q, qd, qdd))


@given(robot_specs(max_rows=6))
def test_forces_of_any_robot_equal_those_of_mujoco(spec: RobotSpec) -> None:
    compare_with_mujoco(spec)


@settings(max_examples=10)
@given(massless_robot_specs())
def test_forces_of_robots_with_links_that_weigh_nothing_equal_those_of_mujoco(spec: RobotSpec) -> None:
    compare_with_mujoco(spec)


def test_forces_contain_tool_armature_and_the_direction_of_gravity() -> None:
    spec = replace(
        ODD_ROBOT,
        gravity=read_only([1.0, -2.0, -9.0]),
        tool=ToolSpec(xyz=read_only([0.1, 0.2, 0.3]), rpy=read_only([0.4, 0.5, 0.6]), mass=3.0),
        rows=tuple(
            replace(row, dynamics=Dynamics(damping=0.5, friction=0.4, armature=0.3)) if row.type.moves else row
            for row in ODD_ROBOT.rows
        ),
    )
    compare_with_mujoco(spec)
    heavy, light = build_model(spec), build_model(replace(spec, tool=ToolSpec()))
    q, qd, qdd = states(heavy, 5, seed=10)
    assert (np.abs(forces_of(heavy, q, qd, qdd) - forces_of(light, q, qd, qdd)).max(axis=0) > 0.1).all()
