"""What comes of a page when something happens: a pure function, which never raises.

Edits of the table can be taken back, one after the other.

Where tool0 has been.
"""

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
from dh2sim.view.scene.items import Vector
from dh2sim.view.scene.solids import position_of
from dh2sim.view.state import IDENTITY, Goal, Matrix, Mode, Part, Pull, ViewState, configurations, within
from dh2sim.view.table_edits import reading_of, replaced, table_changed
from dh2sim.view.uploads import opened

MOST: Final = 100
"""Edits that can be taken back."""
MOST_LETTERS: Final = 4_000_000
"""Of all the robot files that are kept for that."""


def remembered(before: ViewState, event: Event, after: ViewState) -> ViewState:
    """Return the state ``after`` an event, from which one can return to the robot file of ``before``.

    What is typed into one cell, letter by letter, is one edit. Another file begins anew.
    """
    if isinstance(event, Undo | OpenText) or after.text == before.text:
        return after
    cell = (event.row, event.column) if isinstance(event, EditCell) else None
    if cell is not None and cell == before.typed:
        return after
    return replace(after, earlier=_bounded((*before.earlier, before.text)), typed=cell)


def undone(state: ViewState) -> ViewState:
    """Return the state with the robot file of before the last edit, if there is one."""
    if not state.earlier:
        return replace(state, notice="There is no edit to take back.")
    after = replaced(state, state.earlier[-1])
    return after if after.text == state.text else replace(after, earlier=state.earlier[:-1], typed=None)


def _bounded(texts: tuple[str, ...]) -> tuple[str, ...]:
    """Return the last of the texts, as many as are kept."""
    kept = texts[-MOST:]
    while len(kept) > 1 and sum(map(len, kept)) > MOST_LETTERS:
        kept = kept[1:]
    return kept


LONGEST: Final = 2000
"""Points: older ones are forgotten."""
_NEAR: Final = 1e-3
"""Points nearer to the last one than this share of the reach are left out."""


def traced(before: ViewState, after: ViewState) -> ViewState:
    """Return the state ``after`` with the way of tool0, in the world, since ``before``; none where it is not shown.

    Another robot begins another trace, and so does a base that goes where it was before a recording.
    """
    moved = after.T_world_base_link != before.T_world_base_link
    brought_back = moved and after.mode is not before.mode
    if Part.TRACE not in after.shown or after.model is not before.model or brought_back:
        return replace(after, trace=()) if after.trace else after
    if after.q == before.q and not moved and after.trace:
        return after
    points = after.trace or (_tool(before),)
    place = _tool(after)
    if math.dist(points[-1], place) <= _NEAR * (after.model.reach or 1.0):
        return after if after.trace else replace(after, trace=points)
    return replace(after, trace=(*points, place)[-LONGEST:])


def _tool(state: ViewState) -> Vector:
    T_base_tool = forward_kinematics(state.model.chain, state.q)
    if not state.floats:
        return position_of(T_base_tool)
    return position_of(compose(np.array(state.T_world_base_link), T_base_tool))


TURN_STEP = math.radians(3.0)
"""rad: of a nudge."""
SLIDE_STEP = 0.01
"""Of a nudge, as a share of the travel."""


def reduce(state: ViewState, event: events.Event) -> ViewState:
    """Return the state after an event; what is impossible changes nothing but the notice and the marks of cells.

    Args:
        state: What the page shows.
        event: What happens. Numbers may be anything, rows and joints may not exist.
    """
    after = remembered(state, event, _reduced(state, event))
    leaps = isinstance(event, events.Follow) and event.leaps
    return traced(after, replace(after, trace=())) if leaps else traced(state, after)


