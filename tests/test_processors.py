from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from dh2sim.processors import available_processors


@pytest.fixture
def groups(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A machine whose processes may run on eight processors."""
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(8)), raising=False)
    return tmp_path


def _count(folder: Path, membership: str, **files: str) -> int:
    (folder / "membership").write_text(membership)
    for name, text in files.items():
        file = folder / name.replace("__", "/").replace("max", ".max").replace("cfs", ".cfs")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return available_processors(folder / "membership", folder)


@pytest.mark.parametrize(
    ("membership", "files", "count"),
    [
        ("0::/\n", {}, 8),
        ("0::/\n", {"cpumax": "max 100000\n"}, 8),
        ("0::/\n", {"cpumax": "300000 100000\n"}, 3),
        ("0::/\n", {"cpumax": "250000 100000\n"}, 3),
        ("0::/\n", {"cpumax": "5000 100000\n"}, 1),
        ("0::/\n", {"cpumax": "9900000 100000\n"}, 8),
        ("0::/job/step\n", {"job__cpumax": "200000 100000\n", "job__step__cpumax": "max 100000\n"}, 2),
        ("0::/job/step\n", {"job__cpumax": "400000 100000\n", "job__step__cpumax": "100000 100000\n"}, 1),
        ("0::/../elsewhere\n", {"cpumax": "200000 100000\n"}, 2),
        ("0::/\n", {"cpumax": "nonsense\n"}, 8),
        (
            "4:memory:/a\n3:cpu,cpuacct:/a\n",
            {"cpu__a__cpucfs_quota_us": "200000", "cpu__a__cpucfs_period_us": "100000"},
            2,
        ),
        ("3:cpu,cpuacct:/a\n", {"cpu__a__cpucfs_quota_us": "-1", "cpu__a__cpucfs_period_us": "100000"}, 8),
    ],
)
def test_the_smallest_share_of_any_control_group_counts(
    groups: Path, membership: str, files: dict[str, str], count: int
) -> None:
    assert _count(groups, membership, **files) == count


def test_without_control_groups_affinity_counts(groups: Path) -> None:
    assert available_processors(groups / "missing", groups) == 8


POOL = """
import os, signal
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

from dh2sim.processors import end_with_parent

if __name__ == "__main__":
    pool = ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=end_with_parent)
    assert pool.submit(abs, -1).result() == 1
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no process can be killed so here")
def test_workers_end_when_the_process_that_started_them_is_killed(tmp_path: Path) -> None:
    script = tmp_path / "pool.py"
    script.write_text(POOL, encoding="utf-8")
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE) as killed:
        assert killed.communicate(timeout=180)[0] == b"", "the worker has it open, too, until it ends"
    assert killed.returncode == -signal.SIGKILL
