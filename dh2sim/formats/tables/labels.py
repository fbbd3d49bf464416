"""What rows are called, how they are numbered, and of which type they are said to be."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Final

from dh2sim.formats.tables.columns import Columns
from dh2sim.formats.tables.findings import Findings
from dh2sim.formats.tables.grid import Cell, Cells
from dh2sim.formats.tables.headers import Quantity
from dh2sim.formats.tables.plain import plain
from dh2sim.robot.fields import is_reserved, name_problem
from dh2sim.robot.rows import default_name
from dh2sim.robot.spec import JointType
from dh2sim.robot.words import shown

TYPES: Final[Mapping[str, JointType]] = {
    **dict.fromkeys(("r", "rev", "revolute", "rotary", "rotational", "rotation", "hinge", "0"), JointType.REVOLUTE),
    **dict.fromkeys(("p", "pris", "prismatic", "sliding", "slider", "linear", "translational", "translation", "1"),
                    JointType.PRISMATIC),
    **dict.fromkeys(("c", "continuous"), JointType.CONTINUOUS),
    **dict.fromkeys(("f", "fixed", "2"), JointType.FIXED),
}  # fmt: skip
"""Words for the type of a joint; the digits are Corke's and Khalil's sigma."""
_ALLOWED: Final = "Allowed: revolute (R, 0), prismatic (P, 1), continuous, fixed"
_ORDINAL: Final = re.compile(r"(?:joint|link|axis|frame|row|j|l|a)?[ _]*#?\d+", re.IGNORECASE)


def read_types(rows: Sequence[Cells], columns: Columns, findings: Findings) -> list[JointType | None]:
    """Return the types that a table gives its rows; None where it gives none."""
    cells = [columns.cell(row, Quantity.TYPE) for row in rows]
    if cells and cells[0] is None:
        cells = [columns.cell(row, Quantity.JOINT) for row in rows]
        words = [plain(cell.text).casefold() for cell in cells if cell]
        if not all(word in TYPES and not word.isdigit() for word in words):
            return [None] * len(rows)
    types: list[JointType | None] = []
    for number, cell in enumerate(cells, start=1):
        word = plain(cell.text).casefold() if cell else ""
        types.append(TYPES.get(word))
        if cell and word not in TYPES and word not in ("", "-"):
            findings.wrong(cell, f"row {number}, type", f"found {shown(cell.text)}. {_ALLOWED}")
    return types


def check_numbers(rows: Sequence[Cells], columns: Columns, findings: Findings) -> None:
    """Rows that are numbered stand in their order, and none is missing between them."""
    last: int | None = None
    for number, row in enumerate(rows, start=1):
        cell = columns.cell(row, Quantity.JOINT)
        text = plain(cell.text) if cell else ""
        if cell is None or not re.fullmatch(r"\d{1,6}", text):
            continue
        if last is not None and int(text) != last + 1:
            message = f"this row is numbered {text}, and the one before it {last}"
            findings.wrong(cell, f"row {number}", f"{message}; rows go from the base to the tool, each once")
            return
        last = int(text)


def joint_names(rows: Sequence[Cells], columns: Columns, findings: Findings) -> list[str]:
    """Return a name for every row: the table's where a robot file allows it, else ``joint_1`` and so on."""
    given = [columns.cell(row, Quantity.NAME) or _label(row, columns) for row in rows]
    names = [_name(cell) for cell in given]
    chosen = [name or default_name(index) for index, name in enumerate(names)]
    if len(set(chosen)) < len(chosen):
        findings.note("the names of the joints were left out, since two are the same")
        return [default_name(index) for index in range(len(rows))]
    for cell, name, used in zip(given, names, chosen, strict=True):
        if cell is not None and name is None and cell.text and not _ORDINAL.fullmatch(plain(cell.text)):
            findings.note(f"{shown(cell.text)} is no name for a joint in a robot file: it is called {used}")
    return chosen


def _label(row: Cells, columns: Columns) -> Cell | None:
    """The cell of a column for joints, where it holds a name rather than a number or a type."""
    cell = columns.cell(row, Quantity.JOINT)
    if cell is None or plain(cell.text).casefold() in (*TYPES, "", "-") or re.fullmatch(r"\W*\d.*", cell.text):
        return None
    return cell


def _name(cell: Cell | None) -> str | None:
    """The name that a cell holds, or None where a robot file does not allow it."""
    text = plain(cell.text).strip(" *") if cell else ""
    return text if text and name_problem(text) is None and not is_reserved(text) else None
