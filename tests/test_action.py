"""The GitHub action, run as its runner would: its shell step, with the inputs in the environment."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from tests.checking.schemas import published_schema

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def action() -> dict[str, Any]:
    with (ROOT / "action.yml").open(encoding="utf-8") as file:
        loaded: dict[str, Any] = YAML(typ="safe").load(file)
    return loaded


@dataclass(frozen=True, slots=True)
class Done:
    """How the step that checks ended."""

    status: int
    printed: str
    outputs: dict[str, str]
    summary: str


def run_step(action: dict[str, Any], where: Path, **inputs: str) -> Done:
    """Run the step that checks in ``where``, with the action's defaults for inputs that are not given."""
    given = {
        name: inputs.get(name.replace("-", "_"), entry.get("default", "")) for name, entry in action["inputs"].items()
    }
    step = next(step for step in action["runs"]["steps"] if step.get("id") == "check")
    variables = {}
    for name, expression in step["env"].items():
        assert expression.startswith("${{ inputs.")
        variables[name] = given[expression.removeprefix("${{ inputs.").removesuffix(" }}")]
    output, summary = where.parent / f"{where.name}-output", where.parent / f"{where.name}-summary"
    for file in (output, summary):
        file.write_text("")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    files = {"GITHUB_OUTPUT": str(output), "GITHUB_STEP_SUMMARY": str(summary), "GITHUB_WORKSPACE": str(where)}
    done = subprocess.run(
        ["bash", "-eo", "pipefail", "-c", step["run"]],
        cwd=where / given["working-directory"],
        env={**os.environ, **variables, **files, "PATH": path},
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    outputs = dict(line.split("=", 1) for line in output.read_text().splitlines())
    return Done(done.returncode, done.stdout + done.stderr, outputs, summary.read_text())


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
    calls = [line.split() for step in action["runs"]["steps"] for line in str(step.get("run", "")).splitlines()]
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
    assert done.status == 0, done.printed
    assert "2 of 2 robots passed" in done.printed
    assert (repository / "report.xml").read_text(encoding="utf-8").count("<testsuite ") == 2
    assert (done.outputs["passed"], done.outputs["failed"]) == ("2", "0")
    assert json.loads(Path(done.outputs["report"]).read_text(encoding="utf-8"))["ok"] is True
    assert "| rpr | `arms/rpr.yaml` | `models/rpr` |" in done.summary


@pytest.mark.slow
def test_action_exports_afresh_without_a_folder(action: dict[str, Any], repository: Path) -> None:
    shutil.rmtree(repository / "models")
    done = run_step(action, repository, robots="rpr.yaml planar_2r.yaml", working_directory="arms", samples="20")
    assert done.status == 0, done.printed
    assert not (repository / "arms/generated").exists()


@pytest.mark.slow
def test_action_fails_and_annotates_when_a_twist_changes_its_sign(action: dict[str, Any], repository: Path) -> None:
    commit_all(repository)
    robot = repository / "arms" / "rpr.yaml"
    text = robot.read_text(encoding="utf-8")
    assert "alpha: 90" in text
    robot.write_text(text.replace("alpha: 90", "alpha: -90"), encoding="utf-8")
    done = run_step(
        action, repository, robots=".", dir="../models", working_directory="arms", samples="20", changed_since="HEAD"
    )
    assert done.status == 1
    assert "::error file=models/rpr/rpr.urdf,line=" in done.printed
    assert "::error file=arms/rpr.yaml,title=dh2sim%3A engine::mujoco-mjcf, pose: " in done.printed
    assert (done.outputs["passed"], done.outputs["failed"]) == ("0", "1")
    drawn = sorted(path.name for path in Path(done.outputs["pictures"]).iterdir())
    assert drawn == ["rpr_after.svg", "rpr_before.svg"]


def test_every_input_is_described_and_used_and_every_output_is_set(action: dict[str, Any]) -> None:
    steps = str(action["runs"]["steps"])
    for name, entry in action["inputs"].items():
        assert entry["description"]
        assert f"inputs.{name} " in steps
    for name, entry in action["outputs"].items():
        assert entry["description"]
        assert entry["value"] == f"${{{{ steps.check.outputs.{name} }}}}"
        assert f'"{name}=' in steps


@pytest.mark.parametrize(
    ("file", "schema"), [("action.yml", "github-action"), (".github/workflows/ci.yml", "github-workflow")]
)
def test_action_and_workflow_are_valid_by_their_published_schemas(file: str, schema: str) -> None:
    with (ROOT / file).open(encoding="utf-8") as stream:
        published_schema(schema).validate(YAML(typ="safe").load(stream))


@pytest.mark.parametrize("file", ["action.yml", ".github/workflows/ci.yml"])
def test_an_auditor_finds_nothing_to_report(file: str) -> None:
    program = Path(sys.executable).parent / "zizmor"
    if not program.exists():
        pytest.skip("zizmor is not installed, which comes with the extra dev")
    run = subprocess.run(
        [program, "--offline", "--no-progress", ROOT / file], capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stdout + run.stderr


# ---------------------------------------------------------------------------- hooks


@pytest.fixture(scope="module")
def hooks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A repository with the hooks, and all that is installed for them."""
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    pytest.importorskip("pre_commit", reason="pre-commit is not installed, which comes with the extra dev")
    source = tmp_path_factory.mktemp("hooks")
    for name in ("pyproject.toml", "README.md", "LICENSE", ".pre-commit-hooks.yaml"):
        shutil.copy(ROOT / name, source)
    for name in ("dh2sim", "robots"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    commit_all(source)
    return source


def commit_all(where: Path) -> None:
    for arguments in (["init", "-q"], ["add", "-A"], ["commit", "-qm", "one"]):
        identity = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
        subprocess.run(["git", *identity, *arguments], cwd=where, check=True, capture_output=True)


@pytest.mark.slow
def test_both_hooks_run_in_another_repository(hooks: Path, tmp_path: Path) -> None:
    robots = tmp_path / "robots"
    robots.mkdir()
    shutil.copy(ROOT / "robots/rpr.yaml", robots)
    shutil.copytree(ROOT / "generated/rpr", tmp_path / "generated/rpr")
    commit_all(tmp_path)

    def try_hooks() -> subprocess.CompletedProcess[str]:
        # the packages that dh2sim needs are those of this environment, so that nothing is downloaded
        packages = os.pathsep.join(path for path in sys.path if path.endswith(("site-packages", "dist-packages")))
        needs = {"PIP_NO_DEPS": "1", "PIP_NO_BUILD_ISOLATION": "0", "PYTHONPATH": packages}
        return subprocess.run(
            [sys.executable, "-m", "pre_commit", "try-repo", hooks, "--all-files", "--verbose"],
            cwd=tmp_path,
            env={**os.environ, **needs, "PRE_COMMIT_HOME": str(tmp_path.parent / "pre-commit")},
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )

    run = try_hooks()
    assert run.returncode == 0, run.stdout + run.stderr
    assert run.stdout.count("1 of 1 robot passed") == 2
    robot = robots / "rpr.yaml"
    robot.write_text(robot.read_text(encoding="utf-8").replace("alpha: 90", "alpha: 1.5708"), encoding="utf-8")
    run = try_hooks()
    assert run.returncode == 1
    assert "robots/rpr.yaml:" in run.stdout
    assert "warning [radians-in-deg]" in run.stdout
    assert "generated/rpr/rpr.urdf:" in run.stdout
    assert "error [drift]" in run.stdout