def _reduced(state: ViewState, event: events.Event) -> ViewState:
    match event:
        case events.EditCell() | events.SetConvention() | events.ConvertTable() | events.SetUnits():
            return table_changed(state, event)
        case events.ReplaceText(text=text):
            return replaced(state, text)
        case events.Undo():
            return undone(state)
        case events.OpenText():
            return opened(state, event)
        case events.Show(part=part, on=on):
            goal = None if part is Part.HANDLE else state.goal  # a handle appears at tool0
            return replace(state, shown=state.shown | {part} if on else state.shown - {part}, goal=goal)
        case events.ShowAngles(unit=unit):
            return replace(state, angle=unit)
        case events.SelectRow(row=row):
            return replace(state, selected_row=row) if 0 <= row < len(state.draft.rows) else state
        case events.ChooseFrame(name=name):
            return replace(state, frame=name) if name in frame_names(state.model.chain) else state
        case events.Compare(ghost=ghost):
            return replace(state, ghost=ghost)
        case events.CompareReading():
            return replace(state, ghost=reading_of(state.model))
        case events.Look(sight=sight):
            return replace(state, sight=sight) if sight.is_usable else state
        case events.Tell(notice=notice):
            return replace(state, notice=notice)
        case events.SetMode(mode=mode):
            # a simulation may have left the limits by a hair
            q = within(state.model, state.q)
            target = q if mode is Mode.PHYSICS else None
            begun = replace(state, mode=mode, q=q, target=target, goal=None, paused=False, steps=0, pull=None)
            return replace(begun, T_world_base_link=IDENTITY)
        case events.Pause(on=on):
            return state if state.mode is Mode.STILL else replace(state, paused=on)
        case events.Step():
            return state if state.mode is Mode.STILL else replace(state, paused=True, steps=state.steps + 1)
        case events.PullLink(pull=pull):
            return replace(state, pull=pull) if _can_be_pulled(state, pull) else state
        case events.LetGo():
            return replace(state, pull=None)
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
    model, q = state.model, state.wanted
    match event:
        case events.MoveJoint(joint=joint, value=value):
            return _at(state, _exchanged(q, joint, value))
        case events.SetJoints(q=wanted):
            return _at(state, wanted)
        case events.Nudge(joint=joint, direction=direction):
            return _at(state, _nudged(state, joint, direction))
        case events.SetConfiguration(name=name):
            named = configurations(model)
            if name in named:
                return _at(state, named[name])
            return replace(state, notice=f"There is no configuration {shown_word(name)}.")
        case events.RandomConfiguration(seed=seed):
            (drawn,) = random_configurations(*model.travel, 1, abs(seed)).tolist()
            return _at(state, tuple(drawn))
        case events.Follow(q=seen, T_world_base_link=base):
            usable = state.mode is not Mode.STILL and _fits(model, seen)
            return replace(state, q=tuple(seen), T_world_base_link=_base(state, base)) if usable else state
        case events.MoveTool(T_base_link_tool0=T, q=found, reached=reached):
            if state.mode is not Mode.STILL:
                return state
            moved = state if found is None else _at(state, found, keep_goal=True)
            return replace(moved, goal=Goal(T_base_link_tool0=T, reached=reached))
        case _:
            assert_never(event)


def _at(state: ViewState, q: tuple[float, ...], *, keep_goal: bool = False) -> ViewState:
    """Return the state with the joints somewhere; a simulation is told to bring them there, a recording is not."""
    if state.mode is Mode.REPLAY or not _fits(state.model, q):
        return state
    if state.mode is Mode.PHYSICS:
        return replace(state, target=within(state.model, q))
    return replace(state, q=within(state.model, q), goal=state.goal if keep_goal else None, notice="")


def _can_be_pulled(state: ViewState, pull: Pull) -> bool:
    """Whether a robot is simulated that has the link, and all numbers are finite."""
    links = {link.name for link in state.model.links}
    finite = all(math.isfinite(value) for value in (*pull.point_in_link, *pull.target))
    return state.mode is Mode.PHYSICS and pull.link in links and finite


def _fits(model: RobotModel, q: tuple[float, ...]) -> bool:
    return len(q) == model.chain.n and all(math.isfinite(value) for value in q)


def _base(state: ViewState, T: Matrix | None) -> Matrix:
    """Return where base_link is, given where a recording has it; nobody else can move it."""
    if T is None or state.mode is not Mode.REPLAY:
        return IDENTITY
    return T if all(math.isfinite(value) for row in T for value in row) else state.T_world_base_link


def _exchanged(q: tuple[float, ...], joint: int, value: float) -> tuple[float, ...]:
    return tuple(value if i == joint else old for i, old in enumerate(q))


def _nudged(state: ViewState, joint: int, direction: int) -> tuple[float, ...]:
    if not 0 <= joint < len(state.q):
        return state.wanted
    moving = state.model.moving_joints[joint]
    lower, upper = moving.travel
    step = TURN_STEP if moving.joint.type.turns else SLIDE_STEP * (upper - lower)
    return _exchanged(state.wanted, joint, state.wanted[joint] + math.copysign(step, direction))
