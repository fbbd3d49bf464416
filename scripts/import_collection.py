#!/usr/bin/env python3
"""Import every URDF, xacro file and MJCF below some folders, and count what comes of it.

``python scripts/import_collection.py FOLDER... [--timeout 60] [--list OUTCOME]``. Each folder is the root of its
files: packages are found, and files included, in and below it. Of a robot with several arms each is imported. A
traceback or a file that takes too long is a defect of dh2sim, and makes the exit status 1; a refusal is none.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from dh2sim.errors import Dh2simError
from dh2sim.importing.sources import ImportOptions, import_robot

OUTCOMES = ("imported", "refused", "traceback", "too slow")
MAX_ARMS = 4
"""That are imported of one file."""
_TIP = re.compile(r"tip='([^']+)'")
_ROOT = re.compile(rb"<(robot|mujoco)[\s>]")


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What came of a file."""

    outcome: str
    message: str
    seconds: float


def robots(folder: Path) -> Iterator[Path]:
    """Yield the files below a folder that look like a robot; macros alone are none."""
    for path in sorted(folder.rglob("*")):
        if path.suffix.lower() in (".urdf", ".xacro", ".xml") and path.is_file():
            data = path.read_bytes()
            instance = (
                path.suffix != ".xacro" or b"<link" in data or re.search(rb"<xacro:(?!macro|include)\w+_", data)
            )
            if _ROOT.search(data[:100_000]) and instance:
                yield path


def attempt(path: Path, root: Path, tip: str | None = None) -> tuple[str, str]:
    """Import a file; return the outcome, and a line on it."""
    try:
        imported = import_robot(path, ImportOptions(root=root, tip=tip))
    except Dh2simError as error:
        tips = _TIP.findall(str(error)) if tip is None else ()
        for other in tips[:MAX_ARMS]:
            outcome, message = attempt(path, root, other)
            if outcome != "imported" or other == tips[:MAX_ARMS][-1]:
                return outcome, f"{message}, to {other}"
        return "refused", str(error).splitlines()[0].replace(str(root), "")
    except Exception as error:  # which is what is looked for
        return "traceback", f"{type(error).__name__}: {error}"
    return "imported", f"{len(imported.spec.rows)} rows, {imported.residual}"


def _work(pipe: Connection) -> None:
    while True:
        path, root = pipe.recv()
        pipe.send(attempt(path, root))


class Worker:
    """Imports files in a process that is ended when it takes too long."""

    def __init__(self, timeout: float) -> None:
        """Start it."""
        self._timeout = timeout
        self._start()

    def _start(self) -> None:
        context = get_context("spawn")
        self._pipe, other = context.Pipe()
        self._process = context.Process(target=_work, args=(other,), daemon=True)
        self._process.start()

    def result(self, path: Path, root: Path) -> Result:
        """Return what comes of a file."""
        begin = time.perf_counter()
        self._pipe.send((path, root))
        try:
            if self._pipe.poll(self._timeout):
                outcome, message = self._pipe.recv()
                return Result(outcome=outcome, message=message, seconds=time.perf_counter() - begin)
            outcome, message = "too slow", f"more than {self._timeout} s"
        except EOFError:
            outcome, message = "traceback", f"the process ended with {self._process.exitcode}"
        self._process.kill()
        self._start()
        return Result(outcome=outcome, message=message, seconds=time.perf_counter() - begin)

    def close(self) -> None:
        """End it."""
        self._process.kill()


def kind(message: str) -> str:
    """Return a message without names and numbers, so that equal kinds can be counted."""
    message = re.sub(r"^\S+?:\d+:\d+: (\S+: )?", "", message)
    return re.sub(r"'[^']*'|\"[^\"]*\"|<[^>]*>|[-+\d.]+(e-?\d+)?", "…", message)[:110]


def main() -> int:
    """Import everything and print the counts; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds a file [%(default)s]")
    parser.add_argument("--list", choices=OUTCOMES, help="print the files with this outcome")
    arguments = parser.parse_args()
    worker = Worker(arguments.timeout)
    total: Counter[str] = Counter()
    refusals: Counter[str] = Counter()
    for folder in arguments.folders:
        counts: Counter[str] = Counter()
        for path in robots(folder.resolve()):
            result = worker.result(path, folder.resolve())
            counts[result.outcome] += 1
            if result.outcome == "refused":
                refusals[kind(result.message)] += 1
            if result.outcome in (arguments.list, "traceback", "too slow"):
                print(f"{result.outcome}: {path} ({result.seconds:.1f} s): {result.message}", flush=True)
        print(f"{folder.name}: " + ", ".join(f"{counts[name]} {name}" for name in OUTCOMES), flush=True)
        total += counts
    worker.close()
    print("all: " + ", ".join(f"{total[name]} {name}" for name in OUTCOMES))
    for message, count in refusals.most_common(40):
        print(f"  {count:4d}  {message}")
    return 1 if total["traceback"] or total["too slow"] else 0


if __name__ == "__main__":
    sys.exit(main())
