"""What the page on the robots says of them is what their files say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from dh2sim.robot.catalog import Summary, summaries
from tests.sample_robots import robot

from .makers import ARMS

PAGE = (Path(__file__).parents[2] / "docs" / "robots.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")] for line in re.findall(r"^\| `.*\|$", PAGE, re.MULTILINE)
]
SUMMARIES = list(summaries())
LISTED = [row for row in ROWS if len(row) == 6]


@pytest.mark.parametrize("summary", SUMMARIES, ids=[summary.name for summary in SUMMARIES])
def test_the_table_lists_every_robot_as_its_file_has_it(summary: Summary) -> None:
    [row] = [row for row in LISTED if row[0] == f"`{summary.name}`"]
    assert row[1:4] == [summary.group, summary.joints, ", ".join(summary.conventions)]
    masses = [each.link.mass for each in robot(summary.name).moving_rows]
    given = [mass for mass in masses if mass is not None]
    assert row[5] == (f"{sum(given):.3g} kg" if len(given) == len(masses) else "estimated")


def test_no_robot_is_left_out() -> None:
    assert [row[0] for row in LISTED] == [f"`{summary.name}`" for summary in SUMMARIES]


def test_every_arm_that_is_compared_with_its_makers_description_is_on_the_page() -> None:
    assert sorted(row[0] for row in ROWS if len(row) == 5) == sorted(f"`{name}`" for name in ARMS)
