"""What moves a robot besides its user: a simulation or a recording, a little whenever it is asked."""

from __future__ import annotations

from typing import Final, Protocol

from dh2sim.model.robot_model import RobotModel
from dh2sim.view.physics import Drive, Physics
from dh2sim.view.physics_pace import RealTime
from dh2sim.view.replay import Replay
from dh2sim.view.state import Mode, ViewState

PICTURES: Final = 30.0
"""A second, at most."""
_SHARE: Final = 0.5
"""Of the time between two pictures, that a simulation may take."""


class Motion(Protocol):
    """Moves the joints of one robot; not for two threads at a time."""

    mode: Mode
    pictures: float
    """A second, at most."""

    def pace(self, *, playing: bool, speed: float) -> None:
        """Run or stand, and how fast; a simulation only knows real time."""

    def seek(self, share: float) -> None:
        """Go to the instant at a share of a recording, from 0 to 1."""

    def tick(self, now: float, state: ViewState) -> tuple[float, ...]:
        """Return where the joints are at a reading of the clock, s; rad and m."""

    @property
    def told(self) -> str:
        """What the user is told of it, a sentence; may be empty."""


class Simulation:
    """MuJoCo, in real time where it is fast enough."""

    mode: Mode = Mode.PHYSICS
    pictures: float = PICTURES

    def __init__(self, model: RobotModel, q: tuple[float, ...], *, gravity: bool, drive: Drive) -> None:
        """Begin at ``q``, standing still.

        Raises:
            ModelError: An MJCF cannot hold the robot.
            EngineError: MuJoCo refuses the model.
        """
        self.model = model
        self.physics = Physics(model, q, gravity=gravity, drive=drive)
        self._pace = RealTime()
        self._targets = q

    def pace(self, *, playing: bool, speed: float) -> None:
        """Take no notice: simulated time goes with the clock."""

    def seek(self, share: float) -> None:
        """Take no notice: nobody knows the future."""

    def tick(self, now: float, state: ViewState) -> tuple[float, ...]:
        """Simulate up to a reading of the clock, s, and return where the joints are, rad and m."""
        if state.wanted != self._targets:
            self._targets = state.wanted
            self.physics.set_targets(self._targets)
        self._pace.simulated(self.physics.advance(self._pace.due(now), time_budget_s=_SHARE / PICTURES))
        return tuple(self.physics.q.tolist())

    @property
    def told(self) -> str:
        """Why it has stopped, or how fast it goes."""
        if self.physics.stopped:
            return self.physics.stopped
        factor = self._pace.factor
        slow = factor is not None and factor < 0.9
        pace = f", {factor:.2f} of real time" if slow else ""
        return f"Simulated: {self.physics.time:.1f} s{pace}."


class Recording:
    """A rollout of a run, played again and again."""

    mode: Mode = Mode.REPLAY
    pictures: float = PICTURES

    def __init__(self, replay: Replay, rollout: int) -> None:
        """Begin at the first instant.

        Raises:
            PictureError: There is no such rollout, or positions were not recorded.
            RunError: The run cannot be read.
        """
        self._replay = replay
        self._rollout = rollout
        self.duration = replay.duration(rollout)
        """s."""
        self.time = 0.0
        """Of the instant that is shown, s."""
        self.speed = 1.0
        """Seconds of the recording in a second."""
        self.playing = True
        self._last: float | None = None

    def pace(self, *, playing: bool, speed: float) -> None:
        """Run or stand, and how many seconds of the recording in a second."""
        self.playing, self.speed = playing, speed

    def seek(self, share: float) -> None:
        """Show the instant at a share of the recording, from 0 to 1."""
        self.time = min(max(share, 0.0), 1.0) * self.duration

    def tick(self, now: float, _state: ViewState) -> tuple[float, ...]:
        """Return where the joints were at the recording's time, rad and m; moves that on if it plays."""
        if self.playing and self._last is not None and self.duration > 0.0:
            self.time = (self.time + (now - self._last) * self.speed) % self.duration
        self._last = now
        return tuple(self._replay.q_at(self._rollout, self.time).tolist())

    @property
    def told(self) -> str:
        """Which instant is shown, and why the rollout stopped early, if it did."""
        stopped = self._replay.stopped(self._rollout)
        return f"Rollout {self._rollout}: {self.time:.2f} of {self.duration:.2f} s. {stopped}".rstrip()
