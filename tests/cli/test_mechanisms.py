"""Commands for serial robots refuse mechanisms in a sentence, and write nothing."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tests.program import dh2sim

REFUSED = (
    "ik four_bar --at 0.5 0.5 0",
    "ik four_bar --xyz 0.5 0.5 0",
    "symbolic four_bar",
    "symbolic four_bar --what jacobian",
    "symbolic four_bar --what dynamics",
    "symbolic four_bar --as c -o arm.c",
    "symbolic four_bar --as python --what inverse-dynamics -o arm.py",
    "workspace four_bar -o reach.csv",
    "convert four_bar --to modified -o other.yaml",
)


@pytest.mark.parametrize("command", REFUSED)
def test_a_mechanism_is_refused_and_nothing_is_written(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run = dh2sim(*command.split())
    assert (run.status, run.out) == (2, "")
    assert run.err.splitlines()[0].startswith("dh2sim: ")
    assert run.err.endswith("four_bar: has closed loops: this works on serial robots\n")
    assert run.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_info_shows_what_is_driven_what_closes_and_how_it_moves() -> None:
    run = dh2sim("info", "slider_crank")
    assert run.status == 0
    assert max(map(len, run.out.splitlines())) <= 80
    for line in (r"joint_1 +continuous +base_link +yes ", r"joint_2 +revolute +link_1 +no ", "\nMobility: Counted 1"):
        assert re.search(line, run.out)
    found = json.loads(dh2sim("info", "slider_crank", "--json").out)
    assert [joint["driven"] for joint in found["joints"]] == [True, False, False]
    assert (found["actuated"], found["mobility"]["finite"]) == (["joint_1"], 1)
    refused = dh2sim("info", "slider_crank", "--srdf")
    assert (refused.status, "slider_crank is a mechanism" in refused.err) == (2, True)


def test_info_says_that_all_joints_count_as_driven(tmp_path: Path) -> None:
    text = Path("robots/mechanisms/four_bar.yaml").read_text(encoding="utf-8").replace("actuated: [joint_1]\n", "")
    path = tmp_path / "four_bar.yaml"
    path.write_text(text, encoding="utf-8")
    assert "The file has no 'actuated': every joint counts as driven.\n" in dh2sim("info", str(path)).out


def test_the_jacobian_has_a_column_for_every_driven_joint() -> None:
    found = json.loads(dh2sim("jacobian", "delta", "home", "--json").out)
    assert found["joints"] == ["joint_1", "leg_2_joint_1", "leg_3_joint_1"]
    assert [len(row) for row in found["jacobian"]] == [3] * 6
    assert found["rank"] == 3
    text = dh2sim("jacobian", "four_bar", "120").out
    assert text.splitlines()[1].startswith("q           120 deg, ")
