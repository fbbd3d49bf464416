"""The next state of a page after an event: a pure function, which never raises."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final, assert_never

import numpy as np

from dh2sim.kinematics.forward import forward_kinematics, frame_names
from dh2sim.kinematics.sampling import random_configurations
from dh2sim.kinematics.transforms import compose
from dh2sim.messages import shown as shown_word
from dh2sim.model.robot_model import RobotModel
from dh2sim.view import events
from dh2sim.view.events import EditCell, Event, OpenText, Undo
from dh2sim.view.initial_state import open_text
from dh2sim.view.motion.row_animation import advanced, played, step_count
from dh2sim.view.scene.items import Vector
from dh2sim.view.scene.solids import position_of
from dh2sim.view.state import IDENTITY, Goal, LinkDrag, Matrix, Mode, Part, ViewState, configurations, within
from dh2sim.view.table_edits import misread_ghost, replaced, table_changed

MAX_UNDO: Final = 100
"""Edits that can be undone."""
MAX_UNDO_LENGTH: Final = 4_000_000
"""Characters of all texts that are kept for that."""


def with_undo(before: ViewState, event: Event, after: ViewState) -> ViewState:
    """Return the state ``after`` an event, in which the edit can be undone.

    All typing into one cell is one edit. Opening a file is not an edit.
    """
    if isinstance(event, Undo | OpenText) or after.text == before.text:
        return after
    cell = (event.row, event.column) if isinstance(event, EditCell) else None
    if cell is not None and cell == before.edited_cell:
        return after
    return replace(after, undo_texts=_bounded((*before.undo_texts, before.text)), edited_cell=cell)


def undo(state: ViewState) -> ViewState:
    """Return the state with the robot file before the last edit, if there is one."""
    if not state.undo_texts:
        return replace(state, notice="Nothing to undo.")
    after = replaced(state, state.undo_texts[-1])
    return after if after.text == state.text else replace(after, undo_texts=state.undo_texts[:-1], edited_cell=None)


def _bounded(texts: tuple[str, ...]) -> tuple[str, ...]:
    """Return the last texts, as many as are kept."""
    kept = texts[-MAX_UNDO:]
    while len(kept) > 1 and sum(map(len, kept)) > MAX_UNDO_LENGTH:
        kept = kept[1:]
    return kept


MAX_TRACE_POINTS: Final = 2000
"""Older points are dropped."""
_NEAR: Final = 1e-3
"""Points nearer to the last one than this share of the reach are not added."""


def with_trace(before: ViewState, after: ViewState) -> ViewState:
    """Return the state ``after`` with the path of tool0 in the world extended, or empty while it is not shown.

    Another robot starts another trace, and so does a floating base that returns from a recording.
    """
    moved = after.T_world_base_link != before.T_world_base_link
    returned = moved and after.mode is not before.mode
    if after.planned and after.model is not before.model:
        after = replace(after, planned=())
    if Part.TRACE not in after.shown or after.model is not before.model or returned:
        return replace(after, trace=()) if after.trace else after
    if after.q == before.q and not moved and after.trace:
        return after
    points = after.trace or (_tool(before),)
    position = _tool(after)
    if math.dist(points[-1], position) <= _NEAR * (after.model.reach or 1.0):
        return after if after.trace else replace(after, trace=points)
    return replace(after, trace=(*points, position)[-MAX_TRACE_POINTS:])


def _tool(state: ViewState) -> Vector:
    T_base_tool = forward_kinematics(state.model.chain, state.q)
    if not state.floats:
        return position_of(T_base_tool)
    return position_of(compose(np.array(state.T_world_base_link), T_base_tool))


NUDGE_ANGLE = math.radians(3.0)
"""rad."""
NUDGE_SHARE = 0.01
"""Of a prismatic joint's travel."""


def reduce(state: ViewState, event: events.Event) -> ViewState:
    """Return the state after an event; an impossible one changes nothing but the notice and the errors of cells.

    Args:
        state: The state before.
        event: Its numbers may be anything; its rows and joints need not exist.
    """
    after = with_undo(state, event, _reduced(state, event))
    if after.model is not state.model:
        after = replace(after, workspace=None, workspace_note="", searching=None)
    jumps = isinstance(event, events.Follow) and event.jumps
    return with_trace(after, replace(after, trace=())) if jumps else with_trace(state, after)


