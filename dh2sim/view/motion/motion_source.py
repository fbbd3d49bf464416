"""Who moves the joints of a page: its user, a simulation, or a recording."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from dh2sim.view.events import Event, Follow, SetMode, Tell
from dh2sim.view.initial_state import is_same_file
from dh2sim.view.state import Mode, ViewState

if TYPE_CHECKING:
    from dh2sim.view.motion.motion import Motion
    from dh2sim.view.motion.physics import Drive
    from dh2sim.view.motion.replay import Replay


class Mover:
    """Begins and ends simulations and recordings, and lets them move the joints; of the page's own thread alone."""

    def __init__(
        self, state: Callable[[], ViewState], apply: Callable[[Event], None], replay: Callable[[], Replay | None]
    ) -> None:
        """Leave the joints to the user.

        Args:
            state: Returns the page's state.
            apply: Lets an event happen now.
            replay: Opens a run of the robot that is shown now, if there is one.
        """
        self._state = state
        self._apply = apply
        self._open = replay
        self._opened = state()
        self._motion: Motion | None = None
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
        """Whether there is a run to be played, and its robot is shown."""
        return self.replay is not None and is_same_file(self._state(), self._opened)

    @property
    def patience(self) -> float | None:
        """How long the next picture may take to come, s; None where only the user moves the joints."""
        return None if self._motion is None else 1.0 / self._motion.pictures

    @property
    def told(self) -> str:
        """What there is to tell of what moves the joints."""
        return "" if self._motion is None else self._motion.told

    @property
    def share(self) -> float:
        """Which share of the recording is behind, from 0 to 1."""
        return 0.0 if self._motion is None else self._motion.share

    def tick(self) -> None:
        """Let a simulation or recording move the joints to where they are by now."""
        if self._motion is not None:
            q = self._motion.tick(time.monotonic(), self._state())
            base = self._motion.T_world_base_link
            self._apply(Follow(q=q, T_world_base_link=base, leaps=self._motion.leaps))

    def forget(self) -> None:
        """Drop what moves the joints of a robot that is no longer shown."""
        self._motion = None

    def be_still(self) -> None:
        """Give the joints back to the user."""
        self._motion = None
        self._apply(SetMode(mode=Mode.STILL))

    def simulate(self, *, gravity: bool, drive: Drive) -> None:
        """Begin a simulation where the joints are."""
        from dh2sim.view.motion.motion import Simulation

        self.be_still()
        state = self._state()
        self._motion = Simulation(state.model, state.q, gravity=gravity, drive=drive)
        self._apply(SetMode(mode=Mode.PHYSICS))

    def act(self, *, gravity: bool, drive: Drive) -> None:
        """Change what acts in the simulation from now on, if there is one."""
        from dh2sim.view.motion.motion import Simulation

        if isinstance(self._motion, Simulation):
            self._motion.act(gravity=gravity, drive=drive)

    def play(self, rollout: int) -> None:
        """Play a rollout from its beginning."""
        from dh2sim.view.motion.motion import Recording

        self.be_still()
        if self.replay is None:
            return
        if not self.playable:
            told = "The recording is one of the robot that was opened at first: go back to that."
            self._apply(Tell(notice=told))
            return
        self._motion = Recording(self.replay, rollout)
        self._apply(SetMode(mode=Mode.REPLAY))

    def pace(self, speed: float) -> None:
        """Say how fast the recording is played."""
        if self._motion is not None:
            self._motion.pace(speed)

    def seek(self, share: float) -> None:
        """Show the instant at a share of the recording, from 0 to 1."""
        if self._motion is not None:
            self._motion.seek(share)
