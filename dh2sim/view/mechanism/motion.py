"""How a mechanism on a page moves: driven joints by continuation, by MuJoCo in real time, or as recorded."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

import mujoco
import numpy as np

from dh2sim.errors import AssemblyError, SingularPositionError
from dh2sim.formats.mjcf.mechanism import joint_coordinates
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.kinematics.loop_closure import close_loops, closure_gaps
from dh2sim.kinematics.loop_motion import actuated_joints, driven_motion
from dh2sim.model.mechanism import MechanismModel
from dh2sim.model.variants import with_actuators, without_meshes
from dh2sim.mujoco_warnings import mujoco_warnings
from dh2sim.robot.row import ActuatorType
from dh2sim.typing import Array, read_only
from dh2sim.view.motion.motion_source import Recording

if TYPE_CHECKING:
    from dh2sim.view.motion.replay import Replay

MOST_STEPS: Final = 200
"""Of the simulation at a time; a slow machine falls behind."""
FASTEST: Final = 1e3
"""rad/s or m/s: what moves faster is unstable."""


class MechanismMotion:
    """A mechanism's configuration, and what moves it."""

    def __init__(self, model: MechanismModel) -> None:
        """Start at the assembly."""
        self.model = model
        self.driven = sorted(actuated_joints(model.spec))
        self.q: Array = model.q
        self.wanted = [float(model.q[k]) for k in self.driven]
        """Of the driven joints, rad and m."""
        self.recording: Recording | None = None
        """What is played, if anything."""
        self.paused = False
        """Whether the recording is."""
        self._steps = 0
        self._simulation: _Simulation | None = None

    def move(self, values: Mapping[int, float]) -> None:
        """Move driven joints, counted among them; the passive ones follow. What is recorded is not moved.

        Raises:
            SingularPositionError: A dead or singular position is in the way; nothing has moved then.
        """
        if self.recording is not None:
            return
        wanted = [values.get(place, value) for place, value in enumerate(self.wanted)]
        if self._simulation is None:
            self.q = driven_motion(self.model.spec, self.q, wanted)
        self.wanted = wanted

    def place(self, q: Array) -> None:
        """Go to a configuration in which the loops are closed."""
        self.q = read_only(q)
        self.wanted = [float(q[k]) for k in self.driven]
        if self._simulation is not None:
            self._simulation.start(self.q)

    @property
    def is_moving(self) -> bool:
        """Whether time goes on: MuJoCo or a recording moves it."""
        return self._simulation is not None or self.recording is not None

    def stop(self) -> None:
        """Give the driven joints back to the user, where they are.

        What is simulated is nearly closed; it is closed then, or where that fails put at the assembly.
        """
        if self.is_moving:
            self._simulation, self.recording, self.paused = None, None, False
            try:
                self.place(close_loops(self.model.tree, self.q))
            except AssemblyError:
                self.place(self.model.q)

    def simulate(self) -> None:
        """Begin to simulate, with position actuators that hold the driven joints where they are wanted."""
        self.stop()
        self._simulation = _Simulation(self.model)
        self._simulation.start(self.q)

    def play(self, replay: Replay, rollout: int) -> None:
        """Play a rollout of a run, or a trajectory, in a loop.

        Raises:
            PictureError: Positions were not recorded.
            RunError: The run cannot be read.
        """
        self.stop()
        self.recording, self.paused, self._steps = Recording(replay, rollout), False, 0

    def step(self) -> None:
        """Go on to the next recorded time; a recording that plays is paused there."""
        self.paused = True
        self._steps += 1

    def tick(self) -> float | None:
        """Advance what moves it to the present; return how far the loops are open, m, or None if nothing does.

        Raises:
            SingularPositionError: The simulation became unstable; it is at the assembly again.
        """
        if self.recording is not None:
            q = self.recording.advance(time.monotonic(), paused=self.paused, steps=self._steps)
            self.q, self.wanted = read_only(q), [float(q[k]) for k in self.driven]
        elif self._simulation is not None:
            simulated = self._simulation.advance(self.wanted)
            if simulated is None:
                self.place(self.model.q)
                raise SingularPositionError("the simulation became unstable, and starts at the assembly again")
            self.q = simulated
        else:
            return None
        return max((gap.position for gap in closure_gaps(self.model.tree, self.q)), default=0.0)


class _Simulation:
    """MuJoCo on a mechanism, in real time."""

    def __init__(self, model: MechanismModel) -> None:
        self._robot = without_meshes(with_actuators(model, ActuatorType.POSITION))
        with mujoco_warnings():
            self._model = mujoco.MjModel.from_xml_string(to_mjcf(self._robot))
        self._data = mujoco.MjData(self._model)
        self._places = [int(self._model.joint(joint.name).qposadr[0]) for joint in model.moving_joints]
        self._now = time.perf_counter()

    def start(self, q: Array) -> None:
        """Start at rest."""
        mujoco.mj_resetData(self._model, self._data)
        for name, value in joint_coordinates(self._robot, q).items():
            self._data.qpos[self._model.joint(name).qposadr[0]] = value
        self._now = time.perf_counter()

    def advance(self, wanted: list[float]) -> Array | None:
        """Simulate the time that went by; return the joint vector, None where it became unstable."""
        now = time.perf_counter()
        steps = min(MOST_STEPS, int((now - self._now) / self._model.opt.timestep))
        self._now = now
        self._data.ctrl[:] = wanted
        with mujoco_warnings():
            for _ in range(steps):
                mujoco.mj_step(self._model, self._data)
        fast = not (np.abs(self._data.qvel) < FASTEST).all()  # NaN compares false
        return None if fast else read_only(self._data.qpos[self._places])
