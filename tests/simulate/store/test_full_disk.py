from __future__ import annotations

import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.program import environment
from tests.simulate.store.runs import lasting, layout, make

ROLLOUTS, BLOCK, STEPS = 8, 2, 500

WRITE = f"""
import os, sys
from pathlib import Path
from tests.simulate.store.runs import SECONDS, block_of, finish, layout
from dh2sim.errors import RunOutputError
from dh2sim.simulate.store.writer import RunWriter
os.chdir(sys.argv[1])
path, of = Path("run.zarr"), layout(rollouts={ROLLOUTS}, block={BLOCK}, steps={STEPS})

def attempt(write):
    try:
        write()
    except RunOutputError as error:
        print(error)
    else:
        print("written")
"""

LIMITED = """
import resource
with RunWriter.create(path, of) as writer:
    writer.write(2, block_of(of, 2), SECONDS)
    before = {str(file) for file in path.rglob("*")}
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))
    attempt(lambda: finish(writer))
    print(writer.pending(), {str(file) for file in path.rglob("*")} == before)
    resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    print(finish(writer))
"""

FULL = """
import subprocess
filler = Path("filler")
room = lambda: os.statvfs(".").f_bavail * os.statvfs(".").f_frsize
def fill(left):
    filler.write_bytes(bytes(room() - left))
fill(8192)
attempt(lambda: RunWriter.create(path, of))
print(sorted(map(str, Path(".").iterdir())))
filler.unlink()
with RunWriter.create(path, of) as writer:
    writer.write(0, block_of(of, 0), SECONDS)
    fill(50_000)
    attempt(lambda: finish(writer))
    print(writer.pending())
    filler.unlink()
with RunWriter.resume(path, of) as writer:
    writer.write(3, block_of(of, 3), SECONDS)
    subprocess.run(["mount", "-o", "remount,ro", "."], check=True)
    attempt(lambda: writer.write(1, block_of(of, 1), SECONDS))
    subprocess.run(["mount", "-o", "remount,rw", "."], check=True)
with RunWriter.resume(path, of) as writer:
    print(finish(writer))
import shutil
shutil.copytree(path, sys.argv[2])
"""


def _run(*command: str | Path) -> list[str]:
    done = subprocess.run(
        [str(word) for word in command], env=environment(), capture_output=True, text=True, timeout=180, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def _undisturbed(folder: Path) -> dict[str, bytes]:
    return lasting(make(folder / "other.zarr", layout(rollouts=ROLLOUTS, block=BLOCK, steps=STEPS)))


@pytest.mark.slow
def test_a_block_that_is_too_large_for_a_file_leaves_nothing_and_can_be_written_later(tmp_path: Path) -> None:
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[1] == resource.RLIM_INFINITY
    assert _run(sys.executable, "-c", WRITE + LIMITED, tmp_path) == [
        "cannot write to 'run.zarr': File too large; 2 of 8 rollouts are safe. Make room, then resume",
        "(0, 1, 3) True",
        "(0, 1, 3)",
    ]
    assert lasting(tmp_path / "run.zarr") == _undisturbed(tmp_path)


def _namespace() -> list[str]:
    """A command before a command that may mount file systems, which nobody else sees."""
    command = ["unshare", "--user", "--map-root-user", "--mount"]
    if not shutil.which("unshare") or subprocess.run([*command, "true"], capture_output=True, check=False).returncode:
        pytest.skip("needs unshare(1), and leave to make a user namespace")
    return command


@pytest.mark.slow
def test_a_full_disk_loses_nothing_that_was_committed(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    script = 'mount -t tmpfs -o size=1m tmpfs "$1" && exec "$0" -c "$2" "$1" "$3"'
    out = _run(*_namespace(), "sh", "-c", script, sys.executable, disk, WRITE + FULL, tmp_path / "copied.zarr")
    assert out == [
        "cannot write to 'run.zarr': No space left on device; nothing was changed",
        "['filler']",
        "cannot write to 'run.zarr': No space left on device; 2 of 8 rollouts are safe. Make room, then resume",
        "(1, 2, 3)",
        "cannot write to 'run.zarr': Read-only file system; 4 of 8 rollouts are safe. "
        "Resume when it can be written to",
        "(1, 2)",
    ]
    assert lasting(tmp_path / "copied.zarr") == _undisturbed(tmp_path)
