"""Whatever stands in a file, reading it ends soon, in a robot or in a Dh2simError with a place inside the file."""

from __future__ import annotations

import itertools
import math
import random
import time
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dh2sim.errors import Dh2simError, ImportedFileError
from dh2sim.formats.table.read import TableImport, read_table
from dh2sim.robot.magnitudes import MOST_ROWS
from tests.formats.table.samples import STANDARD, complaints, imported, numbers
from tests.formats.table.test_data_tables import KUKA as DICTIONARY
from tests.formats.table.test_markup_tables import ARRAY, BOOKTABS, CSV_TABLE, HTML, LIST, SIDE, SIMPLE, TABULAR, WIKI
from tests.formats.table.test_matlab_script import JACO, LINKS, PUMA
from tests.formats.table.test_python_script import MODEL, SCRIPT
from tests.formats.table.test_real_tables import KUKA, PANDA, SCARA, STANFORD, STUDENT, UR5

PRINTOUTS = Path(__file__).parent / "printouts"
TABLES = [
    KUKA,
    PANDA,
    SCARA,
    STANFORD,
    STUDENT,
    UR5,
    *(
        ARRAY,
        BOOKTABS,
        CSV_TABLE,
        LIST,
        SIMPLE,
        HTML,
        SIDE,
        TABULAR,
        WIKI,
        JACO,
        LINKS,
        PUMA,
        MODEL,
        SCRIPT,
        DICTIONARY,
    ),
    *(p.read_text("utf-8") for p in sorted(PRINTOUTS.glob("*.txt"))),
]
SPICE = [
    *"|,;\t\"'*-+°π$\\{}()[]_^/ 0123456789.eqθαda±~#%\n│<>&`=",
    "<sub>", "1e999", "9**9**9", "pi/2", "q1", "theta", "alpha", "inf", "nan", "\\frac{", "**", "--", "1/0", "mm",
    "rad", "a_{i-1}", "standard DH", "modified", "\r", "\u200b", "½", "for ", "end\n", "...", "Link(", "L(1)",
    "RevoluteDH(", "self.", "SE3(", "@", "\\multicolumn{2}{c}{", "\\begin{array}", "<td", "<table>", "& ", "\\\\",
    "lambda x: x", "L(1) = L;", "{|", "|}", "|-\n", "!!", "rowspan=3 |", "<math>", "</math>", "for i = 1:3\n",
]  # fmt: skip
HEAD = "| theta | d | a | alpha |\n"


def _read(data: bytes, file: str) -> None:
    """Read a file; anything but a robot or a Dh2simError is a failure, and so is a problem without a proper place."""
    try:
        found = read_table(data, file=file, name="r")
    except ImportedFileError as error:
        lines = len(data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n"))
        places = [(problem.line, problem.column) for problem in error.problems]
        if not places or any(line < 1 or column < 1 or line > lines for line, column in places):
            raise AssertionError(f"a problem outside the file: {error}") from error
        return
    _check(found)


def _check(found: TableImport) -> None:
    assert found.spec.rows
    assert all(math.isfinite(number) for row in numbers(found.spec) for number in row)
    names = [row.name for row in found.spec.rows]
    assert len(set(names)) == len(names)
    for row in found.spec.rows:
        assert row.limits.position is None or row.limits.position[0] < row.limits.position[1]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_broken_tables_are_read_or_refused(seed: int) -> None:
    rng = random.Random(seed)
    for _ in range(500):
        text = rng.choice(TABLES)
        for _ in range(rng.randint(1, 6)):
            start = rng.randrange(len(text) + 1)
            piece = "".join(rng.choice(SPICE) for _ in range(rng.randint(0, 4)))
            text = text[:start] + piece + text[start + rng.choice([0, 1, 2, 6, 60]) :]
        _read(text.encode(), rng.choice(["a.md", "a.csv", "a.tsv", "-", "a.m", "a.py", "a.tex", "a.yaml"]))


def test_a_few_broken_tables_of_every_kind_are_read_or_refused() -> None:
    rng = random.Random(7)
    for text, file in zip(TABLES, itertools.cycle(["a.md", "a.m", "a.py", "a.tex", "-", "a.yaml"]), strict=False):
        for _ in range(4):
            start, length = rng.randrange(len(text) + 1), rng.choice([0, 1, 3, 40])
            _read((text[:start] + "".join(rng.choices(SPICE, k=3)) + text[start + length :]).encode(), file)


@given(
    st.text() | st.text(alphabet=[s for s in SPICE if len(s) == 1]) | st.binary(),
    st.sampled_from(["t.md", "t.csv", ""]),
)
@example(HEAD, "t.md")
@example(HEAD + "| | | | |\n", "t.md")
@example("theta,d,a,alpha\n\n\n", "t.csv")
@example('"theta","d","a\n', "t.csv")
@example("theta d a alpha\n\x0b1", "")
def test_any_text_is_read_as_a_table_or_refused(text: str | bytes, file: str) -> None:
    _read(text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text, file)


@given(
    st.lists(st.lists(st.sampled_from(SPICE) | st.text(max_size=8), min_size=4, max_size=4), min_size=1, max_size=4)
)
def test_any_cells_are_read_or_refused(rows: list[list[str]]) -> None:
    _read((HEAD + "|-|-|-|-|\n" + "".join(f"|{'|'.join(row)}|\n" for row in rows)).encode("utf-8", "replace"), "t.md")


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        HEAD + "| q1 | 0 | 0 | 0 |\n" * 50_000,
        "theta,d,a,alpha\n" * 60_000,
        "theta d a alpha\n" * 60_000,
        "|" * 99_999 + "\n" + HEAD,
        "a = 1 " * 16_000 + "\n" + HEAD,
        ("a=1,b=2 " * 30 + "\n") * 3_900 + HEAD,
        ("-" * 99_998 + "x\n") * 9,
        HEAD + "| q1 | " + "(" * 99_000 + " | 0 | 0 |\n",
        "x,x,x,x\n" * 100_000,
        "| theta | d |\n" * 60_000,
        '"' * 99_999,
        "theta,d,a,alpha" + ",x" * 40_000,
        ("DHRobot: " + "x" * 900 + "\n") * 1000 + HEAD,
        "theta d a alpha\n" + " " * 50_000 + "q1" + " " * 40_000 + "0 0 0\n",
        HEAD + ("|" + "$\\frac{" * 50 + "|0|0|0|\n") * 900,
        "Link(" + "[" * 90_000,
        "L(1)=Link([0 1 0 0]);\n" * 40_000,
        "%{\n" * 200_000 + "Link(1)",
        "for i=1:2\n" * 60_000 + "Link(1)",
        "RevoluteDH(d=1)\n" * 50_000,
        "RevoluteDH(d=1)\n" + "x y z\n" * 90_000,
        "```matlab\nLink(1)\n```\n" * 40_000,
        "\\begin{tabular}" * 6_000 + "&",
        "\\begin{array}{c}theta & d & a & alpha \\\\ 1&2&3&4\\end{array}\n" * 14_000,
        "<table>" + "<td>\n" * 190_000,
        "<table>\n" + "<!--\n" * 190_000,
        "<table>" + "<tr><td colspan=50 rowspan=50>x\n" * 25_000,
        "a=[\n" * 240_000,
        "{a0:0,\n" * 140_000,
        "DH=[[1,2,3,4],[1,2,3,4]]\n" * 38_000,
        HEAD + "|q1|d1|a1|0|\n" + "d1 = ((((((((((1 \n" * 50_000,
    ],
    ids=range(31),
)
def test_a_large_wrong_table_is_refused_quickly(text: str) -> None:
    start = time.thread_time()
    with pytest.raises(ImportedFileError):
        read_table(text.encode(), file="t", name="r")
    assert time.thread_time() - start < 20


