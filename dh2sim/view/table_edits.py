"""Edits of the table: they give the robot of the new table, or leave the robot and mark the cells with errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeAlias

from dh2sim.errors import Dh2simError
from dh2sim.kinematics.forward import frame_names
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.edit import PARAMETERS, Cell, own_conventions
from dh2sim.robot.row import Convention, JointType
from dh2sim.robot.write import robot_file_text
from dh2sim.view.events import ConvertTable, EditCell, SetConvention, SetUnits
from dh2sim.view.scene.ghost import misread
from dh2sim.view.state import COLUMNS, CONVENTION, CellError, Ghost, Mode, ViewState, configurations, within
from dh2sim.view.table_state import (
    MAX_CELL_LENGTH,
    Invalid,
    Source,
    cell_errors,
    read,
    table_state_of,
    too_long,
    try_cells,
)

TableEvent: TypeAlias = EditCell | SetConvention | ConvertTable | SetUnits

UNCHANGED = "Robot unchanged"


def table_changed(state: ViewState, event: TableEvent) -> ViewState:
    """Return the state after an edit of the table."""
    if state.mode is not Mode.MANUAL:
        return replace(state, notice="The table can be edited in manual mode only.")
    match event:
        case EditCell(row=row, column=column, text=text):
            if not isinstance(row, int):
                known = row == PARAMETERS and column in state.table.parameters
                return _edited(state, {(row, column): text}) if known else state
            known = 0 <= row < len(state.table.rows) and column in (*COLUMNS, CONVENTION)
            if not known:
                return state
            same = row == state.selected_row
            chosen = state if same else replace(state, selected_row=row, row_progress=None, row_playing=False)
            return _edited(chosen, {(row, column): text})
        case SetConvention(row=row, convention=convention):
            known = row is None or 0 <= row < len(state.table.rows)
            return _edited(state, _in_convention(state, row, convention)) if known else state
        case ConvertTable(convention=convention):
            return _converted(state, convention)
        case SetUnits():
            return _in_units(state, event)


def replaced(state: ViewState, text: str) -> ViewState:
    """Return the state with the robot of another text, if that is valid."""
    if state.mode is not Mode.MANUAL:
        return replace(state, notice="The table can be edited in manual mode only.")
    model = read(text, source_of(state))
    if isinstance(model, Invalid):
        return replace(state, notice=f"{UNCHANGED}: {model.first}")
    return _with_robot(state, text, model)


def misread_ghost(model: RobotModel) -> Ghost | None:
    """Return the robot of the same table in the other convention; None if that cannot be built."""
    try:
        return Ghost(model=build_model(misread(model.spec)), label="the same table, misread", misread=True)
    except Dh2simError:
        return None


def source_of(state: ViewState) -> Source:
    """Return where a state's text comes from."""
    return Source(file=state.file, folder=state.folder)


def _edited(state: ViewState, cells: Mapping[Cell, str | None]) -> ViewState:
    """Return the state with other cells if they describe a robot, or else with the cells marked.

    Cells that had errors before are tried again: two that are wrong alone may be right together.
    """
    source = source_of(state)
    typed = {cell: text for cell, text in cells.items() if text is not None}
    if long := too_long(typed):
        return _marked(state, {cell: f"{text[:MAX_CELL_LENGTH]}…" for cell, text in typed.items()}, long)
    pending: dict[Cell, str | None] = {(old.row, old.column): old.text for old in state.table.errors}
    everything = try_cells(state.text, {**pending, **cells}, source)
    if not isinstance(everything, Invalid):
        return _with_robot(state, *everything)
    others = {cell: text for cell, text in pending.items() if cell not in cells and text is not None}
    alone = try_cells(state.text, cells, source) if others else everything
    if isinstance(alone, Invalid):
        return _marked(state, typed, alone)
    return _with_robot(state, *alone, errors=cell_errors(others, everything))


def _in_convention(state: ViewState, row: int | None, convention: Convention) -> dict[Cell, str | None]:
    """Return the cells that give a row, or all, a convention; zeros without a column in it are removed."""
    named: list[int | None] = [None, *own_conventions(state.text)] if row is None else [row]
    cells: dict[Cell, str | None] = {(one, CONVENTION): convention.value for one in named}
    for i, spec in enumerate(state.spec.rows):
        if row not in (None, i):
            continue
        if convention is not Convention.HAYATI and spec.beta == 0.0:
            cells[i, "beta"] = None
        if convention is Convention.HAYATI and spec.d == 0.0 and spec.type is not JointType.PRISMATIC:
            cells[i, "d"] = None
    return cells


def _marked(state: ViewState, cells: Mapping[Cell, str], invalid: Invalid) -> ViewState:
    """Return the state with errors in cells; the robot stays."""
    kept = tuple(old for old in state.table.errors if (old.row, old.column) not in cells)
    errors = (*kept, *cell_errors(cells, invalid))
    table = table_state_of(state.text, state.spec, errors)
    return replace(state, table=table, notice=f"{UNCHANGED}: {invalid.first}")


def _with_robot(
    state: ViewState, text: str, model: RobotModel, *, errors: tuple[CellError, ...] = (), notice: str = ""
) -> ViewState:
    """Return the state with another robot; the joints do not move unless new limits require it."""
    same_joints = [joint.type for joint in model.joints] == [joint.type for joint in state.model.joints]
    rows = len(model.joints)
    return replace(
        state,
        model=model,
        text=text,
        table=table_state_of(text, model.spec, errors),
        q=within(model, state.q) if same_joints else configurations(model)["home"],
        frame=state.frame if state.frame in frame_names(model.chain) else "tool0",
        reference=state.reference if state.reference in frame_names(model.chain) else "base_link",
        selected_row=min(state.selected_row, rows - 1),
        row_progress=None,
        row_playing=False,
        ghost=misread_ghost(model) if state.ghost is not None and state.ghost.misread else state.ghost,
        goal=None,
        notice=notice,
    )


def _converted(state: ViewState, convention: Convention) -> ViewState:
    from dh2sim.importing.convert import convert_robot

    if convention is Convention.HAYATI:
        return replace(state, notice="A table can be converted to standard or modified, not to Hayati.")
    try:
        converted = convert_robot(state.spec, convention, folder=state.folder)
    except Dh2simError as error:
        return replace(state, notice=f"{UNCHANGED}: {error}")
    return _rewritten(state, converted.text, notes=[f"Converted: {converted.summary}.", *converted.notes])


def _in_units(state: ViewState, event: SetUnits) -> ViewState:
    try:
        text = robot_file_text(state.spec, folder=state.folder, angle=event.angle, length=event.length)
    except Dh2simError as error:
        return replace(state, notice=f"{UNCHANGED}: {error}")
    lost = ["Parameters were replaced by their values."] if state.spec.parameters else []
    return _rewritten(state, text, notes=lost)


def _rewritten(state: ViewState, text: str, *, notes: list[str]) -> ViewState:
    """Return the state with the same robot in a newly written text, without parameters and comments."""
    model = read(text, source_of(state))
    if isinstance(model, Invalid):
        return replace(state, notice=f"{UNCHANGED}: {model.first}")
    return _with_robot(state, text, model, notice=" ".join(notes))
