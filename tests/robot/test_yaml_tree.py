"""YAML is read with places, within bounds, and nothing surprising is let in."""

from __future__ import annotations

import sys
import time

import pytest

from dh2sim.robot import yaml_tree
from dh2sim.robot.catalog import builtin_path, builtin_robots
from dh2sim.robot.yaml_tree import MAX_BYTES, MAX_DEPTH, MAX_LINE, MAX_NODES, Node, Report, compose, decode
from tests.robot.files import MINIMAL, complaints, robot


def _tree(text: str) -> Node:
    report = Report("r.yaml")
    root = compose(decode(text.encode(), report), report)
    assert report.problems == []
    return root


def test_every_key_and_value_knows_its_line_and_column() -> None:
    root = _tree("a: 1\nb:\n  - x\n  - {c: 'y'}\n")
    entry = root.entry("b", 1, "c")
    assert entry is not None
    assert (entry.line, entry.column) == (4, 6)
    assert (entry.value.line, entry.value.column, entry.value.value) == (4, 9, "y")
    node = root.at("b", 0)
    assert node is not None
    assert (node.line, node.column, node.value) == (3, 5, "x")


def test_places_that_are_not_there_are_none() -> None:
    root = _tree("a: [1]\n")
    assert root.at("b") is None
    assert root.at("a", 1) is None
    assert root.at("a", "x") is None
    assert root.at(0) is None
    assert root.entry("a", "x") is None
    assert root.entry("a", 0) is None


def test_quoted_scalars_are_text() -> None:
    root = _tree("a: '1'\nb: \"true\"\nc: |\n  2\n")
    assert [node.value for key in "abc" if (node := root.at(key))] == ["1", "true", "2\n"]


def test_aliases_share_the_node() -> None:
    root = _tree("a: &x [1, 2]\nb: *x\n*k : 1\n".replace("*k ", "k"))
    assert root.at("a") is root.at("b")


def test_an_alias_can_be_a_key() -> None:
    root = _tree("a: &x name\n*x : 1\n")
    entry = root.entry("name")
    assert entry is not None
    assert (entry.line, entry.column) == (2, 1)


def test_byte_order_mark_is_tolerated() -> None:
    assert robot("\ufeff" + MINIMAL).name == "r"


def test_yaml_1_2_directive_is_tolerated() -> None:
    assert robot("%YAML 1.2\n---\n" + MINIMAL + "...\n").name == "r"


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_any_line_end_ends_a_line(end: str) -> None:
    assert robot(MINIMAL.replace("\n", end)).name == "r"
    assert complaints(f"a: 1{end}b: \x07{end}".encode()) == ["r.yaml:2:4: control character U+0007 is not allowed"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "1:1: the file is empty; a robot needs at least name, convention and joints"),
        ("# nothing\n", "1:1: the file is empty; a robot needs at least name, convention and joints"),
        ("a: 1\n---\nb: 2\n", "2:1: a second YAML document; a robot file holds one"),
        ("%YAML 1.1\n---\na: 1\n", "2:1: only YAML 1.2 is read"),
        (
            "a: !!python/object:os.system x\n",
            "1:4: a: tag '!!python/object:os.system' is not allowed; write the value alone",
        ),
        ("a: [1, !foo 2]\n", "1:8: a[1]: tag '!foo' is not allowed; write the value alone"),
        ("a: ! x\n", "1:4: a: tag '!' is not allowed; write the value alone"),
        ("!!map {a: 1}\n", "1:1: tag '!!map' is not allowed; write the value alone"),
        ("a: &x [1, *x]\n", "1:11: a[1]: alias 'x' is inside its own anchor"),
        ("a: *x\n", "1:4: a: alias 'x' has no anchor before it"),
        (
            "a: [1, 2\n",
            "2:1: not valid YAML: expected ',' or ']', but got '<stream end>', while parsing a flow sequence",
        ),
        ("a: b: c\n", "1:5: not valid YAML: mapping values are not allowed here"),
        ("a:\n\t- 1\n", "2:1: not valid YAML: a tab in the indentation; YAML is indented with spaces"),
        ('a: "\\Uffffffff"\n', "1:1: not valid YAML: an invalid escape or character"),
        ("a: x\x1b[31m\n", "1:5: control character U+001B is not allowed"),
        ("a: b\nc: \x00\n", "2:4: control character U+0000 is not allowed"),
        ('a: ["\\e[31m"]\n', "1:5: a[0]: control character U+001B is not allowed"),
        ('a: "\\ud800"\n', "1:4: a: control character U+D800 is not allowed"),
    ],
)
def test_text_that_is_not_a_robot_file_is_refused_with_its_place(text: str, message: str) -> None:
    assert complaints(text) == [f"r.yaml:{message}"]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("name: é\n".encode("latin-1"), "1:7: not UTF-8: byte 0xe9"),
        (b"a: 1\nb: \xc3\xa9 \xff\n", "2:6: not UTF-8: byte 0xff"),
        ("name: r\n".encode("utf-16"), "1:1: not UTF-8: byte 0xff; it seems to be UTF-16: save it as UTF-8"),
    ],
)
def test_bytes_that_are_not_utf_8_are_reported_with_their_place(data: bytes, message: str) -> None:
    assert complaints(data) == [f"r.yaml:{message}"]


