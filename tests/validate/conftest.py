from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.program import dh2sim
from tests.robot_files import ODD, write


@pytest.fixture(scope="session")
def exported_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exported")
    assert dh2sim("export", write(folder, ODD), "--out", folder / "made").status == 0
    return folder


@pytest.fixture
def exported(exported_once: Path, tmp_path: Path) -> Path:
    """A folder with odd.yaml and its export in made/, free to be changed."""
    shutil.copytree(exported_once, tmp_path, dirs_exist_ok=True)
    return tmp_path
