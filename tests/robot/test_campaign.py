"""Random robot files, read and modelled without a traceback; and those that are robots exported, validated, imported.

The same as ``python -m tests.robot.campaign``, with fewer files.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.robot.campaign import chunks, read, whole
from tests.robot.random_files import RandomFiles


def test_the_same_seed_makes_the_same_files() -> None:
    one, other = RandomFiles(3), RandomFiles(3)
    assert [one.any() for _ in range(20)] == [other.any() for _ in range(20)]


def test_a_campaign_goes_on_where_its_log_ends(tmp_path: Path) -> None:
    log = tmp_path / "log"
    [first] = chunks("read", 5, 3, log)
    assert first["found"] == read(5, 3)[0]
    assert list(chunks("read", 5, 3, log)) == [first]
    assert len(log.read_text().splitlines()) == 1
    [other] = chunks("read", 5, 4, log)
    assert other["seed"] == 4
    assert len(log.read_text().splitlines()) == 2


@pytest.mark.parametrize("count", [250, pytest.param(8_000, marks=pytest.mark.slow)])
def test_random_files_are_read_or_refused(count: int) -> None:
    found, failures = read(count, seed=count)
    assert failures == []
    assert found["accepted"] > count / 10
    assert found["refused"] > count / 10


@pytest.mark.parametrize("count", [3, pytest.param(150, marks=pytest.mark.slow)])
def test_random_robots_are_exported_validated_and_imported(count: int) -> None:
    found, failures = whole(count, seed=count)
    assert failures == []
    assert found["accepted"] == count
