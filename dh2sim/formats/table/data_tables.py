"""Tables in programs and files of data: a list a parameter, a matrix under a comment, a record a joint.

    a = [0, 0.4]; alpha = [pi/2, 0]; d = [0.1, 0]               lists, in Python, MATLAB, C, YAML or JSON
    # theta d a alpha                                           a matrix; the comment says which column is what
    DH = [[q1, 0.1, 0, pi/2], [q2, 0, 0.4, 0]]
    {"a": 0, "alpha": "pi/2", "d": 0.1}, …                      records, as dictionaries or keywords
    {alpha0: 0, a0: 0, d1: 0.1, q1: q1, alpha1: -pi/2, …}       one dictionary with numbered names

They are read as text; nothing is run.
"""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

from dh2sim.formats.table.dh_table import Given, Table
from dh2sim.formats.table.grid import MAX_COLUMNS, MAX_ROWS, Cell, Cells, Grid, TextPlaces
from dh2sim.formats.table.headers import PARAMETERS, Quantity, are_headings, parameters_in, read_heading
from dh2sim.formats.table.notation import LONGEST_CELL
from dh2sim.robot.row import Convention

_MODULES: Final = r"(?:(?:np|numpy|math|sp|sympy|sym|torch|cmath|std)\s*(?:\.|::)\s*)?"
_LIST: Final = re.compile(
    r"(?<![\w.'\"])(?:self\.|this\.)?[\"']?([^\W\d][\w.]*)[\"']?\s*(?:(?:\[\s*\w*\s*\]\s*)*)[:=]\s*"
    rf"(?:{_MODULES}(array|asarray|deg2rad|radians|Matrix|matrix|mat|tensor|list|tuple)\s*\(\s*"
    rf"(?:{_MODULES}(?:array|asarray)\s*\(\s*)?)?(?=[\[({{])"
)
_IN_DEGREES: Final = re.compile(rf"[\s)]*\*\s*(?:deg\w*|d2r|(?i:to_?rad)|{_MODULES}pi\s*/\s*180(?:\.0?)?)(?!\w)")
_CALL: Final = re.compile(
    r"(?<![\w.])[A-Za-z_][\w.]*\s*\((?=\s*[\"']?[A-Za-z_]\w*[\"']?\s*=)|\{(?=\s*[\"']?[^\W\d]\w*[\"']?\s*[:=])"
)
_PAIR: Final = re.compile(r"\s*[\"']?([^\W\d][\w ]*?)[\"']?\s*[:=](?!=)\s*(.*?)\s*", re.DOTALL)
_NUMBERED: Final = re.compile(r"(alpha|a|d|theta|th|q|r)_?\{?(\d{1,3})\}?")
_BLOCK_PAIR: Final = re.compile(
    r"\s*(?:-\s+)?[\"']?([^\W\d][\w ]*?)[\"']?\s*[:=]\s*([^\s#].*?)?\s*,?\s*(?:#.*|//.*)?"
)
_COMMENTS: Final = re.compile(r"(?<![\w\\&'\"])(?:#|//|%)[^\n'\"]*$", re.MULTILINE)
_COMMENT: Final = re.compile(r"[#%;*]|//")
_AFFIXES: Final = re.compile(
    r"^(?:m?dh|dhp|params?|link|joint)[_.]|[_.](?:list|arr|array|vec|vector|values?|params?|dh)$", re.IGNORECASE
)
_PI: Final = re.compile(rf"{_MODULES}(?:\bpi\b|\bPI\b)|\bM_PI\b|\bMath\.PI\b|\bTMath::Pi\(\)")
_PI_OVER: Final = re.compile(r"\bM_PI_([24])\b")
_TO_RADIANS: Final = re.compile(
    rf"{_MODULES}(?:deg2rad|radians|to_?rad(?:ians)?)\s*\(\s*([-+]?[\d.]+)\s*\)", re.IGNORECASE
)
_LONGEST: Final = 20_000
_LONGEST_RECORD: Final = 2_000
_MAX_FOUND: Final = 3_000
_MAX_PROBLEMS: Final = 20
"""Brackets that are looked at; one that is never closed counts for many."""
_BLOCKS: Final = (".yaml", ".yml", ".toml", ".ini", ".cfg")
_FIXED_TRANSFORM: Final = re.compile(r"setFixedTransform\s*\([^;\n]*[\"'](m?dh)[\"']")
_FIXED_ROW: Final = re.compile(r"setFixedTransform\s*\(\s*([^\W\d]\w*)[^,\n]*,\s*(?=\[)")
_BODY_JOINT: Final = re.compile(
    r"([^\W\d]\w*)[^=\n]{0,20}=\s*rigidBodyJoint\s*\([^;\n]*[\"'](revolute|prismatic|fixed)[\"']", re.IGNORECASE
)
_MATLAB_COLUMNS: Final = ("a", "alpha", "d", "theta")
"""Of MATLAB's ``setFixedTransform``, as its reference page has them."""
_MATLAB_CONVENTIONS: Final = {"dh": Convention.STANDARD, "mdh": Convention.MODIFIED}
_MATLAB_THETA: Final = "MATLAB's setFixedTransform ignores theta of a joint that turns; here it is the joint's offset"
_TOOLBOX: Final = re.compile(r"(?:Revolute|Prismatic)M?DH|DHLink|Link|Revolute|Prismatic")
"""Constructors that the readers of scripts follow; what they cannot follow is no record."""
_CONVENTIONS: Final = r"(?:m?dh|standard|modified|classic\w*|craig|distal|proximal)"
_COORDINATE: Final = re.compile(
    r"(?<![\w.])(?:self\.)?(?:q|theta|th|q_?vec|joints?|(?:joint_?)?angles?|joint_?(?:positions?|coordinates?)|thetas|qs)"
    r"\s*(?:\[\s*(\d{1,3})\s*\]|\(\s*(\d{1,3})\s*\))",
    re.IGNORECASE,
)
"""An element of a joint vector, from 0 or from 1."""
_NAMED_DH: Final = re.compile(r"dh|denavit", re.IGNORECASE)


