"""Runs whose blocks other processes simulate."""

from __future__ import annotations

import json
import os
import pickle
import shutil
import subprocess
import sys
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dh2sim.errors import ControllerError, ExecutorError, RunDiffersError, RunError, SettingsError
from dh2sim.simulate import rollout
from dh2sim.simulate.block import simulate_block
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.prepare import prepare
from tests.program import contents, dh2sim, environment
from tests.sample_robots import model

HOW: dict[str, Any] = {"rollouts": 10, "steps": 6, "block_size": 3}


def chunks(run: Path) -> dict[str, bytes]:
    """Every chunk of a dataset."""
    files = contents(run)
    return {name: data for name, data in files.items() if "/c." in name and not name.startswith("blocks/")}


def _starts(folder: Path) -> str:
    np.save(folder / "starts.npy", np.random.default_rng(0).uniform(-0.1, 0.1, (10, 2)))
    return str(folder / "starts.npy")


@pytest.mark.parametrize(
    "options",
    [
        {"randomize": {"mass": 0.1}, "start": "random"},
        {"controller": "computed-torque:bandwidth=9"},
        {"controller": "tests.simulate.drivers:Late"},
        {"vary": {"a1": "0.1"}},
        {"start": "FILE"},
        {"controller": "replay:RUN"},
        {"controller": "replay:file=RUN,rollout=3"},
    ],
)
def test_a_job_is_the_same_after_it_was_sent(options: dict[str, Any], tmp_path: Path) -> None:
    if "RUN" in options.get("controller", ""):
        rollout(model("planar_2r"), rollouts=10, steps=6, out=tmp_path / "run.zarr")
        options = {"controller": options["controller"].replace("RUN", str(tmp_path / "run.zarr"))}
    if options.get("start") == "FILE":
        options = {"start": _starts(tmp_path)}
    settings = RolloutOptions(rollouts=10, steps=3, **options)
    assert pickle.loads(pickle.dumps(settings)) == settings
    job = prepare(model("planar_2r"), settings)
    sent = pickle.loads(pickle.dumps(job))
    ours, theirs = (simulate_block(each, range(2, 5), threads=1) for each in (job, sent))
    assert {name: values.tobytes() for name, values in ours.items()} == {
        name: values.tobytes() for name, values in theirs.items()
    }


def test_any_executor_makes_the_run_of_one_process(tmp_path: Path) -> None:
    how = {**HOW, "start": _starts(tmp_path)}
    rollout(model("planar_2r"), out=tmp_path / "one.zarr", **how)
    seen: list[int] = []
    with ThreadPoolExecutor(2) as pool:
        rollout(model("planar_2r"), out=tmp_path / "many.zarr", executor=pool, advance=seen.append, **how)
        in_memory = rollout(model("planar_2r"), executor=pool, **how)
    assert sum(seen) == 10
    assert chunks(tmp_path / "many.zarr") == chunks(tmp_path / "one.zarr")
    for name, values in rollout(model("planar_2r"), **how).data_vars.items():
        assert in_memory[name].to_numpy().tobytes() == values.to_numpy().tobytes()


def test_an_error_of_a_worker_is_that_of_the_run(tmp_path: Path) -> None:
    how = {**HOW, "steps": 8, "controller": "tests.simulate.drivers:Late"}
    with ThreadPoolExecutor(2) as pool:
        for out in (None, tmp_path / "run.zarr"):
            with pytest.raises(ControllerError):
                rollout(model("planar_2r"), out=out, executor=pool, **how)


