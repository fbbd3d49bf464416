"""``dh2sim grade`` as teachers see it."""

from __future__ import annotations

import csv
import json
from pathlib import Path

from tests.program import dh2sim
from tests.robot_files import small, write


def test_a_class_is_graded_into_a_table_and_csv(tmp_path: Path) -> None:
    solution = write(tmp_path, small("solution"))
    folder = tmp_path / "hand_in"
    folder.mkdir()
    write(folder, small("anna"))
    write(folder, small("ben", length=400))
    (folder / "carl.yaml").write_text("name: [", encoding="utf-8")
    table = tmp_path / "class.csv"
    run = dh2sim("grade", solution, folder, "-o", table)
    assert (run.status, run.err) == (1, "")
    assert "ben.yaml: 8 of 10, length-unit\n  - mm are read as m in all lengths\n" in run.out
    assert "mean 6 of 10 points" in run.out
    rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    assert [(Path(row["submission"]).stem, row["points"], row["outcome"]) for row in rows] == [
        ("anna", "10", "right"),
        ("ben", "8", "length-unit"),
        ("carl", "0", "unreadable"),
    ]
    assert json.loads(dh2sim("grade", solution, folder, "--json").out)[1]["points"] == 8
    assert dh2sim("grade", solution, folder / "anna.yaml").status == 0


def test_wrong_arguments_end_with_2(tmp_path: Path) -> None:
    solution = write(tmp_path, small("solution"))
    for words in (
        ["none.yaml", solution],
        [solution, tmp_path / "none.yaml"],
        [solution, solution, "--rubric", tmp_path / "none.yaml"],
        [solution, solution, "--csv", "--json"],
        [solution],
    ):
        run = dh2sim("grade", *words)
        assert (run.status, run.out) == (2, ""), words
        assert "Traceback" not in run.err
