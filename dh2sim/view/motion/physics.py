"""A robot that moves by the laws of mechanics, in real time: MuJoCo on the exported model."""

from __future__ import annotations

import time
from collections import deque
from typing import Final, Literal, TypeAlias

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from dh2sim.kinematics.chain import joint_vector
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import with_actuators
from dh2sim.mujoco_warnings import mujoco_warnings
from dh2sim.robot.row import ActuatorType
from dh2sim.simulate.mujoco_runtime import quiet_engine
from dh2sim.typing import Array, read_only
from dh2sim.validate.motion.free_motion import compile_model
from dh2sim.view.motion.applied_force import (
    SpringForce,
    drag_spring,
    find_point,
    finite_vector,
    joint_forces,
)
from dh2sim.view.scene.ground import ground_of

Drive: TypeAlias = Literal["position", "free"]
"""'position': actuators hold the joints at their targets; 'free': nothing drives them."""

STEPS_PER_CLOCK_READING = 16


class SpeedLimit:
    """Detects a simulation that has become unstable: positions or speeds that no time step can follow."""

    def __init__(self, model: mujoco.MjModel, *, size: float) -> None:
        """Choose the limits.

        A joint must not turn by more than 1 rad in a time step, nor slide by more than the robot's size: forces would
        change faster than the simulation can see.

        Args:
            model: The compiled robot; its base does not move.
            size: Of the robot, m.
        """
        turns = model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
        step = float(model.opt.timestep)
        self._names = [model.joint(i).name for i in range(model.njnt)]
        self._units = ["rad/s" if turn else "m/s" for turn in turns]
        self._limits = np.where(turns, 1.0, max(size, 1.0)) / step

    def reason(self, data: mujoco.MjData) -> str:
        """Return what is wrong with a state, a sentence; empty if nothing is."""
        good = np.isfinite(data.qpos) & (np.abs(data.qvel) <= self._limits)  # NaN compares false
        if good.all():
            return ""
        worst = int(np.argmin(good))
        speed, unit = abs(float(data.qvel[worst])), self._units[worst]
        moves = f"moves at {speed:.3g} {unit}" if np.isfinite(speed) else "has no finite speed"
        if speed <= self._limits[worst]:
            moves = "has no finite position"
        return (
            f"The simulation became unstable at {float(data.time):.3f} s: {self._names[worst]} {moves}; "
            f"the limit is {self._limits[worst]:.3g} {unit}."
        )


_STOPPED_BY_FLOOR: Final = 2
"""Bit of the links, and of the floor, in MuJoCo's filter of contacts."""


def compile_on_floor(model: RobotModel, start: ArrayLike) -> mujoco.MjModel:
    """Compile a robot without meshes on the floor of its scene.

    A link that is in the floor at the start is not stopped by it: it would be thrown out.

    Args:
        model: The robot.
        start: Joint positions, rad or m, shape (n,).

    Raises:
        ConfigurationError: ``start`` has the wrong shape or is not finite.
        ModelError: An MJCF cannot hold the robot.
        EngineError: MuJoCo refuses the model.
    """
    height = ground_of(model).height
    plane = f'<geom type="plane" pos="0 0 {height!r}" size="0 0 0.05" contype="0" conaffinity="{_STOPPED_BY_FLOOR}"/>'
    compiled = compile_model(model, surroundings=plane)
    collide = compiled.geom_contype != 0
    compiled.geom_contype[collide] |= _STOPPED_BY_FLOOR
    compiled.body_contype[compiled.geom_bodyid[collide]] |= _STOPPED_BY_FLOOR
    data, world = mujoco.MjData(compiled), 0
    places = [compiled.joint(joint.name).qposadr[0] for joint in model.moving_joints]
    data.qpos[places] = joint_vector(model.chain, start)
    with mujoco_warnings():
        mujoco.mj_fwdPosition(compiled, data)
    pairs = compiled.geom_bodyid[data.contact.geom]
    in_floor = pairs[(pairs == world).any(axis=1)].max(axis=1, initial=world)
    compiled.geom_contype[np.isin(compiled.geom_bodyid, in_floor)] &= ~_STOPPED_BY_FLOOR
    compiled.body_contype[in_floor] &= ~_STOPPED_BY_FLOOR
    return compiled


