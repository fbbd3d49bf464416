from __future__ import annotations

import os
import random
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from dh2sim.simulate.description import describe
from dh2sim.simulate.store.reader import open_dataset
from tests.simulate.store.runs import lasting, layout, make, resume, whole
from tests.simulate.store.workers import workers

ROLLOUTS = 100
BEFORE_A_BLOCK, AFTER_A_BLOCK = 5, 10
"""Kills at any moment of the first fraction of a second, and of a short while after a block was committed."""


def _wait_for_a_block(path: Path) -> None:
    """Wait until another block is committed, or none is left to be."""
    records = path / "blocks" / "record"
    before, waiting = None, time.monotonic() + 20
    while time.monotonic() < waiting:
        number = len(list(records.glob("c.*"))) if records.exists() else 0
        if number > (number if before is None else before) or number == ROLLOUTS:
            return
        before = number
        time.sleep(0.002)


def _as_read(path: Path, numbers: dict[str, np.ndarray]) -> int:
    """Check that every rollout that a reader finds a status of is all there; return how many there are."""
    dataset = open_dataset(path).load()
    there = dataset.status.to_numpy() != -1
    for name, values in numbers.items():
        assert dataset[name].to_numpy()[there].tobytes() == values[there].tobytes(), name
    return int(there.sum())


@pytest.mark.slow
def test_a_run_whose_writer_is_killed_again_and_again_becomes_what_it_would_have_become(tmp_path: Path) -> None:
    of = layout(rollouts=ROLLOUTS, block=1)
    path, numbers, rng = tmp_path / "run.zarr", whole(of), random.Random(0)
    seen, killed = 0, 0
    with workers(path, ROLLOUTS) as start:
        for kill in range(BEFORE_A_BLOCK + AFTER_A_BLOCK):
            worker = start.start()
            if kill >= BEFORE_A_BLOCK:
                _wait_for_a_block(path)
            time.sleep(rng.uniform(0.0, 0.2 if kill < BEFORE_A_BLOCK else 0.03))
            killed += start.kill(worker) == -signal.SIGKILL  # or it was done already
            if path.exists():
                assert _as_read(path, numbers) >= seen
                seen = describe(path).blocks_done
    assert killed >= 3
    pending = resume(path, of)
    assert len(pending) == ROLLOUTS - seen
    assert _as_read(path, numbers) == ROLLOUTS
    assert lasting(path) == lasting(make(tmp_path / "whole.zarr", of))
    assert sorted(os.listdir(tmp_path)) == ["run.zarr", "whole.zarr"]
