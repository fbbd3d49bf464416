"""One browser page: its state, its queue of events, and the thread that works through them."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

from dh2sim.errors import Dh2simError
from dh2sim.export.render import Format
from dh2sim.view.downloads import model_file
from dh2sim.view.events import Compare, Event, Follow, ReplaceText, SetMode, Tell
from dh2sim.view.link_grabs import LinkGrabs
from dh2sim.view.opening import builtin_ghost
from dh2sim.view.painter import Painter
from dh2sim.view.panel.files import FileActions
from dh2sim.view.panel.panel import Panel
from dh2sim.view.reduce import reduce
from dh2sim.view.scene import scene_of
from dh2sim.view.state import Mode, ViewState
from dh2sim.view.tool_handle import ToolHandle

if TYPE_CHECKING:
    import viser

    from dh2sim.view.motion import Motion
    from dh2sim.view.physics import Drive
    from dh2sim.view.replay import Replay

GONE = ("on a closed connection", "Event loop is closed")
"""In what viser and asyncio say where a browser is gone: a warning (an error where warnings are), and an error."""

Task: TypeAlias = "Event | Callable[[], None]"


def says_that_nobody_is_there(error: Exception) -> bool:
    """Whether an error only says that the browser was closed, or the server stopped."""
    return any(words in str(error) for words in GONE)


class Page:
    """Shows a state to one viser client, and changes it as events come."""

    def __init__(self, client: viser.ClientHandle, state: ViewState, replay: Callable[[], Replay | None]) -> None:
        """Draw nothing until ``start``.

        Args:
            client: The page's viser client.
            state: To begin with.
            replay: Opens a run of the same robot that can be played, if there is one.
        """
        self.client = client
        self.state = state
        """Of the page's own thread; others may read it."""
        self.replay: Replay | None = None
        self._open_replay = replay
        self._opened = state.text
        self._motion: Motion | None = None
        self._queue: queue.SimpleQueue[tuple[Task, Callable[[], None] | None] | None] = queue.SimpleQueue()
        self._painter = Painter(client.scene)
        self._handle = ToolHandle(client.scene, self.send, lambda: self.state, self.apply)
        self._grabs = LinkGrabs(self._painter, self.send, lambda: self.state)
        self._thread = threading.Thread(target=self._run, name=f"page-{client.client_id}", daemon=True)

    def start(self) -> None:
        """Draw, and begin to work through events."""
        self._thread.start()

    def close(self) -> None:
        """End, once what is queued is done."""
        self._queue.put(None)

    def join(self, patience: float) -> None:
        """Wait until it has ended, for so many seconds at most."""
        if self._thread.is_alive():
            self._thread.join(patience)

    def send(self, task: Task, *, seen: Callable[[], None] | None = None) -> None:
        """Queue an event, or something to do in its turn; from any thread."""
        self._queue.put((task, seen))

    def _run(self) -> None:
        """Work, until the page is closed; a browser that is gone may be noticed while something is sent to it."""
        try:
            self._work()
        except (UserWarning, RuntimeError) as error:
            if not says_that_nobody_is_there(error):
                raise

    def _work(self) -> None:
        """Draw; then wait for events, and draw what came of them."""
        with self.client.atomic():
            self._painter.draw(scene_of(self.state))
        self._do(self._open_run, None)
        files = FileActions(save=self.save, export=self.export, back=self.back)
        self._panel = Panel(self.client, self.send, self.state, files, self, self.compare)
        self._show()
        while self._take():
            self._show()

    def _open_run(self) -> None:
        self.replay = self._open_replay()

    def _take(self) -> bool:
        """Work through all that is queued, or what moves the joints; false where the page is closed."""
        try:
            task = self._queue.get(timeout=None if self._motion is None else 1.0 / self._motion.pictures)
        except queue.Empty:
            self._tick()
            return True
        while task is not None:
            self._do(*task)
            try:
                task = self._queue.get_nowait()
            except queue.Empty:
                self._tick()
                return True
        return False

    def _tick(self) -> None:
        """Let what moves the joints move them."""
        if self._motion is not None:
            self.apply(Follow(q=self._motion.tick(time.monotonic(), self.state)))

    def _do(self, task: Task, seen: Callable[[], None] | None) -> None:
        if seen is not None:
            seen()
        if not callable(task):
            self.apply(task)
            return
        try:
            task()
        except Dh2simError as error:
            self.apply(Tell(notice=str(error)))
        except Exception as error:  # the page goes on, and says that it should be told of
            self.apply(Tell(notice=f"This is a defect of dh2sim, please report it: {type(error).__name__}: {error}"))

    def apply(self, event: Event) -> None:
        """Let an event happen now; from the page's own thread alone."""
        self.state = reduce(self.state, event)

    def _show(self) -> None:
        with self.client.atomic():
            self._painter.draw(scene_of(self.state))
        self._handle.show(self.state)
        self._grabs.show(self.state)
        self._panel.show(self.state)
        self.client.flush()
        if self._queue.empty():
            self._panel.settle(self.state)

    def save(self) -> None:
        """Hand out the robot file as it is edited."""
        name = f"{self.state.spec.name}.yaml"
        self.client.send_file_download(name, self.state.text.encode(), save_immediately=True)

    def export(self, wanted: Format) -> None:
        """Hand out a model, compared with the table before."""
        made = model_file(self.state.model, wanted)
        self.client.send_file_download(made.name, made.data, save_immediately=True)
        self.apply(Tell(notice=f"{made.name}: {made.summary}."))

    def back(self) -> None:
        """Return to the robot file that was opened."""
        self.apply(ReplaceText(text=self._opened))

    def compare(self, robot: str) -> None:
        """Draw a robot that comes with dh2sim beside the one that is shown."""
        self.apply(Compare(ghost=builtin_ghost(robot)))

    @property
    def motion_told(self) -> str:
        """What there is to tell of what moves the joints."""
        return "" if self._motion is None else self._motion.told

    @property
    def motion_share(self) -> float:
        """Which share of the recording is behind, from 0 to 1."""
        return 0.0 if self._motion is None else self._motion.share

    def be_still(self) -> None:
        """Give the joints back to the user."""
        self._motion = None
        self.apply(SetMode(mode=Mode.STILL))

    def simulate(self, *, gravity: bool, drive: Drive) -> None:
        """Begin a simulation where the joints are."""
        from dh2sim.view import motion

        self.be_still()
        self._motion = motion.Simulation(self.state.model, self.state.q, gravity=gravity, drive=drive)
        self.apply(SetMode(mode=Mode.PHYSICS))

    def play(self, rollout: int) -> None:
        """Play a rollout from its beginning."""
        from dh2sim.view import motion

        self.be_still()
        if self.replay is not None:
            self._motion = motion.Recording(self.replay, rollout)
            self.apply(SetMode(mode=Mode.REPLAY))

    def pace(self, speed: float) -> None:
        """Say how fast the recording is played."""
        if self._motion is not None:
            self._motion.pace(speed)

    def seek(self, share: float) -> None:
        """Show the instant at a share of the recording, from 0 to 1."""
        if self._motion is not None:
            self._motion.seek(share)
