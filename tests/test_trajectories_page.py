"""docs/trajectories.md tells the truth."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.program import dh2sim

DOCS = Path(__file__).parents[1] / "docs"
PAGE = (DOCS / "trajectories.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("line", re.findall(r"^    dh2sim (trajectory .*)$", PAGE, re.MULTILINE))
def test_its_commands_work(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(DOCS.parent)
    words = line.split()
    if "-o" in words:
        words[-1] = str(tmp_path / words[-1])
    run = dh2sim(*words)
    assert (run.status, run.err) == (0, "")


def test_its_waypoint_file_and_its_code_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    [text] = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
    Path("waypoints.yaml").write_text(text, encoding="utf-8")
    run = dh2sim("trajectory", "puma560", "waypoints.yaml", "--limits")
    assert (run.status, run.err) == (0, "")
    [code] = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(compile(code, "trajectories.md", "exec"), {})
    assert Path("motion.npz").is_file()
