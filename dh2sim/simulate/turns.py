"""Groups of rollouts that are simulated at the same time, each by a thread of its own.

MuJoCo can also step one batch with several threads. Where a controller is asked before every step, those threads have
nothing to do meanwhile, and spin: two of them take an eighth more processor time, and a sixth more time, than two
groups with a thread each, which ask their controllers in turn.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor


class Turns:
    """Lets one thread at a time run Python, and all of them MuJoCo."""

    def __init__(self, workers: int) -> None:
        """Begin with nobody's turn; with one worker, it is always the caller's."""
        self._workers = workers
        self._turn = threading.Lock() if workers > 1 else None
        self._stopped = False

    def run(self, works: Sequence[Callable[[], None]]) -> Generator[None, None, None]:
        """Do some work, and yield when the first piece is done, then the second, and so on.

        When the iterator is closed, what is not done yet is stopped.

        Args:
            works: Called in any order.

        Raises:
            BaseException: What the first piece raises that fails.
        """
        if self._turn is None:
            for work in works:
                work()
                yield
            return
        with ThreadPoolExecutor(self._workers, thread_name_prefix="rollouts") as pool:
            try:
                for future in [pool.submit(self._in_turn, self._turn, work) for work in works]:
                    future.result()
                    yield
            finally:
                self._stopped = True

    def _in_turn(self, turn: threading.Lock, work: Callable[[], None]) -> None:
        with turn:
            self._check()
            work()

    def __enter__(self) -> None:
        """Let other threads run Python."""
        if self._turn is not None:
            self._turn.release()

    def __exit__(self, *raised: object) -> None:
        """Wait for the next turn."""
        if self._turn is not None:
            self._turn.acquire()
            self._check()

    def _check(self) -> None:
        if self._stopped:
            raise _StoppedError


class _StoppedError(Exception):
    """Ends a thread whose work is no longer wanted."""
