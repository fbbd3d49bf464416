"""Real time: how much to simulate whenever there is an opportunity, and how fast simulated time really goes."""

from __future__ import annotations

from collections import deque

WINDOW = 1.0
"""s of the wall clock over which the factor is measured."""
MOST_WAIT = 0.1
"""s of the wall clock: what was missed beyond it is not made up for. A page that hangs must not run wild after it."""


class RealTime:
    """Paces a simulation by readings of a clock; it reads none itself."""

    def __init__(self, speed: float = 1.0) -> None:
        """Begin with the first reading.

        Args:
            speed: simulated seconds that a second of the wall clock should take; 1 is real time.

        Raises:
            ValueError: ``speed`` is not positive.
        """
        if not speed > 0.0:
            raise ValueError(f"speed must be positive, got {speed}")
        self._speed = speed
        self._last: float | None = None
        self._owed = 0.0
        self._simulated = 0.0
        self._seen: deque[tuple[float, float]] = deque()

    @property
    def factor(self) -> float | None:
        """Simulated time over wall time in the last second; None before there is anything to tell."""
        if len(self._seen) < 2:
            return None
        (wall_0, simulated_0), (wall_1, simulated_1) = self._seen[0], self._seen[-1]
        return (simulated_1 - simulated_0) / (wall_1 - wall_0)

    def due(self, now: float) -> float:
        """Return how much to simulate, s.

        Args:
            now: the wall clock's reading, s.
        """
        if self._last is None:
            self._last = now
            self._seen.append((now, self._simulated))
            return 0.0
        elapsed, self._last = max(now - self._last, 0.0), max(now, self._last)
        self._owed = min(self._owed + elapsed * self._speed, MOST_WAIT * self._speed)
        if self._last > self._seen[-1][0]:
            self._seen.append((self._last, self._simulated))
        while len(self._seen) > 2 and self._seen[1][0] <= self._last - WINDOW:
            self._seen.popleft()
        return self._owed

    def simulated(self, duration: float) -> None:
        """Note how much was simulated, s: less than was due where a time step is left over, or time ran out."""
        self._simulated += duration
        self._owed -= duration

    def restart(self) -> None:
        """Forget the clock, as after a pause: the next reading is the first."""
        self._last, self._owed = None, 0.0
        self._seen.clear()
