"""Grades of tables, and rubrics."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dh2sim.compare.grading import Rubric, class_csv, grade, read_rubric
from dh2sim.errors import RobotFileError
from dh2sim.robot.write import robot_file_text
from tests.compare.disguises import disguised, random_table
from tests.refusals import refusal
from tests.robot_files import write
from tests.sample_robots import robot

RIGHT = """\
name: arm
convention: standard
joints:
  - {type: revolute, d: 0.3, alpha: pi/2}
  - {type: revolute, a: 0.4, alpha: 0.3}
  - {type: revolute, a: 0.2, d: 0.1, alpha: -pi/2}
  - {type: revolute, d: 0.15}
"""


def test_a_right_table_written_otherwise_has_full_points(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    table = random_table(rng, 5, odd=True)
    other = tmp_path / "other.yaml"
    other.write_text(robot_file_text(disguised(table, rng)), encoding="utf-8")
    [given] = grade(table, [other])
    assert (given.points, given.outcome, given.comments, given.full) == (10.0, "right", (), True)


def test_one_submission_may_be_given_alone(tmp_path: Path) -> None:
    file = write(tmp_path, RIGHT)
    [given] = grade(file, str(file))
    assert (given.submission, given.points) == (str(file), 10.0)


@pytest.mark.parametrize(
    ("old", "new", "outcome", "points", "comment"),
    [
        ("alpha: 0.3}", "alpha: -0.3}", "sign", 8, "alpha of row 2 has the wrong sign"),
        ("standard", "modified", "convention", 5, "a table in the standard convention is read as modified"),
        ("d: 0.1,", "d: 0,", "lost", 7, "d of row 3 is missing, 100 mm"),
        ("a: 0.4", "a: 400", "length-unit", 8, "mm are read as m in a of row 2"),
        ("d: 0.1,", "d: 0.12,", "value", 8, "d of row 3 is 120 mm, not 100 mm"),
        ("  - {type: revolute, d: 0.15}\n", "", "missing-row", 4, "row 4 is missing"),
        ("alpha: 0.3}", "alpha: [}", "unreadable", 0, "not valid YAML"),
    ],
)
def test_a_misreading_is_named_and_gives_its_points(
    tmp_path: Path, old: str, new: str, outcome: str, points: float, comment: str
) -> None:
    solution, wrong = write(tmp_path, RIGHT), write(tmp_path, RIGHT.replace(old, new), "wrong")
    [given] = grade(solution, [wrong])
    assert (given.outcome, given.points) == (outcome, points)
    assert any(comment in text for text in given.comments)


def test_a_rubric_gives_points_by_kind_and_takes_them_off_for_free_choices(tmp_path: Path) -> None:
    file = tmp_path / "rubric.yaml"
    file.write_text("points: 20\nkinds: {sign: 15}\noff: {base: 2, zero: 1}\n", encoding="utf-8")
    rubric = read_rubric(file)
    assert rubric == Rubric(points=20.0, kinds={"sign": 15.0}, off={"base": 2.0, "zero": 1.0})
    moved = tmp_path / "moved.yaml"
    moved.write_text(robot_file_text(robot("stanford_shoulder_origin")), encoding="utf-8")
    [given] = grade("stanford", [moved], rubric=rubric)
    assert (given.points, given.comments) == (18.0, ("2 off, as base differs",))


def test_everything_wrong_in_a_rubric_is_reported_at_its_place(tmp_path: Path) -> None:
    file = tmp_path / "rubric.yaml"
    file.write_text("points: -1\nkinds: {sgin: 3, sign: 1" + "0" * 399 + "}\noff: [1]\nmore: 2\n", encoding="utf-8")
    assert [line.split("rubric.yaml")[1] for line in refusal(RobotFileError, read_rubric, file).splitlines()] == [
        ":1:9: points: expected a number of at least 0, found -1",
        ":2:9: kinds.sgin: unknown key 'sgin'. Did you mean 'sign'? Allowed: sign, value, length-unit, angle-unit, "
        "lost, added, swapped-rows, swapped-columns, shifted, reversed, convention, type, missing-row, extra-row, "
        "wrong, joints, unreadable",
        ":2:24: kinds.sign: expected a number of at least 0, found a number of too many digits",
        ":3:6: off: expected a mapping, found a list",
        ":4:1: more: unknown key 'more'. Allowed: points, kinds, off",
    ]


def test_files_of_strangers_are_graded_whatever_they_are(tmp_path: Path) -> None:
    bad = {
        "empty.yaml": b"",
        "binary.bin": bytes(range(256)),
        "loops.yaml": b"name: x\nconvention: standard\njoints: &a [*a]\n",
        "urdf.urdf": b"<robot name='x'><link name='a'/></robot>",
        "entities.urdf": b'<!DOCTYPE r [<!ENTITY a "b">]><robot name="x">&a;</robot>',
        "mesh.yaml": RIGHT.encode() + b"base: {mesh: {file: /etc/passwd}}\n",
        "words.md": b"I did not do it.",
        "csv.csv": b"=cmd()|1,2,3\n",
    }
    for name, data in bad.items():
        (tmp_path / name).write_bytes(data)
    grades = grade("scara", sorted(tmp_path.iterdir()))
    assert {given.outcome for given in grades} == {"unreadable"}
    assert all(given.points == 0 and given.comments for given in grades)
    assert len(class_csv(grades).splitlines()) == 1 + len(bad)
