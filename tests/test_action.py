"""The GitHub action, run as its runner would: its shell step, with the inputs in the environment."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
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


def test_no_step_runs_code_of_the_callers_checkout(action: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "pip.py").write_text("print('owned')\n")
    calls = [words for step in action["runs"]["steps"] for words in [str(step.get("run", "")).split()] if words]
    installing = [words for words in calls if "pip" in words]
    assert [words[:4] for words in installing] == [["python", "-I", "-m", "pip"]]
    run = subprocess.run(
        [sys.executable, *installing[0][1:4], "--version"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert run.stdout.startswith("pip ")


@pytest.mark.parametrize("file", ["action.yml", ".github/workflows/ci.yml"])
def test_actions_of_others_are_pinned_to_a_commit(file: str) -> None:
    used = re.findall(r"uses: (\S+)(.*)", (ROOT / file).read_text(encoding="utf-8"))
    assert used
    for name, version in used:
        assert name == "./" or (re.fullmatch(r"[\w-]+/[\w-]+@[0-9a-f]{40}", name) and re.match(r" # v\d", version))


def test_what_the_action_installs_is_pinned() -> None:
    lines = (ROOT / ".github/constraints.txt").read_text(encoding="utf-8").splitlines()
    pins = [line for line in lines if not line.startswith("#")]
    assert all(re.fullmatch(r"[a-z0-9-]+==[0-9][0-9a-z.]*", line) for line in pins)
    with (ROOT / "pyproject.toml").open("rb") as file:
        project = tomllib.load(file)["project"]
    names = {line.partition("==")[0] for line in pins}
    for requirement in (*project["dependencies"], *project["optional-dependencies"]["engines"]):
        name = re.match(r"[A-Za-z0-9._-]+", requirement)
        assert name is not None
        assert re.sub(r"[._]", "-", name[0].lower()) in names or ";" in requirement


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
