"""How the parts of ``scripts/bench`` measure time.

Targets are judged by processor time, user and system, of a process and its children: on a busy machine wall times
and their ratios are noise. Wall times are printed beside it.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

Row = tuple[str, str, str, bool | None]
"""What was measured, the figure, the target, and whether it was met."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Usage:
    """What a piece of work took."""

    cpu: float
    """Processor time, user and system, s."""
    wall: float
    """s."""
    peak: int = 0
    """Of a process: peak memory, bytes."""
    status: int = 0
    """Of a process: its exit status."""


def run_process(command: Sequence[str], environment: Mapping[str, str] | None = None) -> Usage:
    """Run a command line whose output is of no interest."""
    started = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return Usage(
        cpu=usage.ru_utime + usage.ru_stime,
        wall=time.perf_counter() - started,
        peak=usage.ru_maxrss * 1024,
        status=process.returncode,
    )


def run_python(*arguments: str, environment: Mapping[str, str] | None = None) -> Usage:
    """Run Python in a process.

    Raises:
        RuntimeError: it fails.
    """
    usage = run_process([sys.executable, *arguments], environment)
    if usage.status:
        raise RuntimeError(f"python {' '.join(arguments)} ended with exit status {usage.status}")
    return usage


def measure(work: Callable[[], object]) -> Usage:
    """Call a function in this process."""
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return Usage(cpu=time.process_time() - cpu, wall=time.perf_counter() - wall)


def best(work: Callable[[], object], repeats: int = 5) -> float:
    """Return the least processor time of several calls, s."""
    return min(measure(work).cpu for _ in range(repeats))


class Ratios:
    """Ratios of two pieces of work that are measured in turn."""

    def __init__(self) -> None:
        self._pairs: list[tuple[Usage, Usage]] = []

    def add(self, one: Usage, other: Usage) -> None:
        """Keep one by other."""
        self._pairs.append((one, other))

    @property
    def cpu(self) -> float:
        """Median of the ratios of processor time."""
        return statistics.median(one.cpu / other.cpu for one, other in self._pairs)

    @property
    def wall(self) -> float:
        """Median of the ratios of wall time."""
        return statistics.median(one.wall / other.wall for one, other in self._pairs)

    @property
    def span(self) -> str:
        """The least and the greatest ratio of processor time."""
        ratios = [one.cpu / other.cpu for one, other in self._pairs]
        return f"{min(ratios):.2f} to {max(ratios):.2f}"

    def row(self, what: str, *, most: float | None = None, least: float | None = None) -> Row:
        """Return a row with the ratio, the first one's times, and whether a target is met."""
        cpu, wall = (statistics.median(getattr(one, kind) for one, _ in self._pairs) for kind in ("cpu", "wall"))
        figure = f"{self.cpu:.2f} ({self.span}; {_time(cpu)} CPU), by wall time {self.wall:.2f} ({_time(wall)})"
        if most is not None:
            return what, figure, f"<= {most:g}", self.cpu <= most
        if least is not None:
            return what, figure, f">= {least:g}", self.cpu >= least
        return what, figure, "", None


def _time(seconds: float) -> str:
    return f"{seconds:.1f} s" if seconds >= 2.0 else f"{seconds * 1e3:.0f} ms"
