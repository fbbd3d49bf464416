"""The convention comes from what the table and its caption say, never from a guess."""

from __future__ import annotations

import pytest

from dh2sim.robot.row import Convention
from tests.formats.table.samples import complaints, imported

ROWS = "|---|---|---|---|\n| θ1 | 0 | 1 | 0 |\n"
PLAIN = "| θ | d | a | α |\n" + ROWS
CRAIG = "| θ_i | d_i | a_{i-1} | α_{i-1} |\n" + ROWS
INDEXED = "| θ_i | d_i | a_i | α_i |\n" + ROWS
UNKNOWN = (
    "nothing says which convention the table is in; pass convention='standard' or convention='modified'. Headings "
    "a_(i-1), alpha_(i-1) would say modified; docs/conventions.md shows how to find out"
)


@pytest.mark.parametrize(
    ("caption", "expected"),
    [
        ("Standard DH parameters of the arm", "standard"), ("DH parameters (standard convention)", "standard"),
        ("convention: standard", "standard"), ("**Classic** D-H notation", "standard"), ("stdDH", "standard"),
        ("Distal table", "standard"), ("DH table after Spong", "standard"),
        ("conventional DH parameters", "standard"),
        ("Modified DH parameters", "modified"), ("The arm, after Craig", "modified"), ("proximal", "modified"),
        ("convention: modified", "modified"), ("MDH_parameters", "modified"),
        ("## Modified Denavit-Hartenberg", "modified"),
    ],
)  # fmt: skip
def test_a_caption_says_the_convention(caption: str, expected: str) -> None:
    for text in (f"{caption}\n\n{PLAIN}", f"{PLAIN}\n{caption}\n"):
        if not (caption.startswith("##") and text.startswith("|")):
            assert imported(text).spec.convention == expected
            assert imported(text).spec.rows[0].convention == expected


@pytest.mark.parametrize(
    "caption",
    [
        "", "The robot in its standard configuration", "A modified gripper is mounted", "Craigslist", "standards",
        "\n".join(["Standard DH parameters", *["."] * 12]), "| standard | DH |\n|---|---|\n| 1 | 2 |\n",
    ],
)  # fmt: skip
def test_other_words_and_words_far_away_do_not(caption: str) -> None:
    text = f"{caption}\n\n{PLAIN}"
    line = text[: text.index("θ")].count("\n") + 1
    assert complaints(text) == [f"t.md:{line}:3: {UNKNOWN}"]


def test_the_heading_of_the_next_section_does_not_speak_of_this_table() -> None:
    text = f"## Standard DH parameters\n\n{PLAIN}\n## Modified DH parameters\n\n{PLAIN}"
    found = imported(text)
    assert found.spec.convention is Convention.STANDARD
    assert found.notes[0] == (
        "the file has 2 tables, of which the first was read; pass table=2 for the second. They are: 1 on line 3 "
        "(θ, d, a, α); 2 on line 9 (θ, d, a, α)"
    )
    assert imported(text, table=2).spec.convention is Convention.MODIFIED


def test_headings_of_index_i_minus_1_say_modified() -> None:
    found = imported(CRAIG)
    assert found.spec.convention is Convention.MODIFIED
    assert found.notes[-1] == "no unit of lengths is given: they were read in m"


def test_headings_of_index_i_throughout_are_read_as_standard_and_noted() -> None:
    found = imported(INDEXED)
    assert found.spec.convention is Convention.STANDARD
    assert found.notes[-1] == (
        "nothing but the headings' index i says the convention: it was read as standard; a table after Craig is "
        "modified"
    )
    assert imported(INDEXED, convention=Convention.MODIFIED).spec.convention is Convention.MODIFIED
    assert imported(f"After Craig\n\n{INDEXED}").spec.convention is Convention.MODIFIED


@pytest.mark.parametrize("convention", [Convention.STANDARD, Convention.MODIFIED])
def test_the_option_says_it(convention: Convention) -> None:
    assert imported(PLAIN, convention=convention).spec.convention is convention


def test_what_contradicts_itself_is_refused_with_both_sides() -> None:
    end = "; correct the one that is wrong"
    assert complaints(CRAIG, convention=Convention.STANDARD) == [
        f"t.md:1:3: convention='standard' says standard, but the heading 'a_{{i-1}}' says modified{end}"
    ]
    assert complaints(f"Modified DH\n\n{PLAIN}", convention=Convention.STANDARD) == [
        f"t.md:3:3: convention='standard' says standard, but 'Modified' on line 1 says modified{end}"
    ]
    assert complaints(f"Standard DH\n\n{CRAIG}") == [
        f"t.md:3:3: the heading 'a_{{i-1}}' says modified, but 'Standard' on line 1 says standard{end}"
    ]
    assert complaints(f"Standard, not modified, DH\n\n{PLAIN}") == [
        f"t.md:3:3: 'Standard' on line 1 says standard, but 'modified' on line 1 says modified{end}"
    ]


def test_indices_that_do_not_go_together_are_refused() -> None:
    text = INDEXED.replace("a_i |", "a_{i-1} |", 1)
    assert complaints(text) == [
        "t.md:1:15: the headings' indices contradict each other: a and alpha have index i - 1 in a modified "
        "table and i in "
        "a standard one, d and theta always i; correct them, or pass convention='modified' or convention='standard'"
    ]
