"""The table as it is printed: indices as in the textbooks, the joint's own variable in its column."""

from __future__ import annotations

from dh2sim.robot.spec import Convention
from dh2sim.robot.units import AngleUnit
from dh2sim.view.panel import markup
from dh2sim.view.state import Complaint, Draft, ViewState

_WRONG = "background:#fde2df;color:#b42318;border-radius:3px;padding:0 0.2em"
_CHOSEN = "font-weight:700"


def overview(state: ViewState) -> str:
    """Return the table as HTML; cells that are wrong are marked, and say why when pointed at."""
    draft = state.draft
    hayati = any(row.convention is Convention.HAYATI for row in draft.rows)
    angle = "°" if draft.units.angle is AngleUnit.DEG else "rad"
    length = draft.units.length.value
    head = ["i", "joint", f"a<br>{length}", f"α<br>{angle}", f"d<br>{length}", f"θ<br>{angle}"]
    head += [f"β<br>{angle}"] if hayati else []
    rows = [_row(state, i, hayati=hayati) for i in range(len(draft.rows))]
    return markup.table(rows, head=[*head, "convention"], name="table") + markup.note(_legend(draft))


def _row(state: ViewState, i: int, *, hayati: bool) -> list[str]:
    row = state.draft.rows[i]
    number = f"<span style='{_CHOSEN}'>{i + 1}</span>" if i == state.selected_row else str(i + 1)
    columns = ("a", "alpha", "d", "theta", *(("beta",) if hayati else ()))
    cells = [_cell(state, i, column, text) for column, text in zip(columns, row.cells, strict=False)]
    flips = [spec.flip for spec in state.spec.rows]
    variable = _variable(i, flip=flips[i])
    if row.type.moves:
        moved = 3 if row.type.turns else 2
        marked = state.draft.complaint(i, columns[moved]) is not None
        cells[moved] = f"{variable} + {cells[moved]}" if marked else variable + _offset(row.cells[moved])
    return [number, markup.text(row.name), *cells, row.convention.value]


def _cell(state: ViewState, row: int, column: str, text: str) -> str:
    found: Complaint | None = state.draft.complaint(row, column)
    if found is None:
        return markup.text(text)
    return f'<span title="{markup.text(found.message)}" style="{_WRONG}">{markup.text(text) or "?"}</span>'


def _variable(i: int, *, flip: bool) -> str:
    return f"{'−' if flip else ''}q<sub>{i + 1}</sub>"


def _offset(text: str) -> str:
    """Return what follows a joint's variable: nothing where the offset is zero."""
    number = text.strip().removeprefix("+").strip()
    if not number or _is_zero(number):
        return ""
    sign, rest = ("−", number[1:].strip()) if number.startswith("-") else ("+", number)
    return f" {sign} {markup.text(rest)}"


def _is_zero(text: str) -> bool:
    try:
        return float(text) == 0.0
    except ValueError:  # an expression
        return False


def _legend(draft: Draft) -> str:
    kinds = {row.convention for row in draft.rows}
    said = {
        Convention.STANDARD: "standard: Rz(θ) Tz(d) Tx(a) Rx(α)",
        Convention.MODIFIED: "modified: Tx(a) Rx(α) Rz(θ) Tz(d), a and α of index i − 1",
        Convention.HAYATI: "hayati: Rz(θ) Tx(a) Rx(α) Ry(β)",
    }
    return "<br>".join(words for kind, words in said.items() if kind in kinds)
