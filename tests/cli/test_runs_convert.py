"""``dh2sim runs --to``."""

from __future__ import annotations

import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pandas as pd
import pytest
import xarray as xr

from dh2sim.cli.output import size_text
from tests.program import Outcome, dh2sim, environment
from tests.simulate.convert.samples import Arrays, make_arrays, make_layout, write_run


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def arrays() -> Arrays:
    return make_arrays(make_layout())


@pytest.fixture
def run(folder: Path, arrays: Arrays) -> Path:
    """A complete run in the current folder."""
    return write_run(Path("run.zarr"), make_layout(), arrays)


@pytest.mark.slow
def test_files_of_a_conversion_stand_beside_the_run_and_are_reported(run: Path) -> None:
    printed = dh2sim("runs", run, "--to", "parquet")
    names = ["run.parquet", "run.steps.parquet", "run.rollouts.parquet"]
    assert (printed.status, printed.err) == (0, "")
    assert printed.out.splitlines() == [f"{name}  {size_text(Path(name).stat().st_size)}" for name in names]
    assert len(pd.read_parquet("run.parquet")) == 7 * 5 * 3
    printed = dh2sim("runs", run, "--to", "hdf5", "--out", "new/there.h5")
    assert printed == Outcome(
        status=0, out=f"new/there.h5  {size_text(Path('new/there.h5').stat().st_size)}\n", err=""
    )
    with xr.open_dataset("new/there.h5", engine="h5netcdf") as dataset:
        assert dataset.sizes["rollout"] == 7
    assert dh2sim("runs", run, "--to", "hdf5", "--quiet") == Outcome(status=0, out="", err="")
    assert Path("run.h5").stat().st_size == Path("new/there.h5").stat().st_size


def test_several_runs_are_converted_each_to_its_own_file(run: Path, arrays: Arrays) -> None:
    other = write_run(Path("other"), make_layout(), arrays)
    assert [line.split()[0] for line in dh2sim("runs", run, other, "--to", "hdf5").out.splitlines()] == [
        "run.h5",
        "other.h5",
    ]


def test_a_conversion_of_an_unfinished_run_says_what_is_missing(folder: Path, arrays: Arrays) -> None:
    run = write_run(Path("run.zarr"), make_layout(), arrays, blocks=1)
    printed = dh2sim("runs", run, "--to", "hdf5", "--quiet")
    assert printed == Outcome(
        status=0,
        out="",
        err="dh2sim: 4 of 7 rollouts of 'run.zarr' are not run yet; their numbers are missing in what was written\n",
    )


def test_an_existing_file_is_replaced_only_if_that_is_wanted(run: Path) -> None:
    Path("run.h5").write_text("mine")
    printed = dh2sim("runs", run, "--to", "hdf5")
    assert printed == Outcome(
        status=2,
        out="",
        err="dh2sim: 'run.h5' already exists; overwrite it, or name another file\n",
    )
    assert Path("run.h5").read_text() == "mine"
    assert dh2sim("runs", run, "--to", "hdf5", "--overwrite").status == 0
    assert Path("run.h5").read_bytes()[1:4] == b"HDF"


def test_the_run_of_the_current_folder_is_converted_beside_it(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(run)
    assert dh2sim("runs", ".", "--to", "hdf5", "--quiet") == Outcome(status=0, out="", err="")
    assert Path("../run.h5").is_file()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["parquet", "hdf5"])
@pytest.mark.parametrize("out", ["", ".", ".."])
def test_a_folder_is_no_file_to_write_to(run: Path, kind: str, out: str) -> None:
    printed = dh2sim("runs", run, "--to", kind, "--out", out)
    assert printed == Outcome(status=2, out="", err=f"dh2sim: '{out or '.'}' is a folder; name a file\n")


@pytest.mark.slow
def test_a_terminal_sees_a_bar_that_vanishes(run: Path) -> None:
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 100, 0, 0))
    command = [sys.executable, "-m", "dh2sim", "runs", str(run), "--to", "hdf5"]
    for option, shown in (([], True), (["--force", "--quiet"], False)):
        subprocess.run(
            [*command, *option],
            env=environment(TERM="xterm"),
            stdout=subprocess.PIPE,
            stderr=theirs,
            timeout=180,
            check=True,
        )
        os.write(theirs, b"end")
        seen = b""
        while not seen.endswith(b"end"):
            seen += os.read(ours, 65536)
        assert (b"converting" in seen) is shown
        assert (b"7 of 7 rollouts" in seen) is shown
    os.close(ours)
    os.close(theirs)