def test_a_large_right_table_is_read_soon() -> None:
    start = time.thread_time()
    found = imported(
        HEAD + "|-|-|-|-|\n" + "".join(f"| q{i} + pi/2 | 0.1 | 0.2 | pi/2 |\n" for i in range(MOST_ROWS)), **STANDARD
    )
    assert time.thread_time() - start < 10
    assert len(found.spec.rows) == MOST_ROWS


def test_a_file_that_is_no_text_or_too_large_is_refused() -> None:
    assert complaints(b"theta,d\xb0") == ["t.md:1:8: not UTF-8: byte 0xb0"]
    assert complaints(b"a\n\x00") == ["t.md:2:1: control character U+0000 is not allowed"]
    assert complaints(b"x" * 1_000_001) == ["t.md:1:1: the file has 1000001 bytes; at most 1000000 are allowed"]


def test_a_byte_order_mark_and_the_line_ends_of_windows_do_no_harm() -> None:
    data = "\ufefftheta;d;a;alpha\r\nq1;0,5;0;0\r\n;;;\r\n".encode()
    assert numbers(read_table(data, file="t.csv", name="r", **STANDARD).spec) == [(0, 0.5, 0, 0)]


def test_tables_of_a_wrong_shape_are_refused() -> None:
    assert complaints(HEAD) == ["t.md:1:3: the table has headings and no rows"]
    assert complaints(HEAD + "|---|---|---|---|\n| 1 |\n| 1 | 2 | 3 | 4 | 5 |\n") == [
        "t.md:3:3: row 1: 1 cell in a table of 4 columns",
        "t.md:4:3: row 2: 5 cells in a table of 4 columns",
    ]
    assert complaints('theta,d,a,alpha\nq1,"0,1,0\n', "t.csv") == [
        "t.csv:1:1: the table has headings and no rows",
        't.csv:2:1: a double quote is never closed on this line; write two of them, "", for one inside a cell',
    ]
    many = "theta,d,a,alpha\n" + "q1,0,0,0\n" * (MOST_ROWS + 1)
    assert complaints(many, "t.csv") == [f"t.csv:1:1: the table has more than {MOST_ROWS} rows"]


def test_text_after_a_table_between_separators_is_noted() -> None:
    found = imported("theta,d,a,alpha\nq1,0,1,0\n\nq2,0,1,0\nThe end.\n", "t.csv", **STANDARD)
    assert len(found.spec.rows) == 2
    assert found.notes[-1] == "the text after the table, from line 5, was not read as rows"


def test_a_name_that_no_robot_may_have_is_refused() -> None:
    with pytest.raises(Dh2simError) as raised:
        read_table(HEAD.encode(), file="t", name="my robot")
    assert str(raised.value) == (
        "the name of a robot is made of letters, digits, '_' and '-', starting with a letter; found 'my robot'"
    )
