"""Texts, names and comments are written such that the reader of robot files reads the same."""

from __future__ import annotations

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dh2sim.robot.yaml_text import WIDTH, comment_lines, quoted, text_lines, word
from dh2sim.robot.yaml_tree import NOT_PRINTABLE, Report, compose, decode

ALPHABET = st.characters(exclude_categories=["Cs"]) | st.sampled_from(
    " \n\t\r\"'\\:#-?[]{},&*!|>%@`~\x85\u2028\ufeff"
)
TEXTS = st.text(ALPHABET, max_size=300).filter(lambda text: NOT_PRINTABLE.search(text) is None)
PROSE = st.lists(
    st.lists(st.text("aAé.,:#-'\"0", min_size=1, max_size=12), max_size=40).map(" ".join), max_size=4
).map("\n".join)


def _read(text: str) -> object:
    """Return the value of ``key`` of a YAML mapping."""
    report = Report("r.yaml")
    node = compose(decode(text.encode(), report), report).at("key")
    assert report.problems == []
    assert node is not None
    return node.value


@given(TEXTS | PROSE)
@example("")
@example("# no comment")
@example("a: b")
@example("a #b")
@example("a:")
@example("ends in a space ")
@example("null")
@example("---")
@example("yes")
@example("1e5")
@example("one line " * 30)
@example("one line " * 30 + "\n")
@example("two\n\nparagraphs " + "long " * 30 + "end")
@example("a line feed\nbefore  two spaces " + "long " * 30 + "end")
@example("long " * 30 + "end\n\n")
@example("\n" + "long " * 30 + "end")
def test_any_text_reads_back(text: str) -> None:
    lines = text_lines("key", text)
    assert _read("\n".join([*lines, "after: 1", ""])) == text
    assert not any("\n" in line for line in lines)


@given(TEXTS)
@example("y")
@example("null")
@example("True")
@example("1.stl")
@example("0x1")
@example("../a/b.stl")
@example("a: b, c]")
def test_any_name_reads_back_inside_brackets(text: str) -> None:
    assert _read(f"key: {word(text)}\n") == text
    report = Report("r.yaml")
    node = compose(f"{{other: 1, key: {word(text)}, {quoted(text + 'x')}: 2}}\n", report)
    assert node.at("key").value == text  # type: ignore[union-attr]
    assert node.at(text + "x").value == 2  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("joint_1", "joint_1"),
        ("link-7.stl", "link-7.stl"),
        ("../meshes/b1.stl", "../meshes/b1.stl"),
        ("/meshes/b1.stl", "/meshes/b1.stl"),
        ("my mesh.stl", '"my mesh.stl"'),
        ("a,b.stl", '"a,b.stl"'),
        ("null", '"null"'),
        ("True", '"True"'),
        ("no", '"no"'),
        ("N", '"N"'),
        ("7.stl", '"7.stl"'),
        ("", '""'),
        ('a"b\\c', '"a\\"b\\\\c"'),
        ("é", '"é"'),
    ],
)
def test_names_are_quoted_only_where_they_need_it(text: str, written: str) -> None:
    assert word(text) == written


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("Stanford arm, six joints; (1969) [a]", ["key: Stanford arm, six joints; (1969) [a]"]),
        ("6 joints", ['key: "6 joints"']),
        ("Table: slides", ['key: "Table: slides"']),
        ("two\nlines", ["key: >-", "  two", "", "  lines"]),
        ("a line feed at the end\n", ["key: >", "  a line feed at the end"]),
        ("tab\there", ['key: "tab\\there"']),
        (
            "no-break\xa0space \x85\u2028\ufeff\U000e0001",
            ['key: "no-break\\xa0space \\x85\\u2028\\ufeff\\U000e0001"'],
        ),
        ("word " * 21 + "end", ["key: >-", "  " + "word " * 18 + "word", "  word word end"]),
        ("word:  " * 21 + "end", ['key: "' + "word:  " * 21 + 'end"']),
        ("x" * 120, ["key: >-", "  " + "x" * 120]),
    ],
)
def test_texts_are_plain_folded_or_quoted(text: str, lines: list[str]) -> None:
    assert text_lines("key", text) == lines


@given(PROSE.filter(lambda text: len(text) > WIDTH))
def test_folded_lines_are_not_too_long(text: str) -> None:
    lines = text_lines("key", text)
    assert len(lines) == 1 or max(map(len, lines)) <= WIDTH


def test_characters_that_yaml_cannot_hold_are_replaced() -> None:
    assert quoted("a\x00b\ud800c\uffff") == '"a\ufffdb\ufffdc\ufffd"'
    assert comment_lines(["a\x07b"]) == ["# a\ufffdb"]


@given(st.lists(st.text(max_size=200) | TEXTS, max_size=5))
def test_comments_are_nothing_but_comments(texts: list[str]) -> None:
    lines = comment_lines(texts)
    assert all(line == "#" or line.startswith("# ") for line in lines)
    assert max([len(line) for line in lines], default=0) <= WIDTH
    assert _read("\n".join([*lines, "key: value", ""])) == "value"


def test_comments_keep_their_lines_and_long_ones_are_wrapped() -> None:
    assert comment_lines(["one", "two\nthree\n", "", "  drawn   so  ", "word " * 25 + "end"]) == [
        "# one",
        "# two",
        "# three",
        "#",
        "#   drawn   so",
        "# " + "word " * 18 + "word",
        "# word word word word word word end",
    ]