def data_tables(lines: Sequence[str], suffix: str) -> tuple[list[Table], list[tuple[int, int, str]]]:
    """Return the tables of a program or a file of data, and matrices whose columns are not named.

    Args:
        lines: The lines of the file.
        suffix: The ending of its name, in lower case.
    """
    text = _COMMENTS.sub(lambda found: " " * len(found.group()), "\n".join(lines))
    places = TextPlaces(lines)
    problems: list[tuple[int, int, str]] = []
    if not any(sign in text for sign in "[{(") and suffix not in _BLOCKS:
        return [], []
    found = [
        *_lists(text, places),
        *_matrices(text, lines, places, problems),
        *_fixed_transforms(text, places),
        *_numbered(text, places),
        *_records(text, places),
    ]
    if suffix in _BLOCKS:
        found += _blocks(lines)
    return found, problems


def _closing(text: str, start: int, longest: int) -> int | None:
    """Return the offset of the bracket that closes the one at an offset."""
    depth, quote = 0, ""
    for position in range(start, min(len(text), start + longest)):
        sign = text[position]
        if quote:
            quote = "" if sign in (quote, "\n") else quote
        elif sign in "\"'" and not (
            sign == "'" and position and (text[position - 1].isalnum() or text[position - 1] in ")]")
        ):
            quote = sign
        elif sign in "([{":
            depth += 1
        elif sign in ")]}":
            depth -= 1
            if depth == 0:
                return position
    return None


