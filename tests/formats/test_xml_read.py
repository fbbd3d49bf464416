from __future__ import annotations

import time
from functools import partial

import pytest

from dh2sim.errors import ImportedFileError
from dh2sim.formats.xml_read import (
    MAX_ATTRIBUTE,
    MAX_ATTRIBUTES,
    MAX_BYTES,
    MAX_DEPTH,
    MAX_ELEMENTS,
    MAX_PROBLEMS,
    MAX_PROLOG,
    Element,
    XmlReport,
    parse_xml,
)
from tests.refusals import refusal


def parse(data: str | bytes) -> Element:
    return parse_xml(data.encode() if isinstance(data, str) else data, file="a.xml")


refused = partial(refusal, ImportedFileError, parse)


def test_elements_know_their_attributes_their_children_and_their_place() -> None:
    root = parse('<?xml version="1.0"?>\n<!-- é -->\n<a x="1">\n  <b/>é<c\n y="&lt;2"/><b><d/></b>\n</a>')
    assert (root.tag, dict(root.attributes), root.line, root.column) == ("a", {"x": "1"}, 3, 1)
    places = [(child.tag, dict(child.attributes), child.line, child.column) for child in root.children]
    assert places == [("b", {}, 4, 3), ("c", {"y": "<2"}, 4, 8), ("b", {}, 5, 13)]
    assert root.all("b") == (root.children[0], root.children[2])
    assert root.first("b") is root.children[0]
    assert root.first("d") is None
    assert [element.tag for element in root.walk()] == ["a", "b", "c", "b", "d"]


def test_attributes_without_a_blank_between_them_are_told_apart() -> None:
    root = parse("<a b=\"1\"c='2'd=\"3\">\n <e f='x'g='y'/></a>")
    assert (dict(root.attributes), dict(root.children[0].attributes)) == (
        {"b": "1", "c": "2", "d": "3"},
        {"f": "x", "g": "y"},
    )
    assert (root.children[0].line, root.children[0].column) == (2, 2)
    many = "".join(f"a{i}='1'" for i in range(30))
    assert refused(f"<a {many}/>") == "a.xml:1:1: more than 20 attributes without a blank before them"


def test_nothing_of_a_tree_can_be_changed() -> None:
    root = parse('<a x="1"/>')
    with pytest.raises(TypeError):
        root.attributes["x"] = "2"  # type: ignore[index]
    with pytest.raises(AttributeError):
        root.tag = "b"  # type: ignore[misc]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "iso-8859-1", "windows-1252"])
def test_a_file_in_a_common_encoding_is_read(encoding: str) -> None:
    declared = encoding.removesuffix("-sig")
    text = f'<?xml version="1.0" encoding="{declared}"?>\n <a name="Gelenk äöü"/>'
    root = parse(text.encode(encoding))
    assert (root.attributes["name"], root.line, root.column) == ("Gelenk äöü", 2, 2)


def test_a_byte_order_mark_is_no_column() -> None:
    assert parse("\ufeff<a/>").column == 1


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "iso-8859-1"])
@pytest.mark.parametrize(
    ("before", "between", "place"),
    [
        ("\n", "\n", (3, 2)),
        ("\r\n\t\n", "\n\n", (5, 2)),
        ("<!-- of -- me -->\n", "\n", (3, 2)),
        ("\n", " <!-- -->\n", (3, 2)),
        ("  ", "\n", (2, 2)),
    ],
)
def test_blanks_and_comments_before_the_declaration_move_no_element(
    encoding: str, before: str, between: str, place: tuple[int, int]
) -> None:
    root = parse(f'{before}<?xml version="1.0" encoding="{encoding}"?>{between} <a name="é"/>'.encode(encoding))
    assert (root.attributes["name"], root.line, root.column) == ("é", *place)


@pytest.mark.parametrize(
    ("text", "column"),
    [
        (' <?xml version="1.0"?><a/>', 23),
        ('\n<?xml version="1.0"?><a/>', 22),
        ("\n\ufeff<?xml version='1.0'?>\n<a/>", 1),
    ],
)
def test_a_declaration_behind_blanks_keeps_the_columns_of_its_line(text: str, column: int) -> None:
    assert parse(text).column == column


