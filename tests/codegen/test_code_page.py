from __future__ import annotations

import re
from pathlib import Path

import pytest

from dh2sim.codegen.generate import summarize
from tests.sample_robots import NAMES, model

PAGE = (Path(__file__).parents[2] / "docs" / "code.md").read_text(encoding="utf-8")
COSTS = dict(re.findall(r"^\| (\w+) \| (\d+ \+ .*) \|$", PAGE, flags=re.MULTILINE))


def test_every_robot_is_on_the_page() -> None:
    assert sorted(COSTS) == sorted(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_operations_are_those_of_the_page(name: str) -> None:
    costs = summarize(model(name), ["pose", "jacobian", "inverse-dynamics"]).operations.values()
    assert COSTS[name] == " | ".join(f"{cost.multiplications} + {cost.additions}" for cost in costs)
