"""What docs/scale.md shows is what happens, as far as one machine can tell."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.program import dh2sim, environment, shell

PAGE = (Path(__file__).resolve().parent.parent / "docs" / "scale.md").read_text(encoding="utf-8")
KUBERNETES = "$((JOB_COMPLETION_INDEX + 1))"


def _commands() -> Iterator[list[str]]:
    """Every `dh2sim rollout` that the page shows, as words."""
    joined = re.sub(r"\\\n\s*|\n\s+(?=--share)", " ", PAGE)
    for line in re.findall(r"dh2sim rollout [^\n|&`]*", joined):
        yield shlex.split(line.replace(KUBERNETES, "1"), comments=True)[1:]


def test_every_option_that_it_shows_is_one() -> None:
    known = dh2sim("rollout", "--help").out
    commands = list(_commands())
    assert len(commands) >= 5
    for words in commands:
        for option in (word for word in words if word.startswith("--")):
            assert option in known, words


@pytest.mark.slow
def test_four_shares_without_a_launcher_make_the_run(tmp_path: Path) -> None:
    [line] = re.findall(r"^    (seq 1 4 \| xargs .*)$", PAGE, flags=re.MULTILINE)
    small = line.replace("--rollouts 2000", "--rollouts 8 --steps 10 --block-size 2").replace("dh2sim ", "$DH2SIM ")
    assert small.count("$DH2SIM") == 1
    done = shell(f"cd '{tmp_path}' && {small}")
    assert (done.status, done.err) == (0, "")
    assert dh2sim("runs", tmp_path / "run.zarr", "--verify").out.startswith(f"{tmp_path / 'run.zarr'}  complete")


@pytest.mark.slow
def test_its_pool_of_processes_simulates(tmp_path: Path) -> None:
    code = re.findall(r"^```python\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)[0]
    (tmp_path / "pool.py").write_text(code.replace("rollout(64,", "rollout(4,") + "    print(run.sizes['rollout'])\n")
    done = subprocess.run(
        [sys.executable, "pool.py"], cwd=tmp_path, env=environment(), capture_output=True, text=True, timeout=300
    )
    assert (done.returncode, done.stdout) == (0, "4\n"), done.stderr
