"""The GitHub action, run as its runner would: its shell step, with the inputs in the environment."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def action() -> dict[str, Any]:
    with (ROOT / "action.yml").open(encoding="utf-8") as file:
        loaded: dict[str, Any] = YAML(typ="safe").load(file)
    return loaded


def run_step(action: dict[str, Any], where: Path, **inputs: str) -> subprocess.CompletedProcess[str]:
    """Run the last step in ``where``, with the action's defaults for inputs that are not given."""
    given = {name: inputs.get(name, entry.get("default", "")) for name, entry in action["inputs"].items()}
    step = action["runs"]["steps"][-1]
    variables = {}
    for name, expression in step["env"].items():
        assert expression.startswith("${{ inputs.")
        variables[name] = given[expression.removeprefix("${{ inputs.").removesuffix(" }}")]
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    return subprocess.run(
        ["bash", "-eo", "pipefail", "-c", step["run"]],
        cwd=where,
        env={**os.environ, **variables, "PATH": path},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """Another repository, which keeps robots and their exports."""
    if shutil.which("bash") is None:
        pytest.skip("bash is not installed, which the action's steps are written for")
    if not (Path(sys.executable).parent / "dh2sim").exists():
        pytest.skip("the dh2sim program is not installed beside this Python")
    for name in ("rpr", "planar_2r"):
        (tmp_path / "arms").mkdir(exist_ok=True)
        shutil.copy(ROOT / "robots" / f"{name}.yaml", tmp_path / "arms")
        shutil.copytree(ROOT / "generated" / name, tmp_path / "models" / name)
    return tmp_path


@pytest.mark.slow
def test_action_passes_for_robots_that_match(action: dict[str, Any], repository: Path) -> None:
    done = run_step(action, repository, robots="arms/*.yaml", dir="models", samples="20", junit="report.xml")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 of 2 robots match their tables." in done.stdout
    assert (repository / "report.xml").read_text(encoding="utf-8").count("<testsuite ") == 2


@pytest.mark.slow
def test_action_exports_afresh_without_a_folder(action: dict[str, Any], repository: Path) -> None:
    shutil.rmtree(repository / "models")
    done = run_step(action, repository, robots="arms/rpr.yaml arms/planar_2r.yaml", samples="20")
    assert done.returncode == 0, done.stdout + done.stderr
    assert not (repository / "generated").exists()


@pytest.mark.slow
def test_action_fails_when_a_twist_changes_its_sign(action: dict[str, Any], repository: Path) -> None:
    robot = repository / "arms" / "rpr.yaml"
    text = robot.read_text(encoding="utf-8")
    assert "alpha: 90" in text
    robot.write_text(text.replace("alpha: 90", "alpha: -90"), encoding="utf-8")
    done = run_step(action, repository, robots="arms/*.yaml", dir="models", samples="20")
    assert done.returncode == 1
    assert "rpr DOES NOT match its table" in done.stdout
    assert "1 of 2 robots match their tables." in done.stdout


def test_every_input_is_described_and_used(action: dict[str, Any]) -> None:
    steps = str(action["runs"]["steps"])
    for name, entry in action["inputs"].items():
        assert entry["description"]
        assert f"inputs.{name} " in steps
