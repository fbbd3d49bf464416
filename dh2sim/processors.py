"""How many processors this process may use, and processes for them that do not outlive it."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from multiprocessing.process import BaseProcess

_MEMBERSHIP: Final = Path("/proc/self/cgroup")
_GROUPS: Final = Path("/sys/fs/cgroup")


def available_processors(membership: Path = _MEMBERSHIP, groups: Path = _GROUPS) -> int:
    """Return the number of processors that this process may use, at least 1.

    That is those it may run on (affinity, as batch systems set it), or fewer if its control groups have a share of
    the time of fewer, as containers do; a part of one counts as one.

    Args:
        membership: File in which Linux says which control groups the process is in.
        groups: Folder at which Linux shows them.
    """
    affinity = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    shares = [-int(-share // 1) for share in _shares(membership, groups)]
    return max(1, min([affinity, *shares]))


def _shares(membership: Path, groups: Path) -> Iterator[float]:
    """Yield how many processors' time each control group may take, where that is limited.

    Source: Linux, Documentation/admin-guide/cgroup-v2.rst (cpu.max), and scheduler/sched-bwc.rst (version 1).
    """
    try:
        lines = membership.read_text(encoding="utf-8").splitlines()
    except OSError:
        return
    for line in lines:
        _, _, rest = line.partition(":")
        controllers, _, own = rest.partition(":")
        if controllers and "cpu" not in controllers.split(","):
            continue
        root = groups / "cpu" if controllers else groups
        parts = [part for part in own.split("/") if part and part != ".."]
        for depth in range(len(parts), -1, -1):
            folder = root.joinpath(*parts[:depth])
            with suppress(OSError, ValueError):
                if controllers:
                    quota = (folder / "cpu.cfs_quota_us").read_text()
                    period = (folder / "cpu.cfs_period_us").read_text()
                else:
                    quota, period = (folder / "cpu.max").read_text().split()
                if float(period) > 0.0 and float(quota) > 0.0:  # "max" is not a number, -1 no limit
                    yield float(quota) / float(period)


def end_with_parent() -> None:
    """End this process, which a pool has started, when the one that started it is gone, even if it was killed.

    The pool's own workers would wait for tasks for ever, and whoever reads what they inherited would wait with them.
    """
    from multiprocessing import parent_process

    parent = parent_process()
    if parent is not None:
        threading.Thread(target=_end_after, args=(parent,), daemon=True).start()


def _end_after(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)