class Physics:
    """The simulation of one robot on the floor of its scene; not thread-safe.

    The robot is the exported MJCF without its meshes. Links that are in the floor at the start pass through it.
    Joints whose actuators are not of type ``position`` get such actuators, with dh2sim's default gains where the
    robot file gives none.
    """

    def __init__(self, model: RobotModel, q: ArrayLike, *, gravity: bool = True, drive: Drive = "position") -> None:
        """Compile a robot at rest.

        Args:
            model: The robot.
            q: Joint positions, also the targets if ``drive`` is 'position'; rad or m, shape (n,).
            gravity: Whether the gravity of the robot file acts.
            drive: What drives the joints.

        Raises:
            ConfigurationError: ``q`` has the wrong shape or is not finite.
            ModelError: An MJCF cannot hold the robot.
            EngineError: MuJoCo refuses the model.
        """
        driven = with_actuators(model, ActuatorType.POSITION)
        self._chain = model.chain
        self._model = compile_on_floor(driven, q)
        self._model.opt.disableflags |= int(
            mujoco.mjtDisableBit.mjDSBL_AUTORESET | mujoco.mjtDisableBit.mjDSBL_SENSOR
        )
        self._data, self._scratch = mujoco.MjData(self._model), mujoco.MjData(self._model)
        names = [joint.name for joint in model.moving_joints]
        self._places = np.array([self._model.joint(name).qposadr[0] for name in names], dtype=int)
        self._bodies = {link.name: int(self._model.body(link.name).id) for link in model.all_links}
        self._driven = [int(self._model.jnt_qposadr[joint]) for joint in self._model.actuator_trnid[:, 0]]
        self._speed_limit = SpeedLimit(self._model, size=model.reach)
        self._force: SpringForce | None = None
        self._targets = self._vector(q)
        self._stopped = ""
        self.set_gravity(gravity)
        self.set_drive(drive)
        self.reset(q)

    @property
    def timestep(self) -> float:
        """Length of a time step, s."""
        return float(self._model.opt.timestep)

    @property
    def time(self) -> float:
        """Simulated time since the last reset, s."""
        return float(self._data.time)

    @property
    def q(self) -> Array:
        """Joint positions, rad or m, read-only, shape (n,)."""
        return read_only(self._data.qpos[self._places])

    @property
    def qvel(self) -> Array:
        """Joint velocities, rad/s or m/s, read-only, shape (n,)."""
        return read_only(self._data.qvel[self._places])

    @property
    def stopped(self) -> str:
        """Why the simulation has stopped, a sentence; empty while it runs. ``reset`` starts it again."""
        return self._stopped

    @property
    def energy(self) -> tuple[float, float]:
        """Potential energy in the gravity that acts, and kinetic energy including the rotors, J."""
        now = self._now()
        mujoco.mj_energyPos(self._model, now)
        mujoco.mj_energyVel(self._model, now)
        return float(now.energy[0]), float(now.energy[1])

    @property
    def applied_force(self) -> tuple[Array, Array] | None:
        """Point at which a force is applied, m, and the force, N, in base_link; None without a force."""
        if self._force is None:
            return None
        now, place = self._now(), self._force.place
        point = place.position(now)
        velocity = place.jacobian(self._model, now) @ now.qvel
        return read_only(point), read_only(self._force.force_at(point, velocity))

    def reset(self, q: ArrayLike) -> None:
        """Put the robot at ``q`` at rest, with targets there and no applied force.

        Raises:
            ConfigurationError: ``q`` has the wrong shape or is not finite.
        """
        positions = self._vector(q)
        mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[:] = positions
        self._stopped = ""
        self.release()
        self.set_targets(q)

    def set_targets(self, q: ArrayLike) -> None:
        """Set the targets of the actuators, rad or m, shape (n,).

        As in the keyframes of an exported MJCF, controls are offset to balance gravity there.

        Raises:
            ConfigurationError: ``q`` has the wrong shape or is not finite.
        """
        self._targets = self._vector(q)
        self._data.ctrl[:] = self._holding_controls()

    def set_gravity(self, on: bool) -> None:
        """Switch gravity on or off."""
        self._switch(mujoco.mjtDisableBit.mjDSBL_GRAVITY, off=not on)
        self._data.ctrl[:] = self._holding_controls()

    def set_drive(self, drive: Drive) -> None:
        """Choose what drives the joints."""
        if drive not in ("position", "free"):
            raise ValueError(f"drive must be 'position' or 'free', got {drive!r}")
        self._switch(mujoco.mjtDisableBit.mjDSBL_ACTUATION, off=drive == "free")

    def drag(self, link: str, point_in_link: ArrayLike, target: ArrayLike) -> None:
        """Drag a link towards a point by a spring until ``release``; call it again when the point moves.

        Args:
            link: Name of the link.
            point_in_link: Where it was grabbed, in the link's frame, m, shape (3,).
            target: Where it is dragged to, in base_link, m, shape (3,).

        Raises:
            ConfigurationError: The link is unknown, or numbers are not three finite ones.
        """
        place = find_point(self._bodies, link, point_in_link)
        spring = drag_spring(place.effective_mass(self._model, self._now()))
        self._force = SpringForce(place=place, target=finite_vector(target, "the target"), spring=spring)

    def release(self) -> None:
        """Remove the applied force."""
        self._force = None
        self._data.qfrc_applied[:] = 0.0

    def step(self) -> None:
        """Simulate one time step, unless the simulation has stopped."""
        with quiet_engine():
            self._step()

    def advance(self, duration: float, *, time_budget_s: float = 0.05) -> float:
        """Simulate as many whole time steps as fit into a duration.

        Args:
            duration: s.
            time_budget_s: Longest computing time, s; some time steps are always made.

        Returns:
            Simulated time, s: less than ``duration`` if that is not a whole number of time steps, time ran out,
            or the simulation stopped.
        """
        deadline = time.perf_counter() + time_budget_s
        steps = int(duration / self.timestep + 1e-6)  # 0.006 / 0.002 is a little less than 3
        done = 0
        with quiet_engine():
            while done < steps and self._step():
                done += 1
                if done % STEPS_PER_CLOCK_READING == 0 and time.perf_counter() >= deadline:
                    break
        return done * self.timestep

    def _step(self) -> bool:
        """Simulate a time step; return False, and leave the state as it was, if the simulation becomes unstable."""
        if self._stopped:
            return False
        model, data = self._model, self._data
        before = data.qpos.copy(), data.qvel.copy()
        if self._force is None:
            mujoco.mj_step(model, data)
        else:
            mujoco.mj_step1(model, data)
            data.qfrc_applied[:] = joint_forces(self._force, model, data)
            mujoco.mj_step2(model, data)
        self._stopped = self._speed_limit.reason(data)
        if self._stopped:
            data.qpos[:], data.qvel[:] = before
        return not self._stopped

    def _now(self) -> mujoco.MjData:
        """Return everything that follows from the present state, without touching the simulation."""
        return self._derived(self._data.qpos, self._data.qvel)

    def _derived(self, qpos: Array, qvel: Array) -> mujoco.MjData:
        self._scratch.qpos[:], self._scratch.qvel[:] = qpos, qvel
        with mujoco_warnings():  # of a singular inertia; a simulation that it makes unstable stops
            mujoco.mj_fwdPosition(self._model, self._scratch)
            mujoco.mj_fwdVelocity(self._model, self._scratch)
        return self._scratch

    def _holding_controls(self) -> Array:
        """Return the controls that hold the robot at its targets, shape (actuators,)."""
        model = self._model
        load = self._derived(self._targets, np.zeros(model.nv)).qfrc_bias[self._driven]
        stiffness = model.actuator_gainprm[:, 0]
        offset = np.divide(load, stiffness, out=np.zeros_like(load), where=stiffness > 0.0)
        limited = model.actuator_ctrllimited.astype(bool)
        lower = np.where(limited, model.actuator_ctrlrange[:, 0], -np.inf)
        upper = np.where(limited, model.actuator_ctrlrange[:, 1], np.inf)
        return np.asarray(np.clip(self._targets[self._driven] + offset, lower, upper))

    def _vector(self, q: ArrayLike) -> Array:
        """Return a joint vector in MuJoCo's order."""
        positions = np.zeros(self._model.nq)
        positions[self._places] = joint_vector(self._chain, q)
        return positions

    def _switch(self, flag: int, *, off: bool) -> None:
        flags = int(self._model.opt.disableflags)
        self._model.opt.disableflags = flags | int(flag) if off else flags & ~int(flag)