def test_text_with_a_lone_surrogate_is_refused() -> None:
    assert complaints("a: \ud800\n") == ["r.yaml:1:4: not UTF-8: byte 0xed"]


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ("name: x\n", "5:1: duplicate key 'name'; it is on line 1 already"),
        ("tool: {xyz: [0, 0, 0], xyz: [0, 0, 0]}\n", "5:24: tool: duplicate key 'xyz'; it is on line 5 already"),
        ("<<: {a: 1}\n", "5:1: merge keys ('<<') are not supported; write the keys out"),
        ("1: x\n", "5:1: a key must be text, found 1; put it in quotes"),
        ("true: x\n", "5:1: a key must be text, found true; put it in quotes"),
        ("? [a, b]\n: 1\n", "5:3: a key must be text, found a list"),
        ("? {a: b}\n: 1\n", "5:3: a key must be text, found a mapping"),
        ("~: 1\n", "5:1: a key must be text, found nothing"),
    ],
)
def test_bad_keys_are_reported_once_and_nothing_else_is(keys: str, message: str) -> None:
    assert complaints(MINIMAL + keys) == [f"r.yaml:{message}"]


def test_keys_that_a_merge_would_have_brought_are_not_missed() -> None:
    text = "name: r\nconvention: standard\njoints:\n- &row {type: revolute}\n- {<<: *row, a: 1}\n"
    assert complaints(text) == ["r.yaml:5:4: joints[1]: merge keys ('<<') are not supported; write the keys out"]


def test_bad_keys_do_not_hide_other_mistakes() -> None:
    assert complaints("name: r\nname: s\nconvention: x\njoints:\n- {type: revolute, 1: 2}\n") == [
        "r.yaml:2:1: duplicate key 'name'; it is on line 1 already",
        "r.yaml:3:13: convention: found 'x'. Allowed: standard, modified, hayati",
        "r.yaml:5:20: joints[0]: a key must be text, found 1; put it in quotes",
    ]


def test_a_file_that_is_too_large_is_refused_before_it_is_parsed() -> None:
    start = time.process_time()
    assert complaints("a" * 10_000_000) == [
        f"r.yaml:1:1: the file has 10000000 bytes; at most {MAX_BYTES} are allowed"
    ]
    assert time.process_time() - start < 1


def test_a_line_that_is_too_long_is_refused() -> None:
    assert complaints("name: r\n" + "a" * 900_000 + ": 1\n") == [
        f"r.yaml:2:1: the line has 900003 characters; at most {MAX_LINE} are allowed"
    ]


@pytest.mark.parametrize("bracket", ["[", "{"])
def test_deep_nesting_is_refused_at_once(bracket: str) -> None:
    start = time.process_time()
    (message,) = complaints(bracket * 100_000)
    assert message.startswith("r.yaml:1:33: ")
    assert message.endswith(f"nested deeper than {MAX_DEPTH} levels")
    assert time.process_time() - start < 3


def test_nesting_through_aliases_counts() -> None:
    text = "a0: &a0 [1]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}]\n" for i in range(1, 40))
    assert complaints(text) == ["r.yaml:31:12: a30[0]: nested deeper than 32 levels"]


def test_a_billion_laughs_end_at_once() -> None:
    laughs = "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 20))
    start = time.process_time()
    (message,) = complaints("a0: &a0 [lol, lol, lol, lol, lol, lol, lol, lol, lol]\n" + laughs)
    assert message.endswith(f"more than {MAX_NODES} values (aliases counted each time)")
    assert time.process_time() - start < 1


@pytest.mark.slow
def test_too_many_values_are_refused() -> None:
    (message,) = complaints("a:\n" + "- []\n" * (MAX_NODES + 1))
    assert message.endswith(f"more than {MAX_NODES} values (aliases counted each time)")


def _flat(node: Node) -> object:
    """Return all that a tree holds."""
    match node.value:
        case dict() as entries:
            value: object = [(key, *entry[:3], _flat(entry.value)) for key, entry in entries.items()]
        case list() as items:
            value = [_flat(item) for item in items]
        case scalar:
            value = repr(scalar)
    return (node.line, node.column, node.start, node.end, node.text, node.flow, node.anchor, node.wrong, value)


ODD = """\
name: "\u00e9 \U0001f916"
\u00fcm: 'it''s'
plain: on
number: 1e-3
octal: 0o17
list: [1,
  2, {a: , b: ~}]
block: |
  a

  b
folded: >-
 c
 d
nothing:
&a anchored: &b {x: 1}
again: *b
"""


@pytest.mark.parametrize("name", [*builtin_robots(), "odd"])
def test_both_parsers_find_the_same_tree(name: str) -> None:
    path = builtin_path(name)
    text = ODD if path is None else path.read_text(encoding="utf-8")
    fast = yaml_tree._fast(text)
    assert fast is not None
    composer = yaml_tree._Composer(Report("r.yaml"))
    for event in yaml_tree._events(text, Report("r.yaml")):
        composer.take(event)
    assert composer.root is not None
    assert _flat(fast) == _flat(composer.root)


@pytest.mark.parametrize(
    "text", ["a: [1", "a: 1\na: 2", "%YAML 1.2\n---\na: 1", "a: \u2028b", "- \n- 1", "a: !!int 1", "a:\tb", ""]
)
def test_problems_and_what_yaml_1_1_takes_differently_are_left_to_the_pure_parser(text: str) -> None:
    assert yaml_tree._fast(text) is None


def test_the_pure_parser_is_used_where_libyaml_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "yaml.cyaml", None)
    yaml_tree._fast.cache_clear()
    assert yaml_tree._fast("a: 2") is None
    assert compose("a: 2", Report("r.yaml")).at("a") is not None
    yaml_tree._fast.cache_clear()