def _items(text: str, start: int, end: int, *, spaced: bool = True) -> list[tuple[int, int]]:
    """Return where the items between two brackets are: between commas, or else between spaces, as in MATLAB."""
    depth, commas = 0, []
    for position in range(start, end):
        sign = text[position]
        depth += (sign in "([{") - (sign in ")]}")
        if sign == "," and depth == 0:
            commas.append(position)
    if commas or not spaced:
        return [
            (a, b)
            for a, b in zip([start, *(c + 1 for c in commas)], [*commas, end], strict=True)
            if text[a:b].strip() or b != end
        ]
    spans: list[tuple[int, int]] = []
    for found in re.finditer(r"\S+", text[start:end]):
        begin, stop = start + found.start(), start + found.end()
        before = text[spans[-1][0] : spans[-1][1]] if spans else ""
        if spans and (
            before[-1] in "+-*/("
            or found.group()[0] in "*/)"
            or (found.group()[0] in "+-" and len(found.group()) == 1)
        ):
            spans[-1] = (spans[-1][0], stop)
        else:
            spans.append((begin, stop))
    return spans


def _cell(text: str, start: int, end: int, places: TextPlaces) -> Cell:
    raw = text[start:end]
    line, column = places.at(start + len(raw) - len(raw.lstrip()))
    return Cell(text=_plainer(raw), line=line, column=column)


def _plainer(raw: str) -> str:
    """Return an expression of a program as a cell would have it."""
    text = raw.strip().strip("\"'").strip()
    if len(text) > LONGEST_CELL:
        return text
    text = _TO_RADIANS.sub(r"\1°", _PI_OVER.sub(r"pi/\1", _PI.sub("pi", text)))
    text = re.sub(r"\b(?:np|numpy|math|sp|sympy|std)\s*(?:\.|::)\s*(?=[a-z])", "", text)
    text = re.sub(r"(?<=[\d.])\s*\*\s*(?:deg|DEG|d2r|D2R|(?i:deg2rad|to_rad))\b", "°", text)
    text = re.sub(r"(?<=[\d.])[fF]\b", "", text)
    text = _COORDINATE.sub(lambda found: f"q{found[1] or found[2]}", text)
    return "" if text in ("None", "null", "nan", "np.nan") else " ".join(text.split())


@functools.lru_cache(maxsize=4096)
def _heading(name: str) -> str | None:
    """Return the heading that a name in a program stands for, or None."""
    name = name.rpartition(".")[2][:60]
    for _ in range(3):
        name = _AFFIXES.sub("", name)
    for text in (name, name.removesuffix("s"), re.sub(r"s(?=_)", "", name)):
        if text and read_heading(Cell(text=text, line=1, column=1)).quantity not in (None, Quantity.JOINT):
            return text
    return None


def _parameters(headings: Sequence[Cell]) -> set[Quantity | None]:
    return {read_heading(heading).quantity for heading in headings} & set(PARAMETERS)


def _lists(text: str, places: TextPlaces) -> Iterator[Table]:
    columns: list[tuple[Cell, list[Cell]]] = []
    seen: set[Quantity | None] = set()
    count = 0
    for found in _LIST.finditer(text):
        start = found.end()
        text_of_name = _heading(found[1])
        if text_of_name is None:
            continue
        count += 1
        if count > _MAX_FOUND:
            break
        end = _closing(text, start, _LONGEST)
        if end is None or any(sign in text[start + 1 : end] for sign in "[{;"):
            count += _MAX_FOUND // 50 if end is None else 0
            continue
        line, column = places.at(found.start(1))
        name = Cell(text=text_of_name, line=line, column=column)
        if found[2] in ("deg2rad", "radians") or _IN_DEGREES.match(text, end + 1):
            name = Cell(text=f"{name.text} (deg)", line=name.line, column=name.column)
        cells = [_cell(text, *span, places) for span in _items(text, start + 1, end)][: MAX_ROWS + 1]
        quantity = read_heading(name).quantity
        if quantity in seen:
            yield from _of_columns(columns)
            columns, seen = [], set()
        columns.append((name, cells))
        seen.add(quantity)
    yield from _of_columns(columns)


