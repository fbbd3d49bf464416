"""Random robot files, read and modelled without a traceback; and those that are robots exported, validated, imported.

The same as ``python -m tests.robot.campaign``, with fewer files.
"""

from __future__ import annotations

import pytest

from tests.robot.campaign import read, whole
from tests.robot.random_files import RandomFiles


def test_the_same_seed_makes_the_same_files() -> None:
    one, other = RandomFiles(3), RandomFiles(3)
    assert [one.any() for _ in range(20)] == [other.any() for _ in range(20)]


@pytest.mark.parametrize("count", [250, pytest.param(20_000, marks=pytest.mark.slow)])
def test_random_files_are_read_or_refused(count: int) -> None:
    found, failures = read(count, seed=count)
    assert failures == []
    assert found["accepted"] > count / 10
    assert found["refused"] > count / 10


@pytest.mark.parametrize("count", [3, pytest.param(300, marks=pytest.mark.slow)])
def test_random_robots_are_exported_validated_and_imported(count: int) -> None:
    found, failures = whole(count, seed=count)
    assert failures == []
    assert found["accepted"] == count
