"""What moves a robot besides its user: a simulation or a recording, a little whenever it is asked."""

from __future__ import annotations

import math
from typing import Final, Protocol

import numpy as np

from dh2sim.model.robot_model import RobotModel
from dh2sim.view.motion.physics import Drive, Physics
from dh2sim.view.motion.real_time import RealTime
from dh2sim.view.motion.replay import Replay
from dh2sim.view.state import Matrix, Mode, Pull, ViewState

PICTURES: Final = 30.0
"""A second, at most."""
_SHARE: Final = 0.5
"""Of the time between two pictures, that a simulation may take."""


class Motion(Protocol):
    """Moves the joints of one robot; not for two threads at a time."""

    mode: Mode
    pictures: float
    """A second, at most."""

    def pace(self, speed: float) -> None:
        """Say how fast; a simulation only knows real time."""

    def seek(self, share: float) -> None:
        """Go to the instant at a share of a recording, from 0 to 1."""

    def tick(self, now: float, state: ViewState) -> tuple[float, ...]:
        """Return where the joints are at a reading of the clock, s; rad and m.

        The state says whether time goes on, how many single steps were asked for, and what is pulled at.
        """

    @property
    def T_world_base_link(self) -> Matrix | None:
        """Where a recording had base_link at the last tick; None where that stands still."""

    @property
    def leaps(self) -> bool:
        """Whether the last tick left out the way there: a recording began, ended or was wound."""

    @property
    def share(self) -> float:
        """Which share of a recording is behind, from 0 to 1; 0 for a simulation."""

    @property
    def told(self) -> str:
        """What the user is told of it, a sentence or two; may be empty."""


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
        self._steps = 0
        self._pull: Pull | None = None

    def act(self, *, gravity: bool, drive: Drive) -> None:
        """Change what acts on the robot from now on; it goes on as fast as it is."""
        self.physics.set_gravity(gravity)
        self.physics.set_drive(drive)

    def pace(self, speed: float) -> None:
        """Take no notice: simulated time goes with the clock."""

    def seek(self, share: float) -> None:
        """Take no notice: nobody knows the future."""

    def tick(self, now: float, state: ViewState) -> tuple[float, ...]:
        """Simulate up to a reading of the clock, s, and return where the joints are, rad and m."""
        if state.wanted != self._targets:
            self._targets = state.wanted
            self.physics.set_targets(self._targets)
        if state.pull != self._pull:
            self._pull = state.pull
            self._pull_at(state.pull)
        if state.paused:
            self._pace.restart()
            for _ in range(state.steps - self._steps):
                self.physics.step()
        else:
            self._pace.simulated(self.physics.advance(self._pace.due(now), time_budget_s=_SHARE / PICTURES))
        self._steps = state.steps
        return tuple(self.physics.q.tolist())

    def _pull_at(self, pull: Pull | None) -> None:
        if pull is None:
            self.physics.release()
        else:
            self.physics.drag(pull.link, pull.point_in_link, pull.target)

    @property
    def T_world_base_link(self) -> Matrix | None:
        """None: base_link stands still."""
        return None

    @property
    def leaps(self) -> bool:
        """No."""
        return False

    @property
    def share(self) -> float:
        """None of it is behind: a simulation has no end."""
        return 0.0

    @property
    def told(self) -> str:
        """Why it has stopped, or how fast it goes; and how hard the mouse pulls."""
        if self.physics.stopped:
            return self.physics.stopped
        factor = self._pace.factor
        pace = "" if factor is None else f", {factor:.2f} of real time"
        return f"Simulated: {self.physics.time:.3f} s{pace}.{self._told_pull()}"

    def _told_pull(self) -> str:
        pushing = self.physics.pushing
        if self._pull is None or pushing is None:
            return ""
        return f" {self._pull.link} is pulled at with {math.hypot(*pushing[1]):.3g} N."


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
        self.leaps = True
        """Whether the last tick left out the way there."""
        self._last: float | None = None
        self._steps = 0
        self._wound = True

    def pace(self, speed: float) -> None:
        """Say how many seconds of the recording are shown in a second."""
        self.speed = speed

    def seek(self, share: float) -> None:
        """Show the instant at a share of the recording, from 0 to 1."""
        self.time = min(max(share, 0.0), 1.0) * self.duration
        self._wound = True

    def tick(self, now: float, state: ViewState) -> tuple[float, ...]:
        """Return where the joints were at the recording's time, rad and m; moves that on if it plays."""
        before = self.time
        if state.paused:
            for _ in range(state.steps - self._steps):
                self.time = self._next_instant()
        elif self._last is not None and self.duration > 0.0:
            self.time = (self.time + (now - self._last) * self.speed) % self.duration
        self.leaps, self._wound = self._wound or self.time < before, False
        self._last, self._steps = now, state.steps
        return tuple(self._replay.q_at(self._rollout, self.time).tolist())

    def _next_instant(self) -> float:
        """Return when the next positions were recorded, s; the first ones after the last."""
        times = self._replay.times(self._rollout)
        shown = int(np.abs(times - self.time).argmin())
        return float(times[(shown + 1) % len(times)])

    @property
    def T_world_base_link(self) -> Matrix | None:
        """Where base_link is; None in a run in which it does not float."""
        T = self._replay.base_at(self._rollout, self.time)
        return None if T is None else tuple(tuple(row) for row in T.tolist())

    @property
    def share(self) -> float:
        """Which share of it is behind, from 0 to 1."""
        return self.time / self.duration if self.duration > 0.0 else 0.0

    @property
    def told(self) -> str:
        """Which instant is shown, and why the rollout stopped early, if it did."""
        stopped = self._replay.stopped(self._rollout)
        return f"Rollout {self._rollout}: {self.time:.2f} of {self.duration:.2f} s. {stopped}".rstrip()
