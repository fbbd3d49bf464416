"""``dh2sim diff`` as its users see it."""

from __future__ import annotations

import json
from pathlib import Path

from tests.program import dh2sim
from tests.robot_files import small, write


def test_the_same_mechanism_is_reported_with_what_differs() -> None:
    run = dh2sim("diff", "stanford", "stanford_shoulder_origin")
    assert (run.status, run.err) == (0, "")
    assert "The same mechanism, but:\n  - base differs by 0 0 400 mm\n" in run.out


def test_different_mechanisms_are_named_and_json_says_the_same(tmp_path: Path) -> None:
    short, long = write(tmp_path, small("short")), write(tmp_path, small("long", length=0.6))
    run = dh2sim("diff", short, long)
    assert (run.status, run.err) == (1, "")
    assert "first difference: the axes of joint_1 and joint_2 are 400 mm apart in A, 600\n    mm in B" in run.out
    assert "a of row 1 is 600 mm, not 400 mm" in run.out
    report = json.loads(dh2sim("diff", short, long, "--json").out)
    assert (report["same"], report["difference"]["a"], report["difference"]["b"]) == (False, 0.4, 0.6)
    assert [found["kind"] for found in report["misreadings"]] == ["value"]


def test_another_limit_is_another_robot_unless_mechanisms_alone_are_asked_for(tmp_path: Path) -> None:
    one, other = write(tmp_path, small("one")), write(tmp_path, small("other").replace("[-2, 2]", "[-2, 1.5]", 1))
    run = dh2sim("diff", one, other)
    assert (run.status, run.err) == (1, "")
    assert "The same mechanism." in run.out
    assert "joint_1: position limits" in run.out
    report = json.loads(dh2sim("diff", one, other, "--json").out)
    assert (report["same"], report["equal"]) == (True, False)
    run = dh2sim("diff", one, other, "--kinematics")
    assert run.status == 0
    assert "limits" not in run.out


def test_bad_input_ends_with_2(tmp_path: Path) -> None:
    for words in (["four_bar", "scara"], ["scara", "none"], ["scara", "scara", "--tolerance", "-1"], ["scara"]):
        run = dh2sim("diff", *words)
        assert (run.status, run.out) == (2, ""), words
        assert run.err, words