def _of_columns(columns: Sequence[tuple[Cell, list[Cell]]]) -> Iterator[Table]:
    if not are_headings([name for name, _ in columns][:MAX_COLUMNS]):
        return
    lengths = [len(cells) for name, cells in columns if _parameters([name])]
    size = max(set(lengths), key=lambda length: (lengths.count(length), length))
    problems = tuple(
        (name.line, name.column, f"{name.text} has {len(cells)} values, and other lists {size}")
        for name, cells in columns
        if len(cells) != size
    )
    if size == 0:
        return
    header = tuple(name for name, _ in columns)
    rows = tuple(
        tuple(
            cells[i] if i < len(cells) else Cell(text="", line=name.line, column=name.column)
            for name, cells in columns
        )
        for i in range(size)
    )
    yield _table(header, rows, problems)


def _table(header: Cells, rows: Sequence[Cells], problems: tuple[tuple[int, int, str], ...] = ()) -> Table:
    lines = [cell.line for row in (header, *rows) for cell in row]
    return Table(
        header=header,
        rows=tuple(rows),
        grid=Grid(rows=(header, *rows), separator="["),
        extent=range(min(lines), max(lines) + 1),
        problems=problems,
    )


def _matrices(
    text: str, lines: Sequence[str], places: TextPlaces, problems: list[tuple[int, int, str]]
) -> Iterator[Table]:
    fixed = _FIXED_TRANSFORM.search(text)
    count = 0
    for found in _LIST.finditer(text):
        start = found.end()
        end = _closing(text, start, _LONGEST)
        count += 1 if end is not None else _MAX_FOUND // 50
        if count > _MAX_FOUND or len(problems) > _MAX_PROBLEMS:
            break
        rows = _matrix_rows(text, start, end, places) if end is not None else []
        width = len(rows[0]) if rows else 0
        if not 4 <= width <= 12 or len(rows) > MAX_ROWS or any(len(row) != width for row in rows):
            continue
        line, column = places.at(found.start(1))
        names = _named_columns(lines, line, rows[0][0].line, width)
        if names is not None:
            header = tuple(Cell(text=name, line=line, column=column) for name in names)
            yield _table(header, rows)
        elif fixed is not None and width == 4:
            header = tuple(Cell(text=name, line=line, column=column) for name in _MATLAB_COLUMNS)
            yield _of_matlab(header, rows, fixed[1])
        elif _NAMED_DH.search(found[1]):
            how = "write a comment above it, such as '# theta d a alpha'"
            message = f"this may be a DH table, and nothing says which column is what; {how}"
            problems.append((line, column, message))


def _matrix_rows(text: str, start: int, end: int, places: TextPlaces) -> list[Cells]:
    inside = text[start + 1 : end]
    if "[" in inside or "{" in inside or "(" in inside[: len(inside) - len(inside.lstrip()) + 1]:
        spans = []
        for a, b in _items(text, start + 1, end):
            item = text[a:b]
            first = a + len(item) - len(item.lstrip())
            if first >= end or text[first] not in "[{(":
                if item.strip():
                    return []
                continue
            close = _closing(text, first, _LONGEST)
            if close is None:
                return []
            spans.append((first + 1, close))
    elif ";" in inside or "\n" in inside.strip():
        spans, position = [], start + 1
        for found in re.finditer(r";|\n", inside):
            spans.append((position, start + 1 + found.start()))
            position = start + 1 + found.end()
        spans.append((position, end))
        spans = [(a, b) for a, b in spans if text[a:b].replace("...", "").strip()]
    else:
        return []
    rows = [tuple(_cell(text, *span, places) for span in _items(text, a, b)) for a, b in spans[: MAX_ROWS + 1]]
    return [row for row in rows if row]


def _named_columns(lines: Sequence[str], name: int, first: int, width: int) -> list[str] | None:
    """Return the headings that a comment above a matrix, or at its first line, gives."""
    for number in [*range(first, name - 1, -1), *range(name - 1, max(0, name - 5), -1)]:
        line = lines[number - 1][:500]
        sign = _COMMENT.search(line)
        if sign is None:
            continue
        comment = line[sign.end() :].strip(" #%/*;")
        best = max(_headings_of_comment(comment, width), key=parameters_in, default=())
        if are_headings(best):
            return [cell.text for cell in best]
    return None


