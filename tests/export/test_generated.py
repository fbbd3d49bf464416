"""The exports that are committed are what the robot files say."""

from __future__ import annotations

from pathlib import Path

import pytest

from dh2sim import build_model
from dh2sim.export import drift
from tests.sample_robots import NAMES, robot

GENERATED = Path(__file__).parents[2] / "generated"

pytestmark = pytest.mark.skipif(
    not any(GENERATED.glob("*/*.urdf")), reason="generated/ is empty: 'dh2sim export robots/*.yaml' fills it"
)


@pytest.mark.parametrize("name", NAMES)
def test_the_committed_export_is_what_the_robot_file_says(name: str) -> None:
    assert drift(build_model(robot(name)), GENERATED) == []


def test_every_committed_folder_belongs_to_a_robot() -> None:
    assert {path.name for path in GENERATED.iterdir() if path.is_dir()} == {robot(name).name for name in NAMES}
