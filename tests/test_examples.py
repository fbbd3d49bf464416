"""The scripts of ``examples/`` and the code of ``docs/library.md`` run, and do what they say."""

from __future__ import annotations

import io
import re
import subprocess
import sys
from contextlib import redirect_stdout
from pathlib import Path

import pytest

from tests.program import environment

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"
PAGE = ROOT / "docs" / "library.md"

ERRORS: dict[str, dict[str, float]] = {
    "batch_kinematics": {},
    "calibrate_robot": {r"calibrated: off by (\S+) mm": 0.3, r"by at most (\S+) m\n": 1e-14},
    "control_with_generated_code": {r"to within (\S+) rad": 1e-3},
    "convert_convention": {r"tool0: at most (\S+) apart": 1e-14},
    "design_sweep": {r"its own table by at most (\S+) m": 1e-12},
    "export_to_mujoco": {r"by the table: (\S+) m apart": 1e-14},
    "import_urdf": {r"axis: at most (\S+) m apart": 1e-12},
    "inverse_kinematics": {
        r"vectors, off the pose by at most (\S+)": 1e-12,
        r"line, off the pose by at most (\S+)": 1e-9,
    },
    "load_in_pybullet": {
        r"by the table: at most (\S+) m": 1e-14,
        r"MuJoCo: at most (\S+) N·m": 1e-12,
        r"MuJoCo: at most (\S+) kg": 1e-12,
    },
    "own_controller": {},
    "robot_in_code": {r"urdf: off the table by at most (\S+) m": 1e-14, r"mjcf: .* at most (\S+) m": 1e-14},
    "rollouts_on_ray": {},
    "rollouts_to_xarray": {r"joint_1 follows its reference to within (\S+)": 0.01},
}
"""Every example, with the errors that it prints and their bounds."""


def test_every_example_is_run() -> None:
    assert sorted(path.stem for path in EXAMPLES.glob("*.py")) == sorted(ERRORS)


@pytest.mark.slow
@pytest.mark.parametrize("name", ERRORS)
def test_an_example_runs_and_prints_errors_that_are_rounding(name: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", str(EXAMPLES / f"{name}.py")],
        cwd=tmp_path,
        env=environment(PYTHONPATH=str(ROOT)),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    if "this example needs" in done.stderr:
        pytest.skip(done.stderr.strip())
    assert done.returncode == 0, done.stderr
    assert done.stdout
    for pattern, bound in ERRORS[name].items():
        found = re.search(pattern, done.stdout)
        assert found is not None, done.stdout
        assert 0.0 <= float(found[1]) < bound


@pytest.mark.slow
def test_examples_and_the_public_names_pass_strict_type_checks(tmp_path: Path) -> None:
    """As a user's own project would check them: nothing that dh2sim returns is an Any."""
    config = tmp_path / "mypy.ini"
    config.write_text(
        "[mypy]\nstrict = True\nfollow_imports = silent\n"
        "[mypy-mujoco.*,pybullet.*,ray.*]\nignore_missing_imports = True\n"  # no type hints, or not installed
    )
    script = tmp_path / "user_script.py"
    script.write_text(TYPES)
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--config-file", config, script, *sorted(EXAMPLES.glob("*.py"))],
        cwd=tmp_path,
        env=environment(MYPYPATH=str(ROOT)),
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


TYPES = """
from collections.abc import Mapping
from typing import assert_type

import numpy as np
import xarray as xr
from numpy.typing import NDArray

import dh2sim
from dh2sim import Continuous, Fixed, LinkSpec, Pose, Prismatic, Revolute, Robot, RobotSpec
from dh2sim.export import ExportReport
from dh2sim.simulate import rollout
from dh2sim.validate.report import RobotReport

Array = NDArray[np.float64]

robot = Robot([Revolute(d=1), Prismatic(limits=[0, 1]), Continuous(), Fixed(link=LinkSpec(mass=2))], tool=np.eye(4))
assert_type(robot.spec, RobotSpec)
assert_type(Robot.load("stanford"), Robot)
assert_type(Robot.from_urdf("arm.urdf"), Robot)
assert_type(robot.convert("modified"), Robot)
assert_type(robot.fk([0.0, 0.5, 0.0]), Array)
assert_type(robot.jacobian(np.zeros((2, 3))), Array)
assert_type(robot.limits, tuple[Array, Array])
assert_type(robot.configurations, Mapping[str, Array])
assert_type(robot.mjcf(), str)
assert_type(robot.code("c", ["pose", "jacobian"]), str)
assert_type(robot.export("build"), ExportReport)
assert_type(robot.validate(), RobotReport)
assert_type(robot.validate().ok, bool)
assert_type(robot.rollout(4), xr.Dataset)
assert_type(rollout("stanford", rollouts=4), xr.Dataset)
assert_type(dh2sim.forward_kinematics(robot, [0.0, 0.5, 0.0]), Array)
assert_type(dh2sim.forward_kinematics(robot.spec, [0.0, 0.5, 0.0]), Array)
assert_type(dh2sim.import_robot("arm.urdf").spec, RobotSpec)
assert_type(dh2sim.to_urdf(robot), str)
assert_type(dh2sim.__version__, str)
assert_type(Pose().xyz, Array)

robot.spec = robot.spec  # type: ignore[misc]
robot.fk()  # type: ignore[call-arg]
dh2sim.forward_kinematics("stanford", [0.0])  # type: ignore[arg-type]
dh2sim.to_sdf(robot)  # type: ignore[attr-defined]
"""


def code_blocks() -> list[tuple[str, str]]:
    """Every block of Python on the page, with the output that is shown below it, if any."""
    pattern = r"^```python\n(.*?)^```\n(?:\n```text\n(.*?)^```)?"
    return re.findall(pattern, PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)


@pytest.mark.slow
def test_the_code_of_the_page_prints_what_is_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    assert len(code_blocks()) >= 10
    for code, output in code_blocks():
        printed = io.StringIO()
        with redirect_stdout(printed):
            exec(compile(code, PAGE.name, "exec"), names)
        if output:
            assert printed.getvalue() == output
