"""Kill processes that write runs together, again and again, and check that nothing that was committed is ever lost.

    python scripts/kill_writers.py --kills 1000 --seed 0
    python scripts/kill_writers.py --kills 200 --objects      in a bucket of a server on this machine

Three processes at a time join a run of small blocks, in random orders that overlap, while one after the other is
killed outright (SIGKILL) at a random moment and replaced. After each kill every committed block must still be what
was written, and none may have vanished; a finished run must be byte for byte that of one process. Then the next run
begins. Ends with an error if anything is otherwise. Needs Linux or macOS; for objects the extra ``s3``, ``moto``,
``flask`` and ``flask-cors``.
"""

from __future__ import annotations

import argparse
import logging
import multiprocessing
import os
import random
import re
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from dh2sim.errors import RunError
from dh2sim.model.build import build_model
from dh2sim.robot.read import load_robot
from dh2sim.simulate.block import Block, simulate_block
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.prepare import prepare
from dh2sim.simulate.store.places import open_store
from dh2sim.simulate.store.reader import damaged_blocks, open_run
from dh2sim.simulate.store.writer import RunWriter

BLOCKS, WRITERS = 24, 3
LONGEST = 0.15
"""s between two kills."""
START = multiprocessing.get_context("forkserver")
"""How writers start: of a process without threads, which a client of an object store has."""
BUCKET = "rollouts"


class Folders:
    """Runs in folders."""

    def __init__(self, root: Path) -> None:
        self._root = root

    def place(self, name: str) -> str:
        """Return where the run of a name is."""
        return str(self._root / name)

    def exists(self, place: str) -> bool:
        """Return whether there is anything."""
        return Path(place).exists()

    def contents(self, place: str) -> dict[str, bytes]:
        """Return the files of a run, those that dead writers left half written excepted."""
        path = Path(place)
        files = {str(file.relative_to(path)): file.read_bytes() for file in path.rglob("*") if file.is_file()}
        return {name: data for name, data in files.items() if not re.search(r"(^|/)\.[^/]*\.partial$", name)}

    def remove(self, place: str) -> None:
        """Delete a run."""
        shutil.rmtree(place)


class Bucket:
    """Runs in a bucket of a server on this machine."""

    def __init__(self, client: Any) -> None:
        self._client = client

    def place(self, name: str) -> str:
        """Return where the run of a name is."""
        return f"s3://{BUCKET}/{name}"

    def exists(self, place: str) -> bool:
        """Return whether there is anything."""
        return open_store(place).exists()

    def contents(self, place: str) -> dict[str, bytes]:
        """Return the objects of a run."""
        prefix = f"{place.removeprefix(f's3://{BUCKET}/')}/"
        read = self._client.get_object
        return {key.removeprefix(prefix): read(Bucket=BUCKET, Key=key)["Body"].read() for key in self._keys(prefix)}

    def remove(self, place: str) -> None:
        """Delete a run."""
        for key in self._keys(f"{place.removeprefix(f's3://{BUCKET}/')}/"):
            self._client.delete_object(Bucket=BUCKET, Key=key)

    def _keys(self, prefix: str) -> list[str]:
        pages = self._client.get_paginator("list_objects_v2").paginate(Bucket=BUCKET, Prefix=prefix)
        return [each["Key"] for page in pages for each in page.get("Contents", [])]


@contextmanager
def bucket() -> Iterator[Bucket]:
    """Serve a bucket on this machine, and set the variables by which clients find it."""
    import boto3
    from moto.server import ThreadedMotoServer

    logging.getLogger("werkzeug").setLevel(logging.ERROR)  # else it prints every request
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    own = {"ACCESS_KEY_ID": "test", "SECRET_ACCESS_KEY": "test", "REGION": "us-east-1"}
    os.environ |= {f"AWS_{name}": value for name, value in own.items()}
    os.environ["AWS_ENDPOINT_URL"] = f"http://{host}:{port}"
    client = boto3.client("s3", region_name="us-east-1")
    client.create_bucket(Bucket=BUCKET)
    try:
        yield Bucket(client)
    finally:
        server.stop()


