from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.program import dh2sim
from tests.robot_files import ODD, write


@pytest.fixture(scope="session")
def exported_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Export a robot whose fixed link has mass, so that engines read it even if its joint is made to move."""
    folder = tmp_path_factory.mktemp("exported")
    inertia = "{ixx: 0.01, iyy: 0.01, izz: 0.01, ixy: 0, ixz: 0, iyz: 0}"
    text = ODD.replace("theta: 1.9}", f"theta: 1.9, link: {{mass: 1, com: [0, 0, 0], inertia: {inertia}}}}}")
    assert dh2sim("export", write(folder, text), "--out", folder / "made").status == 0
    return folder


@pytest.fixture
def exported(exported_once: Path, tmp_path: Path) -> Path:
    """A folder with odd.yaml and its export in made/, free to be changed."""
    shutil.copytree(exported_once, tmp_path, dirs_exist_ok=True)
    return tmp_path