def _headings_of_comment(comment: str, width: int) -> Iterator[Cells]:
    """Yield what may be headings in a comment: of ``DH = [theta d a alpha]``, of ``rows are theta, d, a, alpha``."""
    comment = re.sub(rf"\([^()]*\b{_CONVENTIONS}\b[^()]*\)", "", comment, flags=re.IGNORECASE)
    for text in (comment, *re.findall(r"\[([^\[\]]{5,})\]", comment), *re.findall(r"[:=]([^:=]*)$", comment)):
        for words in (re.split(r"\s*[,|;&]\s*|\t+|\s{2,}", text), re.split(r"[\s,|;&\[\](){}]+", text)):
            cells = [Cell(text=name, line=1, column=1) for word in words if (name := word.strip(" []{}()*:"))]
            yield from (
                tuple(cells[skip:][:width]) for skip in {0, 1, len(cells) - width} if len(cells) - skip == width
            )


def _fixed_transforms(text: str, places: TextPlaces) -> Iterator[Table]:
    """Yield the table of MATLAB's ``setFixedTransform(joint, [a alpha d theta], 'dh')``, a call a row."""
    types = {found[1]: found[2] for found in _BODY_JOINT.finditer(text)}
    rows: dict[str, list[Cells]] = {}
    for found in itertools.islice(_FIXED_ROW.finditer(text), _MAX_FOUND):
        end = _closing(text, found.end(), _LONGEST_RECORD)
        kind = re.match(r"\s*,\s*[\"'](m?dh)[\"']", text[end + 1 : end + 20]) if end is not None else None
        if kind is None or end is None:
            continue
        cells = tuple(_cell(text, *span, places) for span in _items(text, found.end() + 1, end))
        if len(cells) == 4 and len(rows.setdefault(kind[1], [])) <= MAX_ROWS:
            moves = replace(cells[0], text=types.get(found[1], ""))
            rows[kind[1]].append((*cells, moves))
    for name, of_kind in rows.items():
        first = of_kind[0][0]
        header = tuple(replace(first, text=column) for column in (*_MATLAB_COLUMNS, "type"))
        typed = all(row[-1].text for row in of_kind)
        yield _of_matlab(header if typed else header[:-1], [row if typed else row[:-1] for row in of_kind], name)


def _of_matlab(header: Cells, rows: Sequence[Cells], name: str) -> Table:
    """Return the table of ``setFixedTransform(…, name)``."""
    offset = any(row[3].text.strip("0.") for row in rows)
    given = Given(by=f"setFixedTransform(…, '{name}')", convention=_MATLAB_CONVENTIONS[name])
    return replace(_table(header, rows), given=given, notes=(_MATLAB_THETA,) if offset else ())


def _records(text: str, places: TextPlaces) -> Iterator[Table]:
    records: list[dict[str, Cell]] = []
    last = 0
    count = 0
    for found in _CALL.finditer(text):
        if found.start() < last or _TOOLBOX.fullmatch(found.group().rstrip("( \t\n").rpartition(".")[2]):
            continue
        opened = found.end() - 1
        end = _closing(text, opened, _LONGEST_RECORD)
        count += 1 if end is not None else _MAX_FOUND // 200
        if count > _MAX_FOUND:
            break
        record = _record(text, opened + 1, end, places) if end is not None else None
        if record is None or end is None:
            continue
        if records and len(re.findall(r"\n", text[last : found.start()])) > 20:
            yield from _of_records(records)
            records = []
        records.append(record)
        last = end
    yield from _of_records(records)


def _record(text: str, start: int, end: int, places: TextPlaces) -> dict[str, Cell] | None:
    """Return the cells of a record by their headings; None where it is not a row of DH parameters."""
    record: dict[str, Cell] = {}
    for a, b in _items(text, start, end, spaced=False):
        pair = _PAIR.fullmatch(text[a:b])
        if pair is None:
            continue
        heading = _heading(pair[1])
        if heading is not None and not pair[2].startswith(("[", "{")):
            record[heading] = _cell(text, a + pair.start(2), a + pair.end(2), places)
    return record if are_headings([Cell(text=name, line=1, column=1) for name in record][:MAX_COLUMNS]) else None


