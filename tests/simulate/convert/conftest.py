from __future__ import annotations

from pathlib import Path

import pytest

from tests.simulate.convert.samples import Arrays, make_arrays, make_layout, write_run


@pytest.fixture(scope="session")
def arrays() -> Arrays:
    """The numbers of the run."""
    return make_arrays(make_layout())


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory, arrays: Arrays) -> Path:
    """A complete run, not to be changed."""
    return write_run(tmp_path_factory.mktemp("runs") / "run.zarr", make_layout(), arrays)


@pytest.fixture(scope="session")
def unfinished(tmp_path_factory: pytest.TempPathFactory, arrays: Arrays) -> Path:
    """A run whose last block is missing, not to be changed."""
    return write_run(tmp_path_factory.mktemp("runs") / "run.zarr", make_layout(), arrays, blocks=2)
