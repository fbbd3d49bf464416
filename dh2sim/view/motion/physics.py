"""A robot that moves by the laws of mechanics, a little at a time: MuJoCo on what ``dh2sim export`` writes.

When a simulation has become unstable: positions or speeds that no time step can follow.
"""

from __future__ import annotations

import time
from typing import Literal, TypeAlias

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import with_actuators
from dh2sim.robot.spec import ActuatorType
from dh2sim.simulate.mujoco_runtime import quiet_engine
from dh2sim.typing import Array, read_only
from dh2sim.validate.motion.free_motion import compile_model
from dh2sim.view.motion.applied_force import Drag, Grip, Push, find_place, joint_forces, spring_for, vector
from dh2sim.view.motion.joint_vector import joint_vector


class SpeedLimit:
    """Looks at the state after every time step."""

    def __init__(self, model: mujoco.MjModel, *, size: float) -> None:
        """Choose the limits.

        A joint that turns by more than 1 rad within a time step, or slides by more than the size of the robot, is not
        simulated any more: forces change faster than the steps see.

        Args:
            model: the compiled robot; its base stands still.
            size: of the robot, m.
        """
        turns = model.jnt_type == mujoco.mjtJoint.mjJNT_HINGE
        step = float(model.opt.timestep)
        self._names = [model.joint(i).name for i in range(model.njnt)]
        self._units = ["rad/s" if turn else "m/s" for turn in turns]
        self._most = np.where(turns, 1.0, max(size, 1.0)) / step

    def reason(self, data: mujoco.MjData) -> str:
        """Return what is wrong with a state, a sentence; empty if nothing is."""
        good = np.isfinite(data.qpos) & (np.abs(data.qvel) <= self._most)  # what is not finite is not less
        if good.all():
            return ""
        worst = int(np.argmin(good))
        speed, unit = abs(float(data.qvel[worst])), self._units[worst]
        moves = f"moves at {speed:.3g} {unit}" if np.isfinite(speed) else "moves at no finite speed"
        if speed <= self._most[worst]:
            moves = "has no finite position"
        return (
            f"The simulation became unstable at {float(data.time):.3f} s: {self._names[worst]} {moves}; "
            f"up to {self._most[worst]:.3g} {unit} can be simulated."
        )


Drive: TypeAlias = Literal["position", "free"]
"""'position': actuators hold the joints at their targets; 'free': nothing drives them."""

BETWEEN_LOOKS = 16
"""Time steps between two looks at the clock."""


