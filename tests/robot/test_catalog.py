"""The list of robots that come with dh2sim, against the robots themselves."""

from __future__ import annotations

from dh2sim.robot.catalog import builtin_robots, summaries
from dh2sim.robot.read import load_robot


def test_what_the_list_says_of_a_robot_is_what_its_file_says() -> None:
    found = list(summaries())
    assert tuple(summary.name for summary in found) == builtin_robots()
    for summary in found:
        spec = load_robot(summary.name)
        assert summary.joints == "".join("R" if row.type.turns else "P" for row in spec.moving_rows)
        assert summary.conventions == tuple(dict.fromkeys(row.convention.value for row in spec.rows))
        assert summary.description == " ".join(spec.description.split())
        assert summary.source == " ".join(spec.source.split())