@pytest.mark.parametrize(
    "comment", ["<!-- ---- links ---- -->", "<!----->", "<!-- a --->", "<!-- <!-- -->", "<!------ é\n -- ------>"]
)
def test_dashes_in_a_comment_hide_no_element_and_move_none(comment: str) -> None:
    root = parse(f"<a>{comment}<b/>\n<![CDATA[<!-- -- ]]><c/></a>")
    last = comment.rpartition("\n")[2]
    b, c = root.children
    assert (b.tag, b.line, c.tag, c.column) == ("b", 1 + comment.count("\n"), "c", 21)
    assert b.column == len(last.encode("utf-8")) + (4 if last == comment else 1)


def test_a_file_of_another_encoding_than_it_says_is_refused_with_a_way_out() -> None:
    hint = 'name the file\'s encoding: <?xml version="1.0" encoding="iso-8859-1"?>'
    assert refused('<a>\n <b c="é"/></a>'.encode("latin-1")) == f"a.xml:2:8: not UTF-8: byte 0xe9; {hint}"
    assert refused("<a>\n é</a>".encode("latin-1")) == f"a.xml:2:2: not UTF-8: byte 0xe9; {hint}"


def test_an_encoding_that_is_not_read_is_named() -> None:
    allowed = "utf-8, us-ascii, iso-8859-1, utf-16, utf-16le, utf-16be, windows-1252"
    for name in ("utf-7", "idna", "undefined", "zlib", "x-" * 50):
        text = f'<?xml version="1.0" encoding="{name}"?><a/>'
        shown = repr(name if len(name) <= 60 else name[:57] + "...")
        assert refused(text) == f"a.xml:1:1: the encoding {shown} is not read. Allowed: {allowed}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "1:1: not well-formed XML: no element found"),
        ("\n\n", "3:1: not well-formed XML: no element found"),
        ("<a>", "1:4: not well-formed XML: no element found"),
        ("<a>\n</b>", "2:3: not well-formed XML: mismatched tag"),
        ("<a/>\n<b/>", "2:1: not well-formed XML: junk after document element"),
        ('<a b="1" b="2"/>', "1:10: not well-formed XML: duplicate attribute"),
        ("<a b=1/>", "1:6: not well-formed XML: not well-formed (invalid token)"),
        ("<a>\0</a>", "1:4: not well-formed XML: not well-formed (invalid token)"),
        ("<a>\n &x;</a>", "2:2: not well-formed XML: undefined entity"),
        ('<a b="&x;"/>', "1:1: not well-formed XML: undefined entity"),
        ("<a>&#27;</a>", "1:4: not well-formed XML: reference to invalid character number"),
        (
            "<a>\n<?xml version='1.0'?></a>",
            "2:1: not well-formed XML: XML or text declaration not at start of entity",
        ),
        ("<a>\n<!-- x <b/></a>", "2:1: not well-formed XML: the comment that begins on line 2 has no end '-->'"),
        ("<a>\n<!--\n-- > <b/></a>", "3:3: not well-formed XML: the comment that begins on line 2 has no end '-->'"),
        ("<a>\n<b <!-- x --> c='d'/></a>", "2:4: not well-formed XML: a comment cannot be inside a tag"),
        ("<a>\n<! -- x --></a>", "2:3: not well-formed XML: a comment begins with '<!--'"),
        ("<a>\n<<<<<<< HEAD\n</a>", "2:2: not well-formed XML: a line of a merge that was not resolved"),
        ("<a>\n<!- x --></a>", "2:4: not well-formed XML: a comment begins with '<!--'"),
        ("name: arm\njoints: []", "1:1: not well-formed XML: syntax error"),
    ],
)
def test_what_is_no_xml_is_refused_with_its_place(text: str, message: str) -> None:
    assert refused(text) == f"a.xml:{message}"


LAUGHS = "".join(f'<!ENTITY x{i + 1} "{f"&x{i};" * 10}">' for i in range(12))
REFUSED = "with declarations is refused: entities and external files are never read"


@pytest.mark.parametrize(
    ("doctype", "column"),
    [
        (f'<!DOCTYPE a [<!ENTITY x0 "lol">{LAUGHS}]>', 13),
        ('<!DOCTYPE a [<!ENTITY x12 SYSTEM "file:///etc/passwd">]>', 13),
        ("<!DOCTYPE a []>", 13),
        ('<!DOCTYPE a SYSTEM "http://example.org/a.dtd">', 46),
        ('<!DOCTYPE a PUBLIC "a" "http://example.org/a.dtd">', 50),
    ],
)
@pytest.mark.parametrize("before", [0, 100_000])
def test_an_entity_bomb_and_every_other_declaration_is_refused_at_once(
    doctype: str, column: int, before: int
) -> None:
    text = f"<!--{'-x' * (before // 2)}-->\n{doctype}<a b='&x12;'>&x12;</a>"
    start = time.thread_time()  # of this thread alone, however busy the machine is
    assert refused(text) == f"a.xml:2:{column}: <!DOCTYPE a ...> {REFUSED}"
    assert time.thread_time() - start < 2.0


