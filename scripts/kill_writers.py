"""Kill processes that write runs together, again and again, and check that nothing that was committed is ever lost.

    python scripts/kill_writers.py --kills 1000 --seed 0

Three processes at a time join a run of small blocks, in random orders that overlap, while one after the other is
killed outright (SIGKILL) at a random moment and replaced. After each kill every committed block must still be what
was written, and none may have vanished; a finished run must be byte for byte that of one process. Then the next run
begins. Ends with an error if anything is otherwise. Needs Linux or macOS.
"""

from __future__ import annotations

import argparse
import os
import random
import re
import shutil
import signal
import sys
import tempfile
import time
import traceback
from dataclasses import replace
from pathlib import Path

from dh2sim.errors import RunError
from dh2sim.model.build import build_model
from dh2sim.robot.read import load_robot
from dh2sim.simulate.block import Block, Job, simulate_block
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.prepare import prepare
from dh2sim.simulate.store.reader import damaged_blocks, open_run
from dh2sim.simulate.store.writer import RunWriter

BLOCKS, WRITERS = 24, 3
LONGEST = 0.15
"""s between two kills."""


def write(path: Path, job: Job, arrays: list[Block], seed: int) -> int:
    """Start a process that writes what is missing in a random order, and return its id."""
    child = os.fork()
    if child:
        return child
    status = 1
    try:
        order = list(range(BLOCKS))
        random.Random(seed).shuffle(order)
        with RunWriter.join(path, job.layout) as writer:
            for block in order:
                if writer.pending([block]):
                    writer.write(block, arrays[block], 0.25)
        status = 0
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(status)


def committed(path: Path) -> set[int]:
    """Return the blocks that are committed; none where there is no run yet."""
    try:
        return {*open_run(path).recorded_blocks()}
    except RunError:
        if path.exists():
            raise
        return set()


def contents(path: Path) -> dict[str, bytes]:
    """Return the files of a run, those of dead writers left out, and without the moment at which it was made."""
    files = {str(file.relative_to(path)): file.read_bytes() for file in path.rglob("*") if file.is_file()}
    return {name: data for name, data in files.items() if not re.search(r"(^|/)\.[^/]*\.partial$", name)}


def campaign(folder: Path, kills: int, seed: int) -> tuple[int, int, int]:
    """Kill writers, and return how many were killed, how many of these in a run in the making, and how many runs."""
    options = RolloutOptions(rollouts=BLOCKS, steps=8, start="random")
    job = prepare(build_model(load_robot("planar_2r")), options)
    job = replace(job, layout=replace(job.layout, block=1))
    arrays = [simulate_block(job, range(block, block + 1), threads=1) for block in range(BLOCKS)]
    reference = folder / "reference.zarr"
    assert os.waitpid(write(reference, job, arrays, 0), 0)[1] == 0
    expected, rng = contents(reference), random.Random(seed)
    killed = early = runs = 0
    while killed < kills:
        path, seen = folder / f"{runs}.zarr", set[int]()
        writers = [write(path, job, arrays, rng.randrange(2**32)) for _ in range(WRITERS)]
        while len(seen) < BLOCKS:
            time.sleep(rng.uniform(0.0, LONGEST if path.exists() else 4 * LONGEST))
            at = rng.randrange(WRITERS)
            os.kill(writers[at], signal.SIGKILL)
            status = os.waitpid(writers[at], 0)[1]
            if os.WIFSIGNALED(status):
                killed += 1
                early += not path.exists()
            elif status:
                raise AssertionError(f"a writer failed with status {status}")
            now = committed(path)
            assert now >= seen, f"blocks {sorted(seen - now)} are gone"
            seen = now
            assert not path.exists() or damaged_blocks(path) == [], "a committed block is damaged"
            writers[at] = write(path, job, arrays, rng.randrange(2**32))
        for writer in writers:
            assert os.waitpid(writer, 0)[1] == 0, "a writer failed"
        assert contents(path) == expected, "the run is not that of one process"
        shutil.rmtree(path)
        runs += 1
    return killed, early, runs


def main() -> int:
    """Run the campaign and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--kills", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    start = time.perf_counter()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        killed, early, runs = campaign(Path(folder), asked.kills, asked.seed)
    print(
        f"{killed} writers killed, {early} of them before there was a run; {runs} runs of {BLOCKS} blocks, each byte "
        f"for byte that of one process; {time.perf_counter() - start:.0f} s"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
