"""docs/workspace.md tells the truth."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from scripts.draw_workspace import main as draw_pictures
from tests.program import dh2sim

DOCS = Path(__file__).parents[1] / "docs"
PAGE = (DOCS / "workspace.md").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("line", re.findall(r"^    dh2sim (workspace .*)$", PAGE, re.MULTILINE))
def test_its_commands_work(line: str, tmp_path: Path) -> None:
    words = line.split()
    if "-o" in words:
        words[-1] = str(tmp_path / words[-1])
    run = dh2sim(*words, "--samples", "2000")
    assert (run.status, run.err) == (0, "")
    assert "-o" not in words or Path(words[words.index("-o") + 1]).stat().st_size > 0


@pytest.mark.slow
def test_its_code_works_and_its_pictures_are_up_to_date(tmp_path: Path) -> None:
    pyplot = pytest.importorskip("matplotlib.pyplot")
    [code] = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    exec(compile(code, "workspace.md", "exec"), {})
    draw_pictures(tmp_path)
    drawn = sorted(path.name for path in tmp_path.iterdir())
    assert [name for name in drawn if f"images/{name}" in PAGE] == ["workspace_section.png", "workspace_voxels.png"]
    for name in drawn:
        new, kept = (pyplot.imread(folder / name)[..., :3] for folder in (tmp_path, DOCS / "images"))
        assert new.shape == kept.shape, f"{name}: run scripts/draw_workspace.py"
        # letters and the last digits of a sine differ between machines
        assert np.abs(new - kept).mean() < 4e-3, f"{name}: run scripts/draw_workspace.py"


def test_its_figures_are_those_of_the_program() -> None:
    from dh2sim.workspace.dexterity import LOCKS
    from dh2sim.workspace.voxels import MOST_VOXELS
    from dh2sim.workspace.workspace import FINER, ORIENTATIONS, SAMPLES, USUAL

    assert (SAMPLES, USUAL, MOST_VOXELS) == (200_000, 100_000, 8_000_000)
    assert (ORIENTATIONS, FINER, LOCKS) == (24, 4, 6)
