"""``dh2sim mobility``: what is printed, in words and as JSON."""

from __future__ import annotations

import json

from dh2sim.robot.catalog import builtin_mechanisms
from tests.program import dh2sim


def test_every_number_of_the_count_is_printed() -> None:
    lines = dh2sim("mobility", "bennett").out.splitlines()
    assert lines[0] == "bennett: 4 links, 4 joints"
    assert "F = lambda (n - j - 1) + sum f = 6 (4 - 4 - 1) + 4 = -2" in lines
    assert "F = lambda (n - 1) - sum C     = 6 (4 - 1) - 20 = -2" in lines
    assert "F = sum f - lambda of each loop = 4 - 6 = -2" in lines
    assert "finite 1: counted after walking along the loops" in lines


def test_json_holds_the_count_the_mobilities_and_the_verdict() -> None:
    found = json.loads(dh2sim("mobility", "parallel_four_bar", "--json").out)
    assert found["links"] == 5
    assert found["joints"] == 6
    assert found["freedoms"] == [1] * 6
    assert found["lambda"] == 3
    assert found["gruebler"] == found["constraints_form"] == 0
    assert (found["instantaneous"], found["finite"]) == (1, 1)
    assert found["gap"] > 1e6
    assert found["verdict"] == (
        "Counted 0, moves 1: third_crank is redundant, as is any one of link_1, second_crank in its place."
    )


def test_lines_fit_a_terminal_of_80_columns() -> None:
    for name in builtin_mechanisms():
        result = dh2sim("mobility", name)
        assert result.status == 0, result.err
        assert max(map(len, result.out.splitlines())) <= 80, name


def test_an_unknown_robot_is_refused() -> None:
    result = dh2sim("mobility", "fuor_bar")
    assert result.status == 2
    assert result.out == ""
    assert "fuor_bar" in result.err
