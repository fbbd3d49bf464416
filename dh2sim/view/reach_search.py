"""Computes what tool0 reaches in a thread of its own, while a page goes on."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from dh2sim.errors import ConfigurationError, Dh2simError
from dh2sim.messages import bug_text
from dh2sim.model.robot_model import RobotModel
from dh2sim.view.events import Event, FoundWorkspace, SearchWorkspace
from dh2sim.view.state import Part, ViewState

_PERIOD: Final = 0.2
"""s between reports of progress."""


class _CancelledError(Exception):
    """Nobody waits for the result any more."""


class ReachSearch:
    """Starts a search when a page shows something of the workspace, and stops it when its robot is another."""

    def __init__(self, send: Callable[[Event], None]) -> None:
        """Send events from the search's thread."""
        self._send = send
        self._wanted: tuple[RobotModel, bool] | None = None
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def show(self, state: ViewState) -> None:
        """Search what a state shows, unless it is found or being searched already; on the page's thread alone."""
        section = Part.SECTION in state.shown
        shown = section or Part.WORKSPACE in state.shown
        if not shown:
            return
        before = self._wanted
        if before is not None and before[0] is state.model and (before[1] or not section):
            return
        self.close()
        self._wanted, self._stop = (state.model, section), threading.Event()
        self._thread = threading.Thread(
            target=self._run, args=(state.model, section, self._stop), name="workspace", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Stop a search that is running, soon."""
        self._stop.set()

    def join(self, timeout: float) -> None:
        """Wait until its thread has ended, at most ``timeout`` seconds."""
        if self._thread is not None:
            self._thread.join(timeout)

    def _run(self, model: RobotModel, section: bool, stop: threading.Event) -> None:
        try:
            event = self._found(model, section, stop)
        except _CancelledError:
            return
        except Dh2simError as error:
            event = FoundWorkspace(model=model, workspace=None, note=f"The workspace cannot be computed: {error}")
        except Exception as error:  # the page goes on
            event = FoundWorkspace(model=model, workspace=None, note=bug_text(error))
        if not stop.is_set():
            self._send(event)

    def _found(self, model: RobotModel, section: bool, stop: threading.Event) -> Event:
        from dh2sim.workspace.workspace import compute_workspace

        reported = time.monotonic()

        @contextmanager
        def stage(doing: str, _what: str, total: int) -> Iterator[Callable[[int], None]]:
            done = 0

            def advance(count: int) -> None:
                nonlocal done, reported
                done += count
                if stop.is_set():
                    raise _CancelledError
                if time.monotonic() - reported > _PERIOD:
                    reported = time.monotonic()
                    self._send(SearchWorkspace(model=model, doing=doing, share=min(1.0, done / max(1, total))))

            yield advance

        self._send(SearchWorkspace(model=model, doing="sampling", share=0.0))
        try:
            found = compute_workspace(model, threads=1, section=section, stage=stage)
            return FoundWorkspace(model=model, workspace=found)
        except ConfigurationError as error:
            if not section:
                raise
            found = compute_workspace(model, threads=1, stage=stage)
            return FoundWorkspace(model=model, workspace=found, note=str(error))
