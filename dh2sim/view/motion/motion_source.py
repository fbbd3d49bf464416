"""What moves the joints of a page besides its user: a simulation, or a recording."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.view.events import Event, Follow, Notify, SetMode
from dh2sim.view.initial_state import is_same_file
from dh2sim.view.state import LinkDrag, Matrix, Mode, ViewState

if TYPE_CHECKING:
    from dh2sim.view.motion.physics import Drive
    from dh2sim.view.motion.replay import Replay

FRAME_RATE: Final = 30.0
"""Highest, 1/s."""
_LOAD: Final = 0.5
"""Share of the time between two frames that a simulation may take."""


class MotionSource(Protocol):
    """Moves the joints of one robot; not thread-safe."""

    def set_speed(self, speed: float) -> None:
        """Set the speed of a recording; simulations always aim at real time."""

    def seek(self, progress: float) -> None:
        """Go to a fraction of a recording, from 0 to 1."""

    def tick(self, now: float, state: ViewState) -> tuple[float, ...]:
        """Return the joint positions at a reading of the clock, s; rad and m.

        The state says whether time goes on, how many single steps were requested, and what the mouse drags.
        """

    @property
    def T_world_base_link(self) -> Matrix | None:
        """Pose of base_link at the last tick; None if it does not move."""

    @property
    def jumps(self) -> bool:
        """Whether the last tick was no motion: a recording was started, started again or searched."""

    @property
    def progress(self) -> float:
        """Fraction of a recording that has been played, from 0 to 1; 0 for a simulation."""

    @property
    def status(self) -> str:
        """A sentence or two for the user; may be empty."""


class Simulation:
    """MuJoCo, in real time if the machine is fast enough."""

    jumps: bool = False
    progress: float = 0.0
    T_world_base_link: Matrix | None = None

    def __init__(self, model: RobotModel, q: tuple[float, ...], *, gravity: bool, drive: Drive) -> None:
        """Start at ``q``, at rest.

        Raises:
            ModelError: An MJCF cannot hold the robot.
            EngineError: MuJoCo refuses the model.
        """
        from dh2sim.view.motion.physics import Physics, RealTime

        self.model = model
        self.physics = Physics(model, q, gravity=gravity, drive=drive)
        self._pace = RealTime()
        self._targets = q
        self._steps = 0
        self._drag: LinkDrag | None = None

    def set_physics(self, *, gravity: bool, drive: Drive) -> None:
        """Change what acts on the robot while it moves."""
        self.physics.set_gravity(gravity)
        self.physics.set_drive(drive)

    def set_speed(self, speed: float) -> None:
        """Do nothing: simulated time follows the clock."""

    def seek(self, progress: float) -> None:
        """Do nothing: a simulation has no end."""

    def tick(self, now: float, state: ViewState) -> tuple[float, ...]:
        """Simulate up to a reading of the clock, s, and return the joint positions, rad and m."""
        if state.commanded != self._targets:
            self._targets = state.commanded
            self.physics.set_targets(self._targets)
        if state.drag != self._drag:
            self._drag = state.drag
            self._apply_drag(state.drag)
        if state.paused:
            self._pace.restart()
            for _ in range(state.steps - self._steps):
                self.physics.step()
        else:
            self._pace.simulated(self.physics.advance(self._pace.due(now), time_budget_s=_LOAD / FRAME_RATE))
        self._steps = state.steps
        return tuple(self.physics.q.tolist())

    def _apply_drag(self, drag: LinkDrag | None) -> None:
        if drag is None:
            self.physics.release()
        else:
            self.physics.drag(drag.link, drag.point_in_link, drag.target)

    @property
    def status(self) -> str:
        """Why it has stopped, or simulated time and real-time factor; and the force of the mouse."""
        if self.physics.stopped:
            return self.physics.stopped
        factor = self._pace.factor
        speed = "" if factor is None else f", {factor:.2f} x real time"
        return f"Simulated: {self.physics.time:.3f} s{speed}.{self._drag_text()}"

    def _drag_text(self) -> str:
        applied = self.physics.applied_force
        if self._drag is None or applied is None:
            return ""
        return f" Force on {self._drag.link}: {math.hypot(*applied[1]):.3g} N."


class Recording:
    """A rollout of a run, played in a loop."""

    def __init__(self, replay: Replay, rollout: int) -> None:
        """Start at the beginning.

        Raises:
            PictureError: The rollout does not exist, or positions were not recorded.
            RunError: The run cannot be read.
        """
        self._replay = replay
        self._rollout = rollout
        self.duration = replay.duration(rollout)
        """s."""
        self.time = 0.0
        """Time that is shown, s."""
        self.speed = 1.0
        """Seconds of the recording per second."""
        self.jumps = True
        """Whether the last tick was no motion."""
        self._last: float | None = None
        self._steps = 0
        self._sought = True

    def set_speed(self, speed: float) -> None:
        """Set the seconds of the recording that are shown per second."""
        self.speed = speed

    def seek(self, progress: float) -> None:
        """Go to a fraction of the recording, from 0 to 1."""
        self.time = min(max(progress, 0.0), 1.0) * self.duration
        self._sought = True

    def tick(self, now: float, state: ViewState) -> tuple[float, ...]:
        """Advance the recording, unless paused, and return its joint positions, rad and m."""
        return tuple(self.advance(now, paused=state.paused, steps=state.steps).tolist())

    def advance(self, now: float, *, paused: bool, steps: int) -> Array:
        """Advance to a reading of the clock, s, or by the steps that were requested since; return positions."""
        before = self.time
        if paused:
            for _ in range(steps - self._steps):
                self.time = self._next_time()
        elif self._last is not None and self.duration > 0.0:
            self.time = (self.time + (now - self._last) * self.speed) % self.duration
        self.jumps, self._sought = self._sought or self.time < before, False
        self._last, self._steps = now, steps
        return self._replay.q_at(self._rollout, self.time)

    def _next_time(self) -> float:
        """Return the next recorded time, s; the first one after the last."""
        times = self._replay.times(self._rollout)
        shown = int(np.abs(times - self.time).argmin())
        return float(times[(shown + 1) % len(times)])

    @property
    def T_world_base_link(self) -> Matrix | None:
        """Pose of base_link; None in a run in which it does not move."""
        T = self._replay.base_at(self._rollout, self.time)
        return None if T is None else tuple(tuple(row) for row in T.tolist())

    @property
    def progress(self) -> float:
        """Fraction of the recording that has been played, from 0 to 1."""
        return self.time / self.duration if self.duration > 0.0 else 0.0

    @property
    def status(self) -> str:
        """The time that is shown, and why the rollout stopped early, if it did."""
        stopped = self._replay.stopped(self._rollout)
        return f"{self._replay.label(self._rollout)}: {self.time:.2f} of {self.duration:.2f} s. {stopped}".rstrip()


class MotionControl:
    """Starts and stops simulations and recordings, and lets them move the joints; used on the page's thread alone."""

    def __init__(
        self, state: Callable[[], ViewState], apply: Callable[[Event], None], replay: Callable[[], Replay | None]
    ) -> None:
        """Leave the joints to the user.

        Args:
            state: Returns the page's state.
            apply: Applies an event at once.
            replay: Opens a run of the robot that is shown now, if there is one.
        """
        self._state = state
        self._apply = apply
        self._open = replay
        self._initial = state()
        self._source: MotionSource | None = None
        self.replay: Replay | None = None
        """The run that is open, if any."""

    def open_run(self) -> None:
        """Open the run, if there is one.

        Raises:
            RunError: It cannot be read.
        """
        self.replay = self._open()

    @property
    def playable(self) -> bool:
        """Whether there is a run of the robot that is shown."""
        return self.replay is not None and is_same_file(self._state(), self._initial)

    @property
    def tick_interval(self) -> float | None:
        """Time between two frames, s; None while only the user moves the joints."""
        return None if self._source is None else 1.0 / FRAME_RATE

    @property
    def status(self) -> str:
        """What the source of the motion reports."""
        return "" if self._source is None else self._source.status

    @property
    def progress(self) -> float:
        """Fraction of the recording that has been played, from 0 to 1."""
        return 0.0 if self._source is None else self._source.progress

    def tick(self) -> None:
        """Let a simulation or recording move the joints to where they are by now."""
        if self._source is not None:
            q = self._source.tick(time.monotonic(), self._state())
            base = self._source.T_world_base_link
            self._apply(Follow(q=q, T_world_base_link=base, jumps=self._source.jumps))

    def drop(self) -> None:
        """Drop the source of a robot that is no longer shown."""
        self._source = None

    def stop(self) -> None:
        """Give the joints back to the user."""
        self._source = None
        self._apply(SetMode(mode=Mode.MANUAL))

    def simulate(self, *, gravity: bool, drive: Drive) -> None:
        """Start a simulation where the joints are."""
        self.stop()
        state = self._state()
        self._source = Simulation(state.model, state.q, gravity=gravity, drive=drive)
        self._apply(SetMode(mode=Mode.PHYSICS))

    def set_physics(self, *, gravity: bool, drive: Drive) -> None:
        """Change what acts in a running simulation."""
        if isinstance(self._source, Simulation):
            self._source.set_physics(gravity=gravity, drive=drive)

    def play(self, rollout: int) -> None:
        """Play a rollout from its beginning."""
        self.stop()
        if self.replay is None:
            return
        if not self.playable:
            self._apply(Notify(notice="The recording is of the robot opened first: return to that to play it."))
            return
        self._source = Recording(self.replay, rollout)
        self._apply(SetMode(mode=Mode.REPLAY))

    def set_speed(self, speed: float) -> None:
        """Set the speed of the recording."""
        if self._source is not None:
            self._source.set_speed(speed)

    def seek(self, progress: float) -> None:
        """Go to a fraction of the recording, from 0 to 1."""
        if self._source is not None:
            self._source.seek(progress)
