"""The same bits, however a run is cut up and whoever simulates it."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dh2sim.simulate import block, rollout
from dh2sim.simulate import loops as closed_loop
from dh2sim.simulate import loops as open_loop
from dh2sim.simulate.block import Job, simulate_block
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.prepare import prepare
from tests.program import environment
from tests.simulate import robots

RECORD = ("qpos", "qvel", "ctrl", "tool_pose", "reference", "qacc", "torque", "energy", "contacts")
CONTROLLERS = ("sine", "random", "pd", "computed-torque", "tests.simulate.drivers:MotorWave", "hold")
ROLLOUTS = 9


def job(controller: str, *, rollouts: int = ROLLOUTS, **how: Any) -> Job:
    options = {
        "steps": 50,
        "controller": controller,
        "start": "random",
        "seed": 4,
        "record": RECORD,
        "randomize": {"mass": 0.2, "friction": 0.5},
        "timestep": 0.01,
        **how,
    }
    return prepare(robots.worm(), RolloutOptions(rollouts=rollouts, **options))


def simulated(of: Job, rollouts: range, threads: int = 1) -> Mapping[str, NDArray[Any]]:
    return simulate_block(of, rollouts, threads=threads)


def assert_same(
    found: Mapping[str, NDArray[Any]], wanted: Mapping[str, NDArray[Any]], rows: slice = slice(None)
) -> None:
    assert found.keys() == wanted.keys()
    for name, values in found.items():
        assert values.tobytes() == wanted[name][rows].tobytes(), name


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_any_number_of_threads_gives_the_same_bits(controller: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made = job(controller)
    alone = simulated(made, range(ROLLOUTS))
    for least in (block.LEAST_SIZE, 1):  # of one group, or of several at the same time
        monkeypatch.setattr(block, "LEAST_SIZE", least)
        for threads in (0, 2, 5, 999):
            assert_same(simulated(made, range(ROLLOUTS), threads), alone)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_a_rollout_is_the_same_alone_and_among_others(controller: str) -> None:
    made = job(controller)
    together = simulated(made, range(ROLLOUTS))
    for part in (range(1), range(3, 4), range(2, 7), range(8, 9)):
        assert_same(simulated(made, part), together, slice(part.start, part.stop))


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_order_of_blocks_does_not_matter(controller: str) -> None:
    made = job(controller)
    before = simulated(made, range(4))
    simulated(made, range(4, ROLLOUTS))
    simulated(job("passive", seed=9), range(3))
    assert_same(simulated(made, range(4)), before)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_groups_of_any_size_give_the_same_bits(controller: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made = job(controller)
    together = simulated(made, range(ROLLOUTS))
    for size in (1, 2, 4):
        monkeypatch.setattr(block, "BATCH_SIZE", size)
        assert_same(simulated(made, range(ROLLOUTS)), together)
        assert_same(simulated(made, range(ROLLOUTS), threads=3), together)


@pytest.mark.parametrize("every", [1, 5])
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_segments_of_any_length_give_the_same_bits(
    controller: str, every: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = job(controller, every=every)
    at_once = simulated(made, range(ROLLOUTS))
    monkeypatch.setattr(open_loop, "SEGMENT_BYTES", 1)  # as short as they get, 16 steps
    for length in (1, 7, 64):
        monkeypatch.setattr(closed_loop, "PAGE_STEPS", length)
        monkeypatch.setattr(block, "REFERENCE_STEPS", length)
        assert_same(simulated(made, range(ROLLOUTS)), at_once)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_the_first_of_many_rollouts_are_those_of_a_smaller_run(controller: str) -> None:
    many = simulated(job(controller, rollouts=500), range(5))
    assert_same(simulated(job(controller, rollouts=5), range(5)), many)


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_a_shorter_run_is_the_beginning_of_a_longer_one(controller: str) -> None:
    short, long = simulated(job(controller, steps=20), range(3)), simulated(job(controller), range(3))
    for name in ("qpos", "qvel", "ctrl", "tool_pose", "qacc", "torque", "contacts"):
        assert np.array_equal(short[name], long[name][:, : short[name].shape[1]]), name


@pytest.mark.parametrize("controller", ["sine", "random", "pd", "computed-torque"])
def test_every_rollout_and_every_seed_is_another(controller: str) -> None:
    one = simulated(job(controller), range(ROLLOUTS))
    other = simulated(job(controller, seed=5), range(ROLLOUTS))
    ends = np.concatenate([one["qpos"][:, -1], other["qpos"][:, -1]])
    assert len(np.unique(ends, axis=0)) == 2 * ROLLOUTS


OTHER_PROCESS = """
import hashlib
from tests.simulate.test_same_bits import digest
print(digest())
"""


def digest() -> str:
    """Of a run that uses everything."""
    run = rollout(robots.worm(), rollouts=5, steps=40, controller="pd", start="random", record=RECORD)
    return hashlib.sha256(
        b"".join(run[name].values.tobytes() for name in sorted(map(str, run.data_vars)))
    ).hexdigest()


@pytest.mark.slow
def test_another_process_gives_the_same_bits() -> None:
    for hash_seed in ("1", "2"):
        done = subprocess.run(
            [sys.executable, "-c", OTHER_PROCESS],
            env=environment(PYTHONHASHSEED=hash_seed),
            capture_output=True,
            text=True,
            timeout=180,
            check=True,
        )
        assert done.stdout.strip() == digest()
