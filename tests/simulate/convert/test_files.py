"""Files of a conversion stand whole or not at all, and never in place of others unasked."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from dh2sim.errors import Dh2simError, OutputError, RunDamagedError
from dh2sim.simulate.convert.hdf5 import to_hdf5
from dh2sim.simulate.convert.parquet import to_parquet
from tests.program import Outcome, contents, environment
from tests.simulate.convert.samples import make_arrays, make_layout, write_run

CONVERTERS: dict[str, Callable[..., tuple[Path, ...]]] = {"parquet": to_parquet, "hdf5": to_hdf5}
NAMES = {"parquet": "out.parquet", "hdf5": "out.h5"}

both = pytest.mark.parametrize("kind", ["parquet", "hdf5"])


def _python(code: str, *arguments: str | Path) -> Outcome:
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        env=environment(),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    return Outcome(status=done.returncode, out=done.stdout, err=done.stderr)


@both
def test_what_exists_is_not_overwritten_unless_that_is_wanted(run: Path, tmp_path: Path, kind: str) -> None:
    convert, out = CONVERTERS[kind], tmp_path / NAMES[kind]
    files = convert(run, out)
    for file in files:
        file.write_text("mine")
    named = " and ".join(f"'{file}'" for file in files)
    exist = "exists" if len(files) == 1 else "exist"
    it = "it" if len(files) == 1 else "them"
    with pytest.raises(OutputError) as caught:
        convert(run, out)
    assert str(caught.value) == f"{named} already {exist}; overwrite {it}, or name another file"
    assert {file.read_text() for file in files} == {"mine"}
    assert convert(run, out, overwrite=True) == files
    assert set(contents(tmp_path)) == {file.name for file in files}
    assert all(file.read_bytes() != b"mine" for file in files)


def test_a_single_table_that_exists_is_reason_enough(run: Path, tmp_path: Path) -> None:
    (tmp_path / "out.steps.parquet").write_text("mine")
    with pytest.raises(OutputError) as caught:
        to_parquet(run, tmp_path / "out.parquet")
    assert str(caught.value) == (f"'{tmp_path}/out.steps.parquet' already exists; overwrite it, or name another file")
    assert contents(tmp_path) == {"out.steps.parquet": b"mine"}


@both
def test_a_folder_is_never_replaced(run: Path, tmp_path: Path, kind: str) -> None:
    out = tmp_path / NAMES[kind]
    out.mkdir()
    with pytest.raises(OutputError) as caught:
        CONVERTERS[kind](run, out, overwrite=True)
    assert str(caught.value) == f"'{out}' is a folder; name a file"


@both
def test_nothing_is_written_into_the_run_itself(run: Path, kind: str) -> None:
    before = contents(run)
    for out in (run / "out", run / "status" / "out"):
        with pytest.raises(OutputError) as caught:
            CONVERTERS[kind](run, out, overwrite=True)
        assert str(caught.value) == f"'{out}' would be inside the run '{run}'; name a file elsewhere"
    assert contents(run) == before


@both
def test_folders_that_are_missing_are_made(run: Path, tmp_path: Path, kind: str) -> None:
    files = CONVERTERS[kind](run, tmp_path / "a" / "b" / NAMES[kind])
    assert set(contents(tmp_path)) == {f"a/b/{file.name}" for file in files}


@pytest.mark.slow
@both
@pytest.mark.parametrize(
    "file", ["qvel/c.1.0.0", "status/c.2", "time/c.0", "joint_unit/c.0", "pose/c.0", "zarr.json"]
)
@pytest.mark.parametrize("damage", ["a byte changed", "missing"])
def test_a_damaged_run_is_an_error_and_leaves_nothing(tmp_path: Path, kind: str, file: str, damage: str) -> None:
    layout = make_layout()
    run = write_run(tmp_path / "run.zarr", layout, make_arrays(layout))
    data = bytearray((run / file).read_bytes())
    data[len(data) // 2] ^= 0x80
    if damage == "missing":
        (run / file).unlink()
    else:
        (run / file).write_bytes(data)
    with pytest.raises(RunDamagedError) as caught:
        CONVERTERS[kind](run, tmp_path / "new" / NAMES[kind])
    if file in ("qvel/c.1.0.0", "status/c.2"):
        assert str(caught.value).startswith(f"'{run}' is damaged; resume it")
    else:
        assert f"'{run / file}' is missing or damaged" in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == ["run.zarr"]


@both
def test_what_is_no_run_is_an_error(tmp_path: Path, kind: str) -> None:
    with pytest.raises(Dh2simError) as caught:
        CONVERTERS[kind](tmp_path / "none.zarr", tmp_path / NAMES[kind])
    assert str(caught.value) == f"there is no '{tmp_path / 'none.zarr'}'"
    assert not list(tmp_path.iterdir())


@contextmanager
def _files_no_larger_than(size: int) -> Iterator[None]:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "limit"),
    [
        *(("parquet", limit) for limit in (0, 3_000, 100_000)),
        *(("hdf5", limit) for limit in (0, 3_000, 30_000, 120_000)),
    ],
)
def test_a_full_disk_is_reported_and_nothing_is_left(run: Path, tmp_path: Path, kind: str, limit: int) -> None:
    with _files_no_larger_than(limit), pytest.raises(OutputError) as caught:
        CONVERTERS[kind](run, tmp_path / NAMES[kind])
    assert str(caught.value) == f"cannot write to '{tmp_path}': File too large; nothing was changed"
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@both
def test_a_full_file_system_is_reported_and_nothing_is_left(run: Path, tmp_path: Path, kind: str) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    script = 'mount -t tmpfs -o size=64k none "$1" || exit 77; shift; "$@"; status=$?; ls -A "$0"; exit $status'
    command = [sys.executable, "-m", "dh2sim", "runs", str(run), "--to", kind, "--out", str(disk / NAMES[kind])]
    try:
        done = subprocess.run(
            ["unshare", "-rm", "sh", "-c", script, str(disk), str(disk), *command],
            env=environment(),
            capture_output=True,
            text=True,
            timeout=180,
            check=False,
        )
    except FileNotFoundError:
        pytest.skip("needs unshare")
    if done.returncode in (1, 77):
        pytest.skip(f"may not mount a file system: {done.stderr.strip()}")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"dh2sim: cannot write to '{disk}': No space left on device; nothing was changed\n"


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
@both
def test_a_folder_without_write_permission_is_reported(run: Path, tmp_path: Path, kind: str) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError) as caught:
        CONVERTERS[kind](run, tmp_path / NAMES[kind])
    tmp_path.chmod(0o700)
    assert str(caught.value) == f"cannot write to '{tmp_path}': Permission denied; nothing was changed"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("package", "kind", "message"),
    [
        ("pyarrow", "parquet", "Parquet needs the extra 'data': pip install 'dh2sim[data]'"),
        ("h5netcdf", "hdf5", "HDF5 needs the extra 'data': pip install 'dh2sim[data]'"),
        ("h5py", "hdf5", "HDF5 needs the extra 'data': pip install 'dh2sim[data]'"),
    ],
)
def test_the_error_of_a_missing_library_says_how_to_install_it(
    run: Path, tmp_path: Path, package: str, kind: str, message: str
) -> None:
    without = "import sys; sys.modules[sys.argv.pop(1)] = None; from dh2sim.cli.main import main; main()"
    reported = _python(without, package, "runs", run, "--to", kind, "--out", tmp_path / "out")
    assert reported == Outcome(status=2, out="", err=f"dh2sim: {message}\n")
    assert not list(tmp_path.iterdir())
    assert _python(without, package, "runs", run).status == 0