def _of_records(records: Sequence[Mapping[str, Cell]]) -> Iterator[Table]:
    names = list(dict.fromkeys(name for record in records for name in record))
    if not names or len(names) > MAX_COLUMNS:
        return
    firsts = [next(iter(record.values())) for record in records]
    header = tuple(Cell(text=name, line=firsts[0].line, column=firsts[0].column) for name in names)
    rows = [
        tuple(record.get(name, Cell(text="", line=first.line, column=first.column)) for name in names)
        for record, first in zip(records, firsts, strict=True)
    ]
    yield _table(header, rows)


def _blocks(lines: Sequence[str]) -> Iterator[Table]:
    """Yield the records of YAML, TOML or an INI file: a key and a value a line."""
    records: list[dict[str, Cell]] = []
    current: dict[str, Cell] = {}
    for number, line in enumerate([*lines, "end:"], start=1):
        if len(records) > MAX_ROWS:
            break
        pair = _BLOCK_PAIR.fullmatch(line[:500])
        key = pair[1] if pair else ""
        starts = line.lstrip().startswith(("- ", "[")) or (pair is not None and pair[2] is None)
        heading = _heading(key) if key else None
        if starts or (heading is not None and heading in current):
            if are_headings([Cell(text=name, line=1, column=1) for name in current][:MAX_COLUMNS]):
                records.append(current)
            current = {}
        if pair is not None and heading is not None and pair[2] is not None and not pair[2].startswith(("[", "{")):
            current[heading] = Cell(text=_plainer(pair[2]), line=number, column=pair.start(2) + 1)
    yield from _of_records(records)


def _numbered(text: str, places: TextPlaces) -> Iterator[Table]:
    """Yield the tables of dictionaries such as ``{alpha0: 0, a0: 0, d1: 0.75, q1: q1}``."""
    for count, found in enumerate(re.finditer(r"\{(?=\s*[\"']?(?:alpha|a|d|theta|q)_?\d)", text)):
        end = _closing(text, found.start(), _LONGEST) if count < 50 else None
        if end is None:
            continue
        cells: dict[str, dict[int, Cell]] = {}
        for a, b in _items(text, found.start() + 1, end, spaced=False):
            pair = _PAIR.fullmatch(text[a:b])
            name = _NUMBERED.fullmatch(pair[1]) if pair else None
            if pair is not None and name is not None:
                key = {"q": "theta", "th": "theta", "r": "a"}.get(name[1], name[1])
                cells.setdefault(key, {})[int(name[2])] = _cell(text, a + pair.start(2), a + pair.end(2), places)
        yield from _of_numbered(cells)


def _of_numbered(cells: Mapping[str, Mapping[int, Cell]]) -> Iterator[Table]:
    if not {"alpha", "a", "d"} <= cells.keys():
        return
    link = {*cells["alpha"], *cells["a"]}
    joint = {*cells["d"], *cells.get("theta", {})}
    shift = 1 if min(link) < min(joint) else 0
    index = "{i-1}" if shift else "i"
    names = {"alpha": f"alpha_{index}", "a": f"a_{index}", "d": "d_i", "theta": "theta_i"}
    names = {key: name for key, name in names.items() if key in cells}
    first = next(iter(cells["alpha"].values()))
    header = tuple(Cell(text=name, line=first.line, column=first.column) for name in names.values())
    rows, problems = [], []
    for number in sorted({*joint, *(i + shift for i in link)})[: MAX_ROWS + 1]:
        row = []
        for key in names:
            i = number - shift if key in ("alpha", "a") else number
            cell = cells[key].get(i)
            if cell is None:
                problems.append((first.line, first.column, f"{key}{i} is not given"))
                cell = Cell(text="", line=first.line, column=first.column)
            row.append(cell)
        rows.append(tuple(row))
    yield _table(header, rows, tuple(problems))