def test_a_document_type_that_declares_nothing_is_harmless() -> None:
    assert parse("<!DOCTYPE robot><robot/>").tag == "robot"


def test_a_file_that_is_too_large_is_refused() -> None:
    data = b"<a>" + b" " * MAX_BYTES + b"</a>"
    assert refused(data) == f"a.xml:1:1: the file has {MAX_BYTES + 7} bytes; at most {MAX_BYTES} are read"


def test_a_file_that_never_begins_is_refused() -> None:
    message = f"a.xml:1:1: no element in the first {MAX_PROLOG} bytes"
    assert refused(b"<!--" + b">" * 3 * MAX_PROLOG + b"--><a/>") == message
    assert refused(b"<a b='" + b"x" * 3 * MAX_PROLOG + b"'/>") == message


def test_elements_as_deep_as_allowed_are_read_and_deeper_ones_refused() -> None:
    def nested(depth: int) -> str:
        return "<a>" * depth + "</a>" * depth

    assert len(list(parse(nested(MAX_DEPTH)).walk())) == MAX_DEPTH
    message = f"a.xml:1:{3 * MAX_DEPTH + 1}: elements are nested more than {MAX_DEPTH} deep"
    assert refused(nested(MAX_DEPTH + 1)) == message
    assert refused(nested(100 * MAX_DEPTH)) == message


@pytest.mark.slow
def test_too_many_elements_are_refused() -> None:
    text = "<a>\n" + "<b/>" * MAX_ELEMENTS + "</a>"
    assert refused(text) == f"a.xml:2:{4 * (MAX_ELEMENTS - 1) + 1}: more than {MAX_ELEMENTS} elements"


def test_too_many_attributes_and_too_long_ones_are_refused() -> None:
    many = " ".join(f'a{i}=""' for i in range(MAX_ATTRIBUTES + 1))
    assert refused(f"<a><b {many}/></a>") == (
        f"a.xml:1:4: an element of {MAX_ATTRIBUTES + 1} attributes; at most {MAX_ATTRIBUTES} are read"
    )
    long = "x" * (MAX_ATTRIBUTE + 1)
    message = f"a.xml:1:4: an attribute of {MAX_ATTRIBUTE + 1} characters; at most {MAX_ATTRIBUTE} are read"
    assert refused(f'<a><b c="{long}"/></a>') == message
    assert refused(f'<a><b {long}=""/></a>') == message


def test_a_report_raises_every_problem_once_in_the_order_of_the_file() -> None:
    root = parse("<a>\n<b/>\n<c/></a>")
    report = XmlReport("a.xml")
    report.check()
    for element in (root.children[1], root.children[0], root.children[1]):
        report.add(element, element.tag, "is wrong")
    with pytest.raises(ImportedFileError, match=r"^a\.xml:2:1: b: is wrong\na\.xml:3:1: c: is wrong$"):
        report.check()
    assert str(report.failure(root, "", "is worse")).startswith("a.xml:1:1: is worse\n")


def test_of_very_many_problems_the_first_are_reported_and_the_others_counted() -> None:
    root = parse("<a>" + "\n<b/>" * (MAX_PROBLEMS + 50) + "</a>")
    report = XmlReport("a.xml")
    for element in root.children:
        report.add(element, "b", "is wrong")
    with pytest.raises(ImportedFileError) as caught:
        report.check()
    lines = str(caught.value).split("\n")
    assert len(lines) == MAX_PROBLEMS + 1
    assert lines[-2:] == [
        f"a.xml:{MAX_PROBLEMS + 1}:1: b: is wrong",
        f"a.xml:{MAX_PROBLEMS + 1}:1: ~: ... and 50 more problems",
    ]
    assert report.guess("nam", ["name"]) == ""
    assert XmlReport("a.xml").guess("nam", ["name"]) == " Did you mean 'name'?"
