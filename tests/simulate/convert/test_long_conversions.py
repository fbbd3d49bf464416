"""Conversions that are cut off, and how much memory they take."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.program import STARTED, environment
from tests.simulate.convert.samples import make_arrays, make_layout, write_run

NAMES = {"parquet": "out.parquet", "hdf5": "out.h5"}

PEAK = """
import sys
from pathlib import Path
from dh2sim.simulate.convert.hdf5 import to_hdf5
from dh2sim.simulate.convert.parquet import to_parquet
run = Path(sys.argv[1])
to_parquet(run, run.with_suffix(".parquet"))
to_hdf5(run, run.with_suffix(".h5"))
status = Path("/proc/self/status").read_text()
print(next(line.split()[1] for line in status.splitlines() if line.startswith("VmHWM:")))
"""


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that takes some time to convert."""
    layout = make_layout(rollouts=16_000, block=500)
    return write_run(tmp_path_factory.mktemp("large") / "run.zarr", layout, make_arrays(layout))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["parquet", "hdf5"])
@pytest.mark.parametrize(("kill", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interruption_leaves_nothing(
    large: Path, tmp_path: Path, kind: str, kill: signal.Signals, status: int
) -> None:
    rng = random.Random(0)
    interrupted = 0
    for attempt in range(2):
        out = tmp_path / f"{attempt}" / NAMES[kind]
        out.parent.mkdir()
        process = subprocess.Popen(
            [sys.executable, "-c", STARTED, "runs", str(large), "--to", kind, "--out", str(out)],
            env=environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert process.stdout is not None
        process.stdout.readline()
        while process.poll() is None and not list(out.parent.iterdir()):
            time.sleep(0.001)  # until there is something to be left behind
        time.sleep(rng.uniform(0.0, 0.3))
        process.send_signal(kill)
        reported = process.communicate(timeout=180)[1]
        if process.returncode == 0:
            continue  # it was done before
        interrupted += 1
        assert (process.returncode, reported) == (status, "dh2sim: interrupted\n" if kill is signal.SIGINT else "")
        assert not list(out.parent.iterdir())
    assert interrupted


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs /proc")
def test_memory_is_bounded_by_a_block_and_not_by_the_run(tmp_path: Path) -> None:
    peaks = []
    for rollouts in (2_000, 20_000):
        layout = make_layout(rollouts=rollouts, block=1_000)
        run = write_run(tmp_path / f"{rollouts}.zarr", layout, make_arrays(layout))
        done = subprocess.run(
            [sys.executable, "-c", PEAK, str(run)], env=environment(), capture_output=True, text=True, check=True
        )
        assert done.stderr == ""
        peaks.append(int(done.stdout) * 1024)
    numbers = sum(array.nbytes for array in make_arrays(layout).values())
    assert peaks[1] - peaks[0] < 0.4 * numbers