FACTOR_WINDOW = 1.0
"""s of the wall clock over which the real-time factor is measured."""
MAX_BACKLOG = 0.1
"""s of the wall clock that are made up for at most, so that a page that was blocked does not run wild afterwards."""


class RealTime:
    """Paces a simulation by readings of a clock, which it does not read itself."""

    def __init__(self, speed: float = 1.0) -> None:
        """Wait for the first reading.

        Args:
            speed: Simulated seconds per second of the wall clock; 1 is real time.

        Raises:
            ValueError: ``speed`` is not positive.
        """
        if not speed > 0.0:
            raise ValueError(f"speed must be positive, got {speed}")
        self._speed = speed
        self._last: float | None = None
        self._owed = 0.0
        self._simulated = 0.0
        self._samples: deque[tuple[float, float]] = deque()

    @property
    def factor(self) -> float | None:
        """Simulated time over wall time in the last second; None as long as it is unknown."""
        if len(self._samples) < 2:
            return None
        (wall_0, simulated_0), (wall_1, simulated_1) = self._samples[0], self._samples[-1]
        return (simulated_1 - simulated_0) / (wall_1 - wall_0)

    def due(self, now: float) -> float:
        """Return how much to simulate, s.

        Args:
            now: Reading of the wall clock, s.
        """
        if self._last is None:
            self._last = now
            self._samples.append((now, self._simulated))
            return 0.0
        elapsed, self._last = max(now - self._last, 0.0), max(now, self._last)
        self._owed = min(self._owed + elapsed * self._speed, MAX_BACKLOG * self._speed)
        if self._last > self._samples[-1][0]:
            self._samples.append((self._last, self._simulated))
        while len(self._samples) > 2 and self._samples[1][0] <= self._last - FACTOR_WINDOW:
            self._samples.popleft()
        return self._owed

    def simulated(self, duration: float) -> None:
        """Record how much was simulated, s; may be less than was due."""
        self._simulated += duration
        self._owed -= duration

    def restart(self) -> None:
        """Forget the clock, as after a pause: the next reading is the first."""
        self._last, self._owed = None, 0.0
        self._samples.clear()
