"""The list of robots that come with dh2sim, against the robots themselves."""

from __future__ import annotations

from dh2sim.robot.catalog import (
    builtin_group,
    builtin_groups,
    builtin_mechanisms,
    builtin_robots,
    mechanism_summaries,
    summaries,
)
from dh2sim.robot.read import load_robot


def test_what_the_list_says_of_a_robot_is_what_its_file_says() -> None:
    found = [*summaries(), *mechanism_summaries()]
    groups = {**builtin_groups(), "mechanism": builtin_mechanisms()}
    assert [(summary.group, summary.name) for summary in found] == [
        (group, name) for group, names in groups.items() for name in names
    ]
    for summary in found:
        spec = load_robot(summary.name)
        assert summary.joints == "".join("R" if row.type.turns else "P" for row in spec.moving_rows)
        assert summary.conventions == tuple(dict.fromkeys(row.convention.value for row in spec.all_rows))
        assert summary.description == " ".join(spec.description.split())
        assert summary.source == " ".join(spec.source.split())


def test_every_robot_is_in_one_group() -> None:
    assert sorted(name for names in builtin_groups().values() for name in names) == list(builtin_robots())


def test_a_robot_is_in_the_group_of_its_file_and_a_changed_one_in_none() -> None:
    source = load_robot("ur5e").source_file
    assert source is not None
    assert builtin_group("ur5e", source.text) == "cobot"
    assert builtin_group("ur5e", source.text + "\n") is None
    assert builtin_group("ur10e", source.text) is None
    assert builtin_group("mine", source.text) is None