class Physics:
    """The simulation of one robot; must not be used by two threads at a time.

    The robot is the exported MJCF without its meshes. Joints whose actuators are not of type ``position`` get such
    ones, with the gains that dh2sim chooses where a robot file gives none.
    """

    def __init__(self, model: RobotModel, q: ArrayLike, *, gravity: bool = True, drive: Drive = "position") -> None:
        """Compile a robot and let it stand still.

        Args:
            model: the robot.
            q: where its joints are, and are held if ``drive`` is 'position'; rad or m, shape (n,).
            gravity: whether the gravity of the robot file acts.
            drive: what drives the joints.

        Raises:
            ConfigurationError: ``q`` has the wrong shape or is not finite.
            ModelError: an MJCF cannot hold the robot.
            EngineError: MuJoCo refuses the model.
        """
        driven = with_actuators(model, ActuatorType.POSITION)
        self._chain = model.chain
        self._model = compile_model(driven)
        self._model.opt.disableflags |= int(
            mujoco.mjtDisableBit.mjDSBL_AUTORESET | mujoco.mjtDisableBit.mjDSBL_SENSOR
        )
        self._data, self._scratch = mujoco.MjData(self._model), mujoco.MjData(self._model)
        names = [joint.name for joint in model.moving_joints]
        self._places = np.array([self._model.joint(name).qposadr[0] for name in names], dtype=int)
        self._bodies = {link.name: int(self._model.body(link.name).id) for link in model.all_links}
        self._driven = [int(self._model.jnt_qposadr[joint]) for joint in self._model.actuator_trnid[:, 0]]
        self._stop = SpeedLimit(self._model, size=model.reach)
        self._grip: Grip | None = None
        self._targets = self._vector(q)
        self._stopped = ""
        self.set_gravity(gravity)
        self.set_drive(drive)
        self.reset(q)

    @property
    def timestep(self) -> float:
        """How much one time step simulates, s."""
        return float(self._model.opt.timestep)

    @property
    def time(self) -> float:
        """Simulated since the last reset, s."""
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
        """Why the simulation has stopped, a sentence; empty while it goes on. ``reset`` lets it begin anew."""
        return self._stopped

    @property
    def energy(self) -> tuple[float, float]:
        """Potential energy in the gravity that acts, and kinetic energy with that of the rotors, J."""
        now = self._now()
        mujoco.mj_energyPos(self._model, now)
        mujoco.mj_energyVel(self._model, now)
        return float(now.energy[0]), float(now.energy[1])

    @property
    def pushing(self) -> tuple[Array, Array] | None:
        """The point that is pushed or dragged, m, and the force on it, N, in base_link; None if none is."""
        if self._grip is None:
            return None
        now, place = self._now(), self._grip.place
        point = place.position(now)
        velocity = place.jacobian(self._model, now) @ now.qvel
        return read_only(point), read_only(self._grip.force_at(point, velocity))

    def reset(self, q: ArrayLike) -> None:
        """Stand still at ``q``, held there if joints are driven; what pushed is gone.

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
        """Hold the joints at ``q``, rad or m, shape (n,), as soon as they are driven.

        As in the keyframes of an exported MJCF, actuators pull a little harder to balance gravity there.

        Raises:
            ConfigurationError: ``q`` has the wrong shape or is not finite.
        """
        self._targets = self._vector(q)
        self._data.ctrl[:] = self._holding()

    def set_gravity(self, on: bool) -> None:
        """Let gravity act, or not."""
        self._switch(mujoco.mjtDisableBit.mjDSBL_GRAVITY, off=not on)
        self._data.ctrl[:] = self._holding()

    def set_drive(self, drive: Drive) -> None:
        """Let actuators hold the joints at their targets, or nothing drive them."""
        if drive not in ("position", "free"):
            raise ValueError(f"drive must be 'position' or 'free', got {drive!r}")
        self._switch(mujoco.mjtDisableBit.mjDSBL_ACTUATION, off=drive == "free")

    def push(self, link: str, point_in_link: ArrayLike, force: ArrayLike) -> None:
        """Push a link from now until ``release``.

        Args:
            link: its name.
            point_in_link: where, in the link's frame, m, shape (3,).
            force: N, in base_link's axes, whichever way the link turns, shape (3,).

        Raises:
            ConfigurationError: there is no such link, or numbers are not three finite ones.
        """
        place = find_place(self._bodies, link, point_in_link)
        self._grip = Push(place=place, force=vector(force, "the force"))

    def drag(self, link: str, point_in_link: ArrayLike, target: ArrayLike) -> None:
        """Pull a link towards a point by a spring, from now until ``release``; call it again when the point moves.

        Args:
            link: its name.
            point_in_link: where it was grabbed, in the link's frame, m, shape (3,).
            target: where it is dragged to, in base_link, m, shape (3,).

        Raises:
            ConfigurationError: there is no such link, or numbers are not three finite ones.
        """
        place = find_place(self._bodies, link, point_in_link)
        spring = spring_for(place.mass(self._model, self._now()))
        self._grip = Drag(place=place, target=vector(target, "the target"), spring=spring)

    def release(self) -> None:
        """Neither push nor drag any more."""
        self._grip = None
        self._data.qfrc_applied[:] = 0.0

    def step(self) -> None:
        """Simulate one time step, unless the simulation has stopped."""
        with quiet_engine():
            self._step()

    def advance(self, duration: float, *, time_budget_s: float = 0.05) -> float:
        """Simulate as many whole time steps as fit.

        Args:
            duration: how much to simulate, s.
            time_budget_s: how long that may take, s; some time steps are always made.

        Returns:
            How much was simulated, s: less where a part of a time step is left over, time ran out, or the simulation
            stopped.
        """
        deadline = time.perf_counter() + time_budget_s
        steps = int(duration / self.timestep + 1e-6)  # 0.006 / 0.002 is a little less than 3
        done = 0
        with quiet_engine():
            while done < steps and self._step():
                done += 1
                if done % BETWEEN_LOOKS == 0 and time.perf_counter() >= deadline:
                    break
        return done * self.timestep

    def _step(self) -> bool:
        """Simulate one time step; tell whether it could be."""
        if self._stopped:
            return False
        model, data = self._model, self._data
        before = data.qpos.copy(), data.qvel.copy()
        if self._grip is None:
            mujoco.mj_step(model, data)
        else:
            mujoco.mj_step1(model, data)
            data.qfrc_applied[:] = joint_forces(self._grip, model, data)
            mujoco.mj_step2(model, data)
        self._stopped = self._stop.reason(data)
        if self._stopped:
            data.qpos[:], data.qvel[:] = before
        return not self._stopped

    def _now(self) -> mujoco.MjData:
        """Return what follows from the present positions and velocities, without touching the simulation."""
        return self._derived(self._data.qpos, self._data.qvel)

    def _derived(self, qpos: Array, qvel: Array) -> mujoco.MjData:
        self._scratch.qpos[:], self._scratch.qvel[:] = qpos, qvel
        mujoco.mj_fwdPosition(self._model, self._scratch)
        mujoco.mj_fwdVelocity(self._model, self._scratch)
        return self._scratch

    def _holding(self) -> Array:
        """Controls with which the robot stands still at its targets, shape (actuators,)."""
        model = self._model
        load = self._derived(self._targets, np.zeros(model.nv)).qfrc_bias[self._driven]
        stiffness = model.actuator_gainprm[:, 0]
        more = np.divide(load, stiffness, out=np.zeros_like(load), where=stiffness > 0.0)
        limited = model.actuator_ctrllimited.astype(bool)
        lower = np.where(limited, model.actuator_ctrlrange[:, 0], -np.inf)
        upper = np.where(limited, model.actuator_ctrlrange[:, 1], np.inf)
        return np.asarray(np.clip(self._targets[self._driven] + more, lower, upper))

    def _vector(self, q: ArrayLike) -> Array:
        """Return a joint vector in the order of MuJoCo."""
        positions = np.zeros(self._model.nq)
        positions[self._places] = joint_vector(self._chain, q)
        return positions

    def _switch(self, flag: int, *, off: bool) -> None:
        flags = int(self._model.opt.disableflags)
        self._model.opt.disableflags = flags | int(flag) if off else flags & ~int(flag)
