"""Free motion of a robot from random states, without friction, limits and contacts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import mujoco
import numpy as np

from dh2sim.engines.mujoco_engine import keep_centers_of_mass
from dh2sim.errors import EngineError
from dh2sim.formats.mjcf.elements import MjcfOptions
from dh2sim.formats.mjcf.write import EXPORTED, to_mjcf
from dh2sim.kinematics.rotations import rotations_of_quaternions
from dh2sim.model.collision_exclusions import ExcludedPair, Reason
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import with_actuators, with_base_mass, without_meshes
from dh2sim.mujoco_warnings import mujoco_warnings
from dh2sim.robot.row import ActuatorType
from dh2sim.typing import Array
from dh2sim.validate.motion.mechanics import BaseMotion


def without_dry_friction(model: RobotModel) -> RobotModel:
    """Return the robot without dry friction, which hides small forces and is unknown to controllers."""
    joints = tuple(replace(joint, dynamics=replace(joint.dynamics, friction=0.0)) for joint in model.joints)
    return replace(model, joints=joints)


def frictionless(model: RobotModel) -> RobotModel:
    """Return the robot without dry and viscous friction; rotors keep their inertia."""
    joints = tuple(
        replace(joint, dynamics=replace(joint.dynamics, damping=0.0, friction=0.0)) for joint in model.joints
    )
    return replace(model, joints=joints)


def without_contacts(model: RobotModel) -> RobotModel:
    """Return the robot with links that do not collide."""
    names = [link.name for link in model.all_links]
    pairs = (ExcludedPair(link1=a, link2=b, reason=Reason.DEFAULT) for a, b in combinations(names, 2))
    return replace(model, excluded=tuple(pairs))


RECORDS = 16
"""Instants after the start at which a motion is recorded."""
FASTEST = np.pi
"""1/s: revolute joints start with at most this many rad/s, prismatic ones with this many times the reach a second."""
SPAN = 2.0
"""Duration of a motion, in units of the time in which the fastest joint turns by 1 rad."""
LEAST_SIZE = 0.1
"""m: lower bound of the reach."""


def free_model(model: RobotModel, *, floating_base: bool = False, integrator: str = "RK4") -> mujoco.MjModel:
    """Compile a robot on which only gravity or its motors act.

    Args:
        model: The robot.
        floating_base: False: base_link is fixed, and nothing drives the joints; True: base_link has the mass of its
            shapes and floats without gravity, and every joint has a motor.
        integrator: As in ``MjcfOptions``.

    Raises:
        EngineError: MuJoCo refuses the model.
    """
    bare = frictionless(model)
    if floating_base:
        bare = with_base_mass(with_actuators(bare, ActuatorType.MOTOR))
    else:
        bare = with_actuators(bare, ActuatorType.NONE)
    compiled = compile_model(bare, MjcfOptions(integrator=integrator, floating_base=floating_base))
    disable = mujoco.mjtDisableBit
    compiled.opt.disableflags |= int(disable.mjDSBL_CONSTRAINT) | int(disable.mjDSBL_AUTORESET)
    if floating_base:
        compiled.opt.gravity[:] = 0.0
    return compiled


def compile_model(model: RobotModel, options: MjcfOptions = EXPORTED, *, surroundings: str = "") -> mujoco.MjModel:
    """Compile a robot without meshes.

    Args:
        model: The robot.
        options: Of its MJCF.
        surroundings: What else is in the world body, MJCF.

    Raises:
        EngineError: MuJoCo refuses the model.
    """
    scene = f'<mujoco><include file="robot.xml"/><worldbody>{surroundings}</worldbody></mujoco>'
    text = to_mjcf(without_meshes(model), options)
    try:
        with mujoco_warnings():  # of bodies; what becomes of a motion is checked
            compiled = mujoco.MjModel.from_xml_string(scene, {"robot.xml": text.encode()})
    except ValueError as error:
        raise EngineError(f"MuJoCo refuses the model: {' '.join(str(error).split())}") from error
    keep_centers_of_mass(compiled)
    return compiled


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class State:
    """Start of a motion, and what drives it; coordinates of a floating base come first."""

    qpos: Array
    qvel: Array
    ctrl: Array
    """Constant torques and forces of the motors, N·m and N."""
    duration: float
    """s."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """A motion at ``RECORDS`` + 1 instants."""

    q: Array
    """Joint positions, rad and m, shape (RECORDS + 1, n)."""
    v: Array
    """Joint velocities, shape (RECORDS + 1, n)."""
    base: BaseMotion | None
    """None for a fixed base."""


def random_states(
    model: RobotModel, compiled: mujoco.MjModel, count: int, generator: np.random.Generator
) -> tuple[State, ...]:
    """Draw states: joints anywhere inside their limits, moving fast, and driven as fast where there are motors.

    The duration of each motion follows from its own time scale, so that errors are alike for robots of all sizes.

    Raises:
        EngineError: An acceleration is not finite.
    """
    lower, upper = model.travel
    n = len(lower)
    floating = compiled.nv > n
    length = max(model.reach, LEAST_SIZE)
    sizes = np.array([1.0 if joint.type.turns else length for joint in model.moving_joints])
    base = np.array([length, length, length, 1.0, 1.0, 1.0] if floating else [])
    data = mujoco.MjData(compiled)
    states = []
    for _ in range(count):
        q = generator.uniform(lower, upper)
        data.qpos[:] = np.concatenate([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], q]) if floating else q
        data.qvel[:] = generator.uniform(-1.0, 1.0, compiled.nv) * np.concatenate([base, FASTEST * sizes])
        data.ctrl[:] = 0.0
        mujoco.mj_forward(compiled, data)
        if compiled.nu:
            mass_matrix = np.zeros((compiled.nv, compiled.nv))
            mujoco.mj_fullM(compiled, data, mass_matrix)
            push = np.diag(mass_matrix)[-n:] * FASTEST**2 * sizes
            data.ctrl[:] = np.clip(generator.uniform(-push, push), *compiled.actuator_ctrlrange.T)
            mujoco.mj_forward(compiled, data)
        scale = np.concatenate([base, sizes])
        rate = np.max([np.abs(data.qvel) / scale, np.sqrt(np.abs(data.qacc) / scale)])
        if not np.isfinite(rate):
            raise EngineError("MuJoCo finds no finite acceleration")
        states.append(
            State(
                qpos=data.qpos.copy(),
                qvel=data.qvel.copy(),
                ctrl=data.ctrl.copy(),
                duration=float(SPAN / rate),
            )
        )
    return tuple(states)


def simulate(compiled: mujoco.MjModel, state: State, substeps: int) -> Motion:
    """Simulate a motion in ``RECORDS * substeps`` time steps; an unstable one is not finite."""
    compiled.opt.timestep = state.duration / (RECORDS * substeps)
    data = mujoco.MjData(compiled)
    data.qpos[:], data.qvel[:], data.ctrl[:] = state.qpos, state.qvel, state.ctrl
    qpos = np.empty((RECORDS + 1, compiled.nq))
    qvel = np.empty((RECORDS + 1, compiled.nv))
    for k in range(RECORDS + 1):
        if k:
            mujoco.mj_step(compiled, data, nstep=substeps)
        qpos[k], qvel[k] = data.qpos, data.qvel
    if compiled.nq == compiled.nv:
        return Motion(q=qpos, v=qvel, base=None)
    R = rotations_of_quaternions(qpos[:, 3:7])
    angular = np.einsum("kij,kj->ki", R, qvel[:, 3:6])  # MuJoCo has it along the base's own axes
    base = BaseMotion(rotation=R, position=qpos[:, :3], velocity=qvel[:, :3], angular_velocity=angular)
    return Motion(q=qpos[:, 7:], v=qvel[:, 6:], base=base)