def _reduced(state: ViewState, event: events.Event) -> ViewState:
    match event:
        case events.EditCell() | events.SetConvention() | events.ConvertTable() | events.SetUnits():
            return table_changed(state, event)
        case events.ReplaceText(text=text):
            return replaced(state, text)
        case events.Undo():
            return undo(state)
        case events.OpenText():
            return open_text(state, event)
        case events.Show(part=part, on=on):
            goal = None if part is Part.HANDLE else state.goal  # a new handle is at tool0
            return replace(state, shown=state.shown | {part} if on else state.shown - {part}, goal=goal)
        case events.SetOpacity(opacity=opacity):
            return replace(state, opacity=min(opacity, 1.0)) if opacity >= 0.0 else state
        case events.ShowAngles(unit=unit):
            return replace(state, angle=unit)
        case events.SelectRow(row=row):
            known = 0 <= row < len(state.table.rows) and row != state.selected_row
            return replace(state, selected_row=row, row_progress=None, row_playing=False) if known else state
        case events.PlayRow(on=on):
            return played(state, on=on)
        case events.SeekRow(steps=steps):
            inside = 0.0 <= steps <= step_count(state)
            return replace(state, row_progress=steps, row_playing=False) if inside else state
        case events.AdvanceRow(seconds=seconds):
            return advanced(state, seconds)
        case events.ChooseFrame(name=name):
            return replace(state, frame=name) if name in frame_names(state.model.chain) else state
        case events.ChooseReference(name=name):
            return replace(state, reference=name) if name in frame_names(state.model.chain) else state
        case events.Compare(ghost=ghost):
            return replace(state, ghost=ghost)
        case events.CompareMisread():
            return replace(state, ghost=misread_ghost(state.model))
        case events.SetCamera(pinhole=pinhole):
            return replace(state, pinhole=pinhole) if pinhole.is_usable else state
        case events.Notify(notice=notice):
            return replace(state, notice=notice)
        case events.SearchWorkspace(model=model, doing=doing, share=share):
            return replace(state, searching=(doing, share)) if model is state.model else state
        case events.FoundWorkspace(model=model, workspace=found, note=note):
            known = model is state.model
            return replace(state, workspace=found, workspace_note=note, searching=None) if known else state
        case events.SetMode(mode=mode):
            # a simulation may have left the limits slightly
            q = within(state.model, state.q)
            target = q if mode is Mode.PHYSICS else None
            started = replace(state, mode=mode, q=q, target=target, goal=None, paused=False, steps=0, drag=None)
            return replace(started, T_world_base_link=IDENTITY)
        case events.Pause(on=on):
            return state if state.mode is Mode.MANUAL else replace(state, paused=on)
        case events.Step():
            return state if state.mode is Mode.MANUAL else replace(state, paused=True, steps=state.steps + 1)
        case events.DragLink(drag=drag):
            return replace(state, drag=drag) if _can_be_dragged(state, drag) else state
        case events.ReleaseLink():
            return replace(state, drag=None)
        case _:
            return _moved(state, event)


_Motion = (
    events.MoveJoint
    | events.SetJoints
    | events.Nudge
    | events.SetConfiguration
    | events.RandomConfiguration
    | events.Follow
    | events.MoveTool
)


def _moved(state: ViewState, event: _Motion) -> ViewState:
    model, q = state.model, state.commanded
    match event:
        case events.MoveJoint(joint=joint, value=value):
            return _at(state, _exchanged(q, joint, value))
        case events.SetJoints(q=given):
            return _at(state, given)
        case events.Nudge(joint=joint, direction=direction):
            return _at(state, _nudged(state, joint, direction))
        case events.SetConfiguration(name=name):
            named = configurations(model)
            if name in named:
                return _at(state, named[name])
            return replace(state, notice=f"Unknown configuration {shown_word(name)}.")
        case events.RandomConfiguration(seed=seed):
            (drawn,) = random_configurations(*model.travel, 1, abs(seed)).tolist()
            return _at(state, tuple(drawn))
        case events.Follow(q=shown, T_world_base_link=base):
            usable = state.mode is not Mode.MANUAL and _fits(model, shown)
            return replace(state, q=tuple(shown), T_world_base_link=_base(state, base)) if usable else state
        case events.MoveTool(T_base_link_tool0=T, q=found, reached=reached):
            if state.mode is not Mode.MANUAL:
                return state
            moved = state if found is None else _at(state, found, keep_goal=True)
            return replace(moved, goal=Goal(T_base_link_tool0=T, reached=reached))
        case _:
            assert_never(event)


def _at(state: ViewState, q: tuple[float, ...], *, keep_goal: bool = False) -> ViewState:
    """Return the state with the joints at ``q``, which is the target of a simulation; a recording is not changed."""
    if state.mode is Mode.REPLAY or not _fits(state.model, q):
        return state
    if state.mode is Mode.PHYSICS:
        return replace(state, target=within(state.model, q))
    return replace(state, q=within(state.model, q), goal=state.goal if keep_goal else None, notice="")


def _can_be_dragged(state: ViewState, drag: LinkDrag) -> bool:
    """Return whether a robot with that link is simulated, and all numbers are finite."""
    links = {link.name for link in state.model.moving_links}
    finite = all(math.isfinite(value) for value in (*drag.point_in_link, *drag.target))
    return state.mode is Mode.PHYSICS and drag.link in links and finite


def _fits(model: RobotModel, q: tuple[float, ...]) -> bool:
    return len(q) == model.chain.n and all(math.isfinite(value) for value in q)


def _base(state: ViewState, T: Matrix | None) -> Matrix:
    """Return the pose of base_link, which only a recording can move."""
    if T is None or state.mode is not Mode.REPLAY:
        return IDENTITY
    return T if all(math.isfinite(value) for row in T for value in row) else state.T_world_base_link


def _exchanged(q: tuple[float, ...], joint: int, value: float) -> tuple[float, ...]:
    return tuple(value if i == joint else old for i, old in enumerate(q))


def _nudged(state: ViewState, joint: int, direction: int) -> tuple[float, ...]:
    if not 0 <= joint < len(state.q):
        return state.commanded
    moving = state.model.moving_joints[joint]
    lower, upper = moving.travel
    step = NUDGE_ANGLE if moving.type.turns else NUDGE_SHARE * (upper - lower)
    return _exchanged(state.commanded, joint, state.commanded[joint] + math.copysign(step, direction))
