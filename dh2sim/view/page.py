"""One browser page: its state, its queue of events, and the thread that works through them."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

from dh2sim.errors import Dh2simError
from dh2sim.view.events import Event, Tell
from dh2sim.view.motion.link_grabs import LinkGrabs
from dh2sim.view.motion.motion_source import Mover
from dh2sim.view.motion.tool_handle import ToolHandle
from dh2sim.view.panel.panel import Panel
from dh2sim.view.reduce import reduce
from dh2sim.view.robot_files import RobotFiles
from dh2sim.view.scene.camera import Watch
from dh2sim.view.scene.painter import Painter
from dh2sim.view.scene.scene import scene_of
from dh2sim.view.state import ViewState

if TYPE_CHECKING:
    import viser

    from dh2sim.view.motion.replay import Replay

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
        self.mover = Mover(lambda: self.state, self.apply, replay)
        self._files = RobotFiles(lambda: self.state, self.apply, self._hand_out, self._exchanged)
        self._queue: queue.SimpleQueue[tuple[Task, Callable[[], None] | None] | None] = queue.SimpleQueue()
        self._closed = threading.Event()
        self._painter = Painter(client.scene)
        self._handle = ToolHandle(client.scene, self.send, lambda: self.state, self.apply)
        self._watch = Watch(client.camera, lambda: self.state.model, self.send)
        self._grabs = LinkGrabs(self._painter, self.send, lambda: self.state)
        self._thread = threading.Thread(target=self._run, name=f"page-{client.client_id}", daemon=True)

    def start(self) -> None:
        """Draw, and begin to work through events."""
        self._thread.start()

    def close(self) -> None:
        """End, once what is being done is done."""
        self._closed.set()
        self._queue.put(None)

    @property
    def works(self) -> bool:
        """Whether it has not ended yet."""
        return self._thread.is_alive()

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
        self._draw()
        self._do(self.mover.open_run, None)
        with self.client.atomic():  # a panel that is built before the user's eyes moves under the mouse
            self._panel = Panel(self.client, self.send, self.state, self._files, self.mover)
            self._panel.show(self.state)
        self._show()
        while self._take():
            self._show()

    def _take(self) -> bool:
        """Work through all that is queued, or what moves the joints; false where the page is closed."""
        try:
            task = self._queue.get(timeout=self.mover.patience)
        except queue.Empty:
            self.mover.tick()
            return True
        while task is not None and not self._closed.is_set():
            self._do(*task)
            try:
                task = self._queue.get_nowait()
            except queue.Empty:
                self.mover.tick()
                return True
        return False

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
        self._draw()
        with self.client.atomic():
            self._handle.show(self.state)
            self._grabs.show(self.state)
            self._panel.show(self.state)
        self.client.flush()
        if self._queue.empty() and not self._closed.is_set():
            self._panel.settle(self.state)

    def _draw(self) -> None:
        """Send the robot, before all that takes time to be told of it."""
        with self.client.atomic():
            self._painter.draw(scene_of(self.state))
        self.client.flush()

    def _hand_out(self, name: str, content: bytes) -> None:
        """Make the browser save a file."""
        self.client.send_file_download(name, content, save_immediately=True)

    def _exchanged(self) -> None:
        """Another robot is shown: whole, and moved by nobody but the user."""
        self.mover.forget()
        self._watch.look()