def write(place: str, layout: Layout, arrays: list[Block], seed: int) -> None:
    """Write what is missing in a random order."""
    order = list(range(BLOCKS))
    random.Random(seed).shuffle(order)
    with RunWriter.join(place, layout) as writer:
        for block in order:
            if writer.pending([block]):
                writer.write(block, arrays[block], 0.25)


def committed(runs: Folders | Bucket, place: str) -> set[int]:
    """Return the blocks that are committed; none where there is no run yet."""
    try:
        return {*open_run(place).recorded_blocks()}
    except RunError:
        if isinstance(runs, Folders) and runs.exists(place):  # in a bucket there is a moment between its objects
            raise
        return set()


def campaign(runs: Folders | Bucket, kills: int, seed: int) -> tuple[int, int, int]:
    """Kill writers, and return how many were killed, how many of these in a run in the making, and how many runs."""
    options = RolloutOptions(rollouts=BLOCKS, steps=8, start="random")
    job = prepare(build_model(load_robot("planar_2r")), options)
    layout = replace(job.layout, block=1)
    job = replace(job, layout=layout)
    arrays = [simulate_block(job, range(block, block + 1), threads=1) for block in range(BLOCKS)]
    rng = random.Random(seed)

    def started(place: str) -> BaseProcess:
        writer = START.Process(target=write, args=(place, layout, arrays, rng.randrange(2**32)))
        writer.start()
        return writer

    reference = started(runs.place("reference.zarr"))
    reference.join()
    assert reference.exitcode == 0
    expected = runs.contents(runs.place("reference.zarr"))
    killed = early = finished = 0
    while killed < kills:
        place, seen = runs.place(f"{finished}.zarr"), set[int]()
        writers = [started(place) for _ in range(WRITERS)]
        while len(seen) < BLOCKS:
            time.sleep(rng.uniform(0.0, LONGEST if runs.exists(place) else 4 * LONGEST))
            at = rng.randrange(WRITERS)
            writers[at].kill()
            writers[at].join()
            if writers[at].exitcode == -signal.SIGKILL:
                killed += 1
                early += not runs.exists(place)
            elif writers[at].exitcode:
                raise AssertionError(f"a writer failed with status {writers[at].exitcode}")
            now = committed(runs, place)
            assert now >= seen, f"blocks {sorted(seen - now)} are gone"
            if now and (isinstance(runs, Folders) or killed % 4 == 0):  # to read all of a bucket's takes its time
                assert damaged_blocks(place) == [], "a committed block is damaged"
            seen = now
            writers[at] = started(place)
        for writer in writers:
            writer.join()
            assert writer.exitcode == 0, "a writer failed"
        assert runs.contents(place) == expected, "the run is not that of one process"
        runs.remove(place)
        finished += 1
    return killed, early, finished


def main() -> int:
    """Run the campaign and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--kills", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--objects", action="store_true", help="in a bucket, not in folders")
    asked = parser.parse_args()
    os.environ["PYTHONWARNINGS"] = (
        "ignore::UserWarning:multiprocessing.resource_tracker"  # the killed clean up nothing
    )
    START.set_forkserver_preload(["dh2sim.simulate.store.writer", "numcodecs"])
    start = time.perf_counter()
    if asked.objects:
        with bucket() as runs:
            killed, early, finished = campaign(runs, asked.kills, asked.seed)
    else:
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            killed, early, finished = campaign(Folders(Path(folder)), asked.kills, asked.seed)
    print(
        f"{killed} writers killed, {early} of them before there was a run; {finished} runs of {BLOCKS} blocks, each "
        f"byte for byte that of one process; {time.perf_counter() - start:.0f} s"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
