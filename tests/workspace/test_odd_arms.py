"""A small part of the campaign of ``scripts/odd_arms.py``."""

from __future__ import annotations

from dataclasses import replace

import pytest

from dh2sim.workspace.workspace import compute_workspace
from scripts import odd_arms
from scripts.odd_arms import ODD, odd_arm, problems_of


@pytest.mark.parametrize("name", ["one_sided", pytest.param("hayati", marks=pytest.mark.slow)])
def test_reach_and_motions_of_odd_arms_agree_with_searches_and_differences(name: str) -> None:
    assert list(problems_of(odd_arm(name), starts=2)) == []


def test_the_campaign_has_twenty_arms_and_notices_a_reach_that_is_not_the_greatest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert len(ODD) == 20

    def swapped(*args: object, **options: object) -> object:
        found = compute_workspace(*args, **options)  # type: ignore[arg-type]
        return replace(found, extremes={**found.extremes, "highest": found.extremes["lowest"]})

    monkeypatch.setattr(odd_arms, "compute_workspace", swapped)
    [said] = problems_of(odd_arm("gantry"), starts=2)
    assert said.startswith("highest: ")
