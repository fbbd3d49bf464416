"""Tables become robot files: numbers as printed or made simple, names, notes."""

from __future__ import annotations

import math

from dh2sim.importing.table import import_table
from dh2sim.robot.row import Convention

ROUNDED = b"theta,d (m),a (m),alpha (rad)\nq1,0.4,0,-1.571\nq2,0.15000004,0.3,0.5\n"


def test_numbers_stay_as_printed_and_what_was_assumed_is_noted_in_sentences() -> None:
    imported = import_table(ROUNDED, file="t.csv", convention=Convention.STANDARD)
    assert [row.alpha for row in imported.spec.rows] == [-1.571, 0.5]
    assert imported.residual is None
    assert all(note[0].isupper() and note.endswith(".") for note in imported.notes)


def test_a_tolerance_makes_rounded_numbers_simple_and_says_so() -> None:
    imported = import_table(ROUNDED, file="t.csv", convention=Convention.STANDARD, tolerance=1e-3)
    first, second = imported.spec.rows
    assert first.alpha == -math.pi / 2
    assert (second.d, second.a) == (0.15, 0.3)
    assert abs(second.alpha - 0.5) < 1e-3
    assert imported.notes[-1] == "Numbers within 0.001 rad or m of a simple one were made simple."


def test_the_file_names_the_robot_unless_another_name_is_given() -> None:
    assert import_table(ROUNDED, file="folder/my arm.csv", convention=Convention.STANDARD).spec.name == "my_arm"
    assert import_table(ROUNDED, file="-", convention=Convention.STANDARD).spec.name == "robot"
    named = import_table(ROUNDED, file="-", convention=Convention.STANDARD, name="scara")
    assert named.spec.name == "scara"
