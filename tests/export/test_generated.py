"""The exports that are committed are what the robot files say."""

from __future__ import annotations

from pathlib import Path

import pytest

from dh2sim import build_model
from dh2sim.export import drift
from dh2sim.model.mechanism import build_mechanism
from dh2sim.robot.catalog import builtin_mechanisms
from dh2sim.robot.read import load_robot
from tests.sample_robots import NAMES, robot

GENERATED = Path(__file__).parents[2] / "generated"

pytestmark = pytest.mark.skipif(
    not any(GENERATED.glob("*/*.urdf")), reason="generated/ is empty: 'dh2sim export robots/*.yaml' fills it"
)


@pytest.mark.parametrize("name", [*NAMES, *builtin_mechanisms()])
def test_the_committed_export_is_what_the_robot_file_says(name: str) -> None:
    spec = robot(name) if name in NAMES else load_robot(name)
    assert drift(build_mechanism(spec) if spec.is_mechanism else build_model(spec), GENERATED) == []


def test_every_committed_folder_belongs_to_a_robot() -> None:
    names = {robot(name).name for name in NAMES} | set(builtin_mechanisms())
    assert {path.name for path in GENERATED.iterdir() if path.is_dir()} == names