class Elsewhere(Executor):
    """Runs tasks when something has happened in between."""

    def __init__(self, between: Any) -> None:
        self._between = between

    def submit(self, function: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        self._between()
        future: Future[Any] = Future()
        try:
            future.set_result(function(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


def test_a_worker_that_does_not_see_the_run_or_another_one_says_so(tmp_path: Path) -> None:
    run, other = tmp_path / "run.zarr", tmp_path / "other.zarr"
    rollout(model("planar_2r"), out=other, **{**HOW, "block_size": 2})

    def remove() -> None:
        if run.exists():
            os.rename(run, tmp_path / "gone")

    def replace() -> None:
        if other.exists():
            shutil.rmtree(run)
            os.rename(other, run)

    with pytest.raises(RunError, match="is not there for the worker on"):
        rollout(model("planar_2r"), out=run, executor=Elsewhere(remove), **HOW)
    with pytest.raises(RunDiffersError, match="is another run for the worker on"):
        rollout(model("planar_2r"), out=run, executor=Elsewhere(replace), **HOW)


def test_workers_that_fail_otherwise_are_an_error_that_says_how_to_go_on(tmp_path: Path) -> None:
    def fail() -> None:
        raise OSError("out of machines")

    with pytest.raises(ExecutorError) as caught:
        rollout(model("planar_2r"), out=tmp_path / "run.zarr", executor=Elsewhere(fail), **HOW)
    assert str(caught.value) == (
        "the workers failed: OSError: out of machines. What was committed is safe: resume with the same options"
    )


@pytest.mark.parametrize("executor", ["ray", "local:0", "local:x", 3])
def test_what_is_no_executor_makes_no_run(executor: Any, tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="executor must be 'local', 'local:N', 'dask://HOST:PORT', an executor"):
        rollout(model("planar_2r"), out=tmp_path / "run.zarr", executor=executor, **HOW)
    assert os.listdir(tmp_path) == []


@pytest.mark.slow
def test_processes_of_this_machine_make_the_run_of_one(tmp_path: Path) -> None:
    options = ["planar_2r", "--rollouts", "10", "--steps", "6", "--block-size", "3", "-q"]
    assert dh2sim("rollout", *options, "--out", tmp_path / "one.zarr").status == 0
    command = [sys.executable, "-m", "dh2sim", "rollout", *options, "--executor", "local:2", "--out", "many.zarr"]
    done = subprocess.run(command, cwd=tmp_path, env=environment(), capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert chunks(tmp_path / "many.zarr") == chunks(tmp_path / "one.zarr")


DASK = """
import json, os, signal, sys, threading, time
from pathlib import Path
from distributed import Client, LocalCluster
from dh2sim.simulate import rollout

def rest():  # after each block, so that there are some left when the worker is killed
    from dh2sim.simulate.store.writer import RunWriter
    write = RunWriter.write
    RunWriter.write = lambda *arguments: (write(*arguments), time.sleep(0.1))

def kill(client, run):
    records = run / "blocks" / "record"
    while not records.exists() or len(list(records.glob("c.*"))) < 3:
        time.sleep(0.01)
    os.kill(next(iter(client.run(os.getpid).values())), signal.SIGKILL)
    killed.append(len(list(records.glob("c.*"))))

if __name__ == "__main__":
    run, killed = Path("run.zarr"), []
    with LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=50
    ) as cluster, Client(cluster) as client:
        client.run(rest)
        thread = threading.Thread(target=kill, args=(client, run))
        thread.start()
        rollout("planar_2r", rollouts=120, steps=500, block_size=4, controller="pd", out=run, executor=client)
        thread.join()
        print(json.dumps(killed))
"""


@pytest.mark.slow
@pytest.mark.skipif(find_spec("distributed") is None, reason="needs the extra 'cluster'")
def test_dask_makes_the_run_of_one_process_though_a_worker_is_killed(tmp_path: Path) -> None:
    (tmp_path / "with_dask.py").write_text(DASK)
    done = subprocess.run(
        [sys.executable, "with_dask.py"],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    [committed] = json.loads(done.stdout)
    assert 3 <= committed < 30
    rollout("planar_2r", rollouts=120, steps=500, block_size=4, controller="pd", out=tmp_path / "one.zarr")
    assert chunks(tmp_path / "run.zarr") == chunks(tmp_path / "one.zarr")
