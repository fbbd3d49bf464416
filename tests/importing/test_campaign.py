"""A small part of the campaign of damaged files; ``python -m tests.importing.campaign`` runs more of it."""

from __future__ import annotations

import pytest

from tests.importing.campaign import broken_meshes, files


@pytest.mark.parametrize("count", [40, pytest.param(300, marks=pytest.mark.slow)])
def test_a_damaged_file_is_imported_and_exported_or_refused_by_name(count: int) -> None:
    found, failures = files(count, seed=count)
    assert failures == []
    assert min(found["refused"], found["imported"]) >= count // 10
    assert sum(found.values()) == count


@pytest.mark.parametrize("count", [40, pytest.param(300, marks=pytest.mark.slow)])
def test_a_damaged_mesh_is_read_or_refused_by_name(count: int) -> None:
    found, failures = broken_meshes(count, seed=count)
    assert failures == []
    assert min(found["refused"], found["read"]) >= count // 10
    assert sum(found.values()) == count
