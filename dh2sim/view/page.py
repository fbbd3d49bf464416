"""A browser page: its state, its queue of events, and the thread that works through them."""

from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, TypeAlias

from dh2sim.errors import Dh2simError
from dh2sim.messages import bug_text, printable
from dh2sim.view.events import Event, Notify
from dh2sim.view.motion.dragging import LinkGrabs, ToolHandle
from dh2sim.view.motion.motion_source import MotionControl
from dh2sim.view.motion.row_animation import RowAnimation
from dh2sim.view.panel.panel import Panel
from dh2sim.view.reach_search import ReachSearch
from dh2sim.view.reduce import reduce
from dh2sim.view.robot_files import RobotFiles
from dh2sim.view.scene.camera import CameraWatch
from dh2sim.view.scene.painter import Painter
from dh2sim.view.scene.scene import scene_of
from dh2sim.view.state import ViewState

if TYPE_CHECKING:
    import viser

    from dh2sim.view.motion.replay import Replay

DISCONNECTED = ("on a closed connection", "Event loop is closed")
"""In messages of viser (a warning, or an error if warnings are errors) and asyncio about a browser that is gone."""

_log: Final = logging.getLogger(__name__)

Task: TypeAlias = "Event | Callable[[], None]"


def is_disconnect(error: Exception) -> bool:
    """Return whether an error only means that the browser was closed or the server stopped."""
    return any(words in str(error) for words in DISCONNECTED)


class Page:
    """Shows a state to a viser client, and changes it by events."""

    def __init__(
        self,
        client: viser.ClientHandle,
        state: ViewState,
        replay: Callable[[], Replay | None],
        disconnect: Callable[[], None],
    ) -> None:
        """Draw nothing before ``start``.

        Args:
            client: The page's viser client.
            state: The initial state.
            replay: Opens a run of the same robot, if there is one.
            disconnect: Closes the connection to the browser.
        """
        self.client = client
        self.state = state
        """Written by the page's own thread alone."""
        self.motion = MotionControl(lambda: self.state, self.apply, replay)
        self._disconnect = disconnect
        self._files = RobotFiles(lambda: self.state, self.apply, self._download, self._on_open)
        self._queue: queue.SimpleQueue[tuple[Task, Callable[[], None] | None] | None] = queue.SimpleQueue()
        self._closed = threading.Event()
        self._row_animation = RowAnimation(lambda: self.state, self.apply)
        self._painter = Painter(client.scene)
        self._handle = ToolHandle(client.scene, self.send, lambda: self.state, self.apply)
        self._camera = CameraWatch(client.camera, lambda: self.state.model, self.send)
        self._grabs = LinkGrabs(self._painter, self.send, lambda: self.state)
        self._search = ReachSearch(self.send)
        self._thread = threading.Thread(target=self._run, name=f"page-{client.client_id}", daemon=True)

    def start(self) -> None:
        """Draw, and begin to work through events."""
        self._thread.start()

    def close(self) -> None:
        """End after the present task; what is queued is dropped."""
        self._closed.set()
        self._search.close()
        self._queue.put(None)

    @property
    def is_alive(self) -> bool:
        """Whether its thread has not ended yet."""
        return self._thread.is_alive()

    def join(self, timeout: float) -> None:
        """Wait until its thread has ended, at most ``timeout`` seconds."""
        if self._thread.is_alive():
            self._thread.join(timeout)
        self._search.join(timeout)

    def send(self, task: Task, *, on_start: Callable[[], None] | None = None) -> None:
        """Queue an event or a function, from any thread; ``on_start`` is called when its turn comes."""
        self._queue.put((task, on_start))

    def _run(self) -> None:
        """Work until the page is closed, or sending shows that the browser is gone; other pages go on after a bug."""
        try:
            self._work()
        except Exception as error:
            if not is_disconnect(error):
                _log.error("dh2sim: a page was closed. %s", printable(bug_text(error)))
                self._disconnect()

    def _work(self) -> None:
        self._draw()
        self._do(self.motion.open_run, None)
        with self.client.atomic():  # a panel that grows before the user's eyes moves under the mouse
            self._panel = Panel(self.client, self.send, self.state, self._files, self.motion)
            self._panel.show(self.state)
        if self.state.planned:  # a trajectory was asked for: it plays
            self._do(lambda: self.motion.play(0), None)
        self._show()
        while self._take():
            self._show()

    def _take(self) -> bool:
        """Work through the queue, or advance the motion; return False once the page is closed."""
        try:
            task = self._queue.get(timeout=self._tick_interval)
        except queue.Empty:
            self._tick()
            return True
        while task is not None and not self._closed.is_set():
            self._do(*task)
            try:
                task = self._queue.get_nowait()
            except queue.Empty:
                self._tick()
                return True
        return False

    @property
    def _tick_interval(self) -> float | None:
        """Time until the next frame, s; None while nothing moves by itself."""
        return self.motion.tick_interval or self._row_animation.tick_interval

    def _tick(self) -> None:
        self.motion.tick()
        self._row_animation.tick()

    def _do(self, task: Task, on_start: Callable[[], None] | None) -> None:
        if on_start is not None:
            on_start()
        if not callable(task):
            self.apply(task)
            return
        try:
            task()
        except Dh2simError as error:
            self.apply(Notify(notice=str(error)))
        except Exception as error:  # the page goes on
            self.apply(Notify(notice=bug_text(error)))

    def apply(self, event: Event) -> None:
        """Apply an event at once; on the page's own thread alone."""
        self.state = reduce(self.state, event)

    def _show(self) -> None:
        self._draw()
        with self.client.atomic():
            self._handle.show(self.state)
            self._grabs.show(self.state)
            self._panel.show(self.state)
        self.client.flush()
        self._search.show(self.state)
        if self._queue.empty() and not self._closed.is_set():
            self._panel.show_slow(self.state)

    def _draw(self) -> None:
        """Send the scene first, before the panel, which takes longer."""
        with self.client.atomic():
            self._painter.draw(scene_of(self.state))
        self.client.flush()

    def _download(self, name: str, content: bytes) -> None:
        self.client.send_file_download(name, content, save_immediately=True)

    def _on_open(self) -> None:
        """Show all of another robot, moved by the user alone."""
        self.motion.drop()
        self._camera.aim()
