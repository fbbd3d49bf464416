"""The animation of a row: step by step through the row's product, in the order of its convention."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.kinematics.table_oracle import table_frame_poses
from dh2sim.robot.read import parse_robot
from dh2sim.view.events import AdvanceRow, EditCell, Event, OpenText, PlayRow, SeekRow, SelectRow, Show
from dh2sim.view.initial_state import open_state
from dh2sim.view.motion.row_animation import STEP_SECONDS, ZERO_SECONDS, RowAnimation, step_text
from dh2sim.view.scene.scene import scene_of
from dh2sim.view.state import Part, ViewState
from tests.view.states import STANFORD, after
from tests.view.test_solids import pose_in_scene

ORDERS = {
    "standard": ["Rz(θ₁* = 0.0°)", "Tz(d₁ = 0.2 m)", "Tx(a₁ = 0.3 m)", "Rx(α₁ = 40.107°)"],
    "modified": ["Tx(a₀ = 0.3 m)", "Rx(α₀ = 40.107°)", "Rz(θ₁* = 0.0°)", "Tz(d₁ = 0.2 m)"],
    "hayati": ["Rz(θ₁* = 0.0°)", "Tz(d₁ = 0)", "Tx(a₁ = 0.3 m)", "Rx(α₁ = 40.107°)", "Ry(β₁ = 5.72958°)"],
}


def one_row(convention: str) -> ViewState:
    numbers = "a: 0.3, alpha: 0.7, " + ("beta: 0.1" if convention == "hayati" else "d: 0.2")
    return open_state(parse_robot(f"name: x\nconvention: {convention}\njoints: [{{type: revolute, {numbers}}}]\n"))


@pytest.mark.parametrize("convention", list(ORDERS))
def test_the_steps_are_those_of_the_conventions_product(convention: str) -> None:
    state, expected = one_row(convention), ORDERS[convention]
    texts = [step_text(after(state, SeekRow(steps=k + 0.5))) for k in range(len(expected))]
    assert texts == [f"Step {k} of {len(expected)}: {text}" for k, text in enumerate(expected, start=1)]
    assert step_text(state) == ""


def test_it_plays_from_the_first_frame_to_the_second_and_ends_there() -> None:
    state = after(STANFORD, SelectRow(row=1), Show(part=Part.ANNOTATIONS, on=False), PlayRow(on=True))
    assert (state.row_progress, state.row_playing) == (0.0, True)
    assert Part.ANNOTATIONS in state.shown
    frames = table_frame_poses(STANFORD.spec, STANFORD.q)
    assert np.allclose(pose_in_scene(scene_of(state), "/row/moving_frame"), frames[1], rtol=0, atol=1e-12)
    # theta, d and alpha; a is zero
    halfway = after(state, AdvanceRow(seconds=1.5 * STEP_SECONDS))
    assert halfway.row_progress == pytest.approx(1.5)
    total = 3 * STEP_SECONDS + ZERO_SECONDS
    nearly = after(state, *[AdvanceRow(seconds=total / 100.0)] * 99)
    assert nearly.row_playing
    ended = after(nearly, AdvanceRow(seconds=total / 50.0))
    assert (ended.row_progress, ended.row_playing) == (4.0, False)
    assert np.allclose(pose_in_scene(scene_of(ended), "/row/moving_frame"), frames[2], rtol=0, atol=1e-12)
    assert after(ended, AdvanceRow(seconds=1.0)) == ended
    assert after(ended, PlayRow(on=True)).row_progress == 0.0


def test_it_is_paused_and_goes_on_and_a_slider_pauses_it() -> None:
    playing = after(STANFORD, PlayRow(on=True), AdvanceRow(seconds=0.5 * STEP_SECONDS))
    paused = after(playing, PlayRow(on=False))
    assert after(paused, AdvanceRow(seconds=1.0)) == paused
    assert after(paused, PlayRow(on=True)) == playing
    sought = after(playing, SeekRow(steps=3.25))
    assert (sought.row_progress, sought.row_playing) == (3.25, False)
    for wrong in (-0.1, 4.1, math.nan, math.inf):
        assert after(playing, SeekRow(steps=wrong)) == playing
    for wrong in (-1.0, 0.0, math.nan):
        assert after(playing, AdvanceRow(seconds=wrong)) == playing


@pytest.mark.parametrize(
    "event",
    [SelectRow(row=2), EditCell(row=1, column="a", text="oh"), EditCell(row=0, column="d", text="0.3")],
)
def test_another_row_or_another_table_is_not_animated(event: Event) -> None:
    state = after(STANFORD, PlayRow(on=True), AdvanceRow(seconds=0.1), event)
    assert (state.row_progress, state.row_playing) == (None, False)
    assert "/row/moving_frame" not in scene_of(state)


def test_another_file_is_not_animated_and_selecting_the_same_row_changes_nothing() -> None:
    playing = after(STANFORD, PlayRow(on=True), AdvanceRow(seconds=0.1))
    assert after(playing, SelectRow(row=0)) == playing
    text = "name: x\nconvention: hayati\njoints: [{type: revolute, a: 1}]\n"
    assert after(playing, OpenText(text=text, file="x.yaml")).row_progress is None


def test_the_clock_advances_it_and_stands_still_between_animations(monkeypatch: pytest.MonkeyPatch) -> None:
    state, now = [STANFORD], [100.0]
    monkeypatch.setattr("dh2sim.view.motion.row_animation.time.monotonic", lambda: now[0])

    def apply(event: Event) -> None:
        state[0] = after(state[0], event)

    animation = RowAnimation(lambda: state[0], apply)
    assert animation.tick_interval is None
    animation.tick()
    for start in (200.0, 300.0):
        apply(PlayRow(on=True))
        assert animation.tick_interval == pytest.approx(1.0 / 30.0)
        now[0] = start
        animation.tick()
        now[0] = start + 0.25 * STEP_SECONDS
        animation.tick()
        assert state[0].row_progress == pytest.approx(0.25)
        apply(SeekRow(steps=0.0))
        animation.tick()
