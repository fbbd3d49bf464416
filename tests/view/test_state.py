"""A page's state: whatever a user does, it stays one that can be shown."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.robot.edit import PARAMETERS
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.row import Convention, JointType
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.robot.write import robot_file_text
from dh2sim.view import events
from dh2sim.view.initial_state import open_state
from dh2sim.view.state import COLUMNS, CellError, LinkDrag, Mode, Part, ViewState
from tests.strategies import robot_specs
from tests.view.states import STANFORD, after

ONE_JOINT = "name: one\nconvention: standard\njoints: [{type: continuous, a: 1}]\n"

typed = st.sampled_from(
    [
        "0",
        "0.1",
        "-90",
        "pi/2",
        "d1 + 0.1",
        "d1/",
        "nan",
        "1e999",
        "",
        " ",
        "1e9",
        "0}, {x",
        "a: b",
        "'",
        "#",
        "\n",
        "&a",
    ]
) | st.text(max_size=12)
rows = st.integers(-2, 8)
numbers = st.floats() | st.floats(-4.0, 4.0)
matrices = st.just(tuple(tuple(row) for row in np.eye(4).tolist()))
anything: st.SearchStrategy[events.Event] = st.one_of(
    st.builds(events.MoveJoint, joint=rows, value=numbers),
    st.builds(events.SetJoints, q=st.lists(numbers, max_size=8).map(tuple)),
    st.builds(events.Nudge, joint=rows, direction=st.sampled_from([-1, 1])),
    st.builds(events.SetConfiguration, name=st.sampled_from(["home", "zero", "printed", "", "hom"])),
    st.builds(events.RandomConfiguration, seed=st.integers()),
    st.builds(events.Follow, q=st.lists(numbers, min_size=6, max_size=6).map(tuple)),
    st.builds(events.SetMode, mode=st.sampled_from(Mode)),
    st.builds(events.Pause, on=st.booleans()),
    st.builds(events.Step),
    st.builds(
        events.DragLink,
        drag=st.builds(
            LinkDrag,
            link=st.sampled_from(["base_link", "link_1", "link_6", ""]),
            point_in_link=st.tuples(numbers, numbers, numbers),
            target=st.tuples(numbers, numbers, numbers),
        ),
    ),
    st.builds(events.ReleaseLink),
    st.builds(events.EditCell, row=rows, column=st.sampled_from([*COLUMNS, "convention", "link"]), text=typed),
    st.builds(events.EditCell, row=st.just(PARAMETERS), column=st.sampled_from(["d1", "d6", "x"]), text=typed),
    st.builds(events.SetConvention, row=st.none() | rows, convention=st.sampled_from(Convention)),
    st.builds(events.ConvertTable, convention=st.sampled_from(Convention)),
    st.builds(events.SetUnits, angle=st.sampled_from(AngleUnit), length=st.sampled_from(LengthUnit)),
    st.builds(events.ReplaceText, text=st.sampled_from([STANFORD.text, "", "name: x"])),
    st.builds(events.OpenText, text=st.sampled_from([ONE_JOINT, ONE_JOINT.encode(), "", b"\xff"]), file=st.just("x")),
    st.builds(events.SelectRow, row=rows),
    st.builds(events.PlayRow, on=st.booleans()),
    st.builds(events.SeekRow, steps=numbers),
    st.builds(events.AdvanceRow, seconds=numbers),
    st.builds(events.Show, part=st.sampled_from(Part), on=st.booleans()),
    st.builds(events.ShowAngles, unit=st.sampled_from(AngleUnit)),
    st.builds(events.ChooseReference, name=st.sampled_from(["dh_3", "base_link", "dh_99"])),
    st.builds(events.SetOpacity, opacity=numbers),
    st.builds(events.ChooseFrame, name=st.sampled_from(["tool0", "dh_3", "link_1", "dh_99", ""])),
    st.builds(events.MoveTool, T_base_link_tool0=matrices, q=st.none() | st.just((0.1,) * 6), reached=st.booleans()),
    st.builds(events.Undo),
    st.builds(events.Compare, ghost=st.none()),
    st.builds(events.CompareMisread),
    st.builds(events.Notify, notice=st.text(max_size=5)),
)


def assert_sound(state: ViewState) -> None:
    """What must hold of a page's state at all times."""
    assert len(state.q) == state.model.chain.n
    assert all(math.isfinite(value) for value in state.q)
    if state.mode is Mode.MANUAL:
        for joint, value in zip(state.model.moving_joints, state.q, strict=True):
            lower, upper = joint.travel
            assert lower <= value <= upper
    described = parse_robot(state.text)
    assert np.array_equal(table_tool_pose(described, state.q), table_tool_pose(state.spec, state.q))
    assert len(state.table.rows) == len(state.spec.rows)
    assert 0 <= state.selected_row < len(state.spec.rows)
    wrong = {(found.row, found.column) for found in state.table.errors}
    assert len(wrong) == len(state.table.errors)


@settings(max_examples=min(60, settings().max_examples))
@given(st.lists(anything, max_size=25))
def test_no_sequence_of_events_leads_to_a_state_that_cannot_be_shown(happened: list[events.Event]) -> None:
    assert_sound(after(STANFORD, *happened))


@settings(max_examples=min(40, settings().max_examples))
@given(robot_specs(max_rows=5), st.lists(anything, max_size=6))
def test_a_page_takes_any_robot(spec: RobotSpec, happened: list[events.Event]) -> None:
    assert_sound(after(open_state(spec), *happened))


def test_a_page_starts_at_home() -> None:
    assert STANFORD.q == tuple(load_robot("stanford").configurations["home"].tolist())


@pytest.mark.parametrize(("robot", "row"), [("stanford", 0), ("puma560", 3), ("planar_2r", 0)])
def test_the_row_that_is_explained_at_first_has_the_fewest_zeros(robot: str, row: int) -> None:
    assert open_state(load_robot(robot)).selected_row == row


def test_the_robot_file_is_shown_as_it_was_written() -> None:
    assert STANFORD.text == load_robot("stanford").source_file.text  # type: ignore[union-attr]
    assert STANFORD.table.rows[0].cells == ("0", "-90", "d1", "0", "0")


def test_a_joint_stops_at_its_limit() -> None:
    assert after(STANFORD, events.MoveJoint(joint=0, value=9.0)).q[0] == math.radians(170)
    assert after(STANFORD, events.MoveJoint(joint=2, value=-1.0)).q[2] == 0.0


def test_a_nudge_turns_three_degrees_and_slides_a_hundredth_of_the_travel() -> None:
    nudged = after(STANFORD, events.Nudge(joint=0, direction=1), events.Nudge(joint=2, direction=-1))
    assert nudged.q[0] == pytest.approx(STANFORD.q[0] + math.radians(3.0), abs=1e-15)
    assert nudged.q[2] == pytest.approx(STANFORD.q[2] - 0.0127, abs=1e-15)


def test_the_same_seed_gives_the_same_random_configuration() -> None:
    first, again, other = (after(STANFORD, events.RandomConfiguration(seed=seed)).q for seed in (1, 1, 2))
    assert first == again != other


def test_an_expression_in_a_cell_is_evaluated_with_the_parameters_of_the_file() -> None:
    edited = after(STANFORD, events.EditCell(row=1, column="d", text="d2 + d1/2"))
    assert edited.spec.rows[1].d == 0.15 + 0.4 / 2
    assert edited.table.rows[1].cells[2] == "d2 + d1/2"
    assert edited.notice == ""


def test_a_parameter_is_edited_and_every_cell_that_names_it_follows() -> None:
    state = after(STANFORD, events.EditCell(row=1, column="d", text="d2 + d1"))
    edited = after(state, events.EditCell(row=PARAMETERS, column="d1", text="0.3 / 2"))
    assert [row.d for row in edited.spec.rows[:2]] == [0.15, 0.15 + 0.15]
    assert edited.table.parameters == {"d1": "0.3 / 2", "d2": "0.15", "d6": "0.3"}
    assert edited.text == state.text.replace("d1: 0.4", 'd1: "0.3 / 2"')
    assert edited.selected_row == state.selected_row
    assert after(edited, events.Undo()).text == state.text


def test_a_wrong_parameter_keeps_the_robot_and_is_marked_until_it_is_right() -> None:
    wrong = after(STANFORD, events.EditCell(row=PARAMETERS, column="d1", text="d1 + 1"))
    assert wrong.model is STANFORD.model
    message = "parameters need each other in a circle: d1 -> d1"
    assert wrong.table.errors == (CellError(row=PARAMETERS, column="d1", text="d1 + 1", message=message),)
    assert wrong.notice == f"Robot unchanged: parameters.d1: {message}"
    assert wrong.table.parameters["d1"] == "d1 + 1"
    mended = after(wrong, events.EditCell(row=PARAMETERS, column="d1", text="1"))
    assert mended.table.errors == ()
    assert mended.spec.rows[0].d == 1.0


def test_a_parameter_that_the_file_does_not_have_changes_nothing() -> None:
    assert after(STANFORD, events.EditCell(row=PARAMETERS, column="d9", text="1")) == STANFORD
    without = open_state(parse_robot(ONE_JOINT))
    assert without.table.parameters == {}
    assert after(without, events.EditCell(row=PARAMETERS, column="d1", text="1")) == without
    assert after(STANFORD, events.EditCell(row="joints", column="d1", text="1")) == STANFORD


def test_typing_into_a_cell_selects_its_row_right_or_wrong() -> None:
    for text in ("0.2", "0.2 +"):
        assert after(STANFORD, events.EditCell(row=4, column="a", text=text)).selected_row == 4


def test_an_edit_leaves_the_rest_of_the_file_as_it_was() -> None:
    edited = after(STANFORD, events.EditCell(row=1, column="d", text="0.2"))
    assert edited.text == STANFORD.text.replace("alpha: 90, d: d2", "alpha: 90, d: 0.2")


def test_a_cell_that_the_file_leaves_out_is_put_into_its_row() -> None:
    edited = after(STANFORD, events.EditCell(row=2, column="a", text="0.05"))
    assert "{a: 0.05, type: prismatic, limits" in edited.text
    assert edited.spec.rows[2].a == 0.05


def test_a_block_row_can_be_edited_too() -> None:
    head = "name: x\nconvention: standard\njoints:\n"
    text = f"{head}  - type: revolute # turns\n    d: 0.3 # m\n  - type: revolute\n    a: 1\n"
    edited = after(
        open_state(parse_robot(text)),
        events.EditCell(row=0, column="d", text="0.5"),
        events.EditCell(row=1, column="alpha", text="pi/2"),
        events.EditCell(row=0, column="a", text="-1"),
    )
    assert edited.text == (
        f"{head}  - a: -1\n    type: revolute # turns\n    d: 0.5 # m\n"
        "  - alpha: pi/2\n    type: revolute\n    a: 1\n"
    )


def test_a_wrong_cell_keeps_the_robot_and_says_why_in_the_words_of_the_reader() -> None:
    wrong = after(STANFORD, events.EditCell(row=0, column="alpha", text="-90+"))
    assert wrong.model is STANFORD.model
    assert wrong.text == STANFORD.text
    assert wrong.table.rows[0].cells[1] == "-90+"
    message = "in '-90+': it ends too early"
    assert wrong.table.errors == (CellError(row=0, column="alpha", text="-90+", message=message),)
    assert wrong.notice == f"Robot unchanged: joints[0].alpha: {message}"


def test_a_right_cell_is_taken_while_another_one_is_wrong() -> None:
    state = after(
        STANFORD,
        events.EditCell(row=0, column="alpha", text="x"),
        events.EditCell(row=1, column="d", text="0.2"),
    )
    assert state.spec.rows[1].d == 0.2
    (found,) = state.table.errors
    assert found.message == "unknown name 'x'. Known names: pi, d1, d2, d6"
    mended = after(state, events.EditCell(row=0, column="alpha", text="-45"))
    assert mended.table.errors == ()
    assert mended.spec.rows[0].alpha == math.radians(-45)


def test_what_is_typed_cannot_become_anything_but_the_value_of_its_cell() -> None:
    for text in ("0, link: {mesh: {file: x.stl}}", "0}\n  - {type: fixed", "&a 0", "!!python/object:x", "# gone"):
        state = after(STANFORD, events.EditCell(row=0, column="a", text=text))
        assert state.model is STANFORD.model
        assert state.table.error(0, "a") is not None


def test_a_very_long_cell_is_refused_and_cut_short() -> None:
    state = after(STANFORD, events.EditCell(row=0, column="a", text="1" * 100_000))
    assert state.table.errors[0].message == "100000 characters; at most 200 are allowed"
    assert len(state.table.rows[0].cells[0]) == 201


def test_an_edit_that_makes_a_robot_too_large_to_be_drawn_is_refused() -> None:
    state = after(
        STANFORD, events.EditCell(row=0, column="a", text="8e5"), events.EditCell(row=1, column="a", text="8e5")
    )
    message = "joints[1]: the lengths up to here add up to 1.6e+06 m; those of a robot may be 1e6 m together"
    assert state.table.errors[0].message == message


def test_reading_a_row_in_another_convention_makes_another_robot_of_the_same_numbers() -> None:
    read = after(STANFORD, events.SetConvention(row=0, convention=Convention.MODIFIED))
    assert read.spec.rows[0].convention is Convention.MODIFIED
    assert [row.cells for row in read.table.rows] == [row.cells for row in STANFORD.table.rows]
    q = STANFORD.q
    assert not np.allclose(table_tool_pose(read.spec, q), table_tool_pose(STANFORD.spec, q))


def test_reading_all_rows_in_a_convention_overrules_rows_that_name_their_own() -> None:
    mixed = after(STANFORD, events.SetConvention(row=3, convention=Convention.HAYATI))
    read = after(mixed, events.SetConvention(row=None, convention=Convention.MODIFIED))
    assert {row.convention for row in read.spec.rows} == {Convention.MODIFIED}


def test_a_row_becomes_hayati_and_back_despite_a_zero_in_a_column_that_it_then_lacks() -> None:
    text = robot_file_text(STANFORD.spec, angle=AngleUnit.DEG)  # every column is written
    state = open_state(parse_robot(text))
    hayati = after(state, events.SetConvention(row=4, convention=Convention.HAYATI))
    assert hayati.spec.rows[4].convention is Convention.HAYATI, hayati.notice
    bent = after(hayati, events.EditCell(row=4, column="beta", text="1"))
    assert bent.spec.rows[4].beta == math.radians(1)
    kept = after(bent, events.SetConvention(row=4, convention=Convention.STANDARD))
    assert kept.spec.rows[4].convention is Convention.HAYATI
    assert "a standard row takes no 'beta'" in kept.notice
    back = after(
        bent,
        events.EditCell(row=4, column="beta", text="0"),
        events.SetConvention(row=4, convention=Convention.STANDARD),
    )
    assert back.spec.rows[4].convention is Convention.STANDARD, back.notice
    assert back.table.rows[4].cells == state.table.rows[4].cells


def test_converting_the_table_keeps_the_robot() -> None:
    converted = after(STANFORD, events.ConvertTable(convention=Convention.MODIFIED))
    assert {row.convention for row in converted.spec.rows} == {Convention.MODIFIED}
    q = (0.4, -0.7, 0.3, 1.1, 0.6, -0.4)
    assert np.allclose(table_tool_pose(converted.spec, q), table_tool_pose(STANFORD.spec, q), rtol=0, atol=1e-12)
    assert converted.q == STANFORD.q


def test_other_units_write_other_numbers_for_the_same_robot() -> None:
    state = after(STANFORD, events.SetUnits(angle=AngleUnit.RAD, length=LengthUnit.MM))
    assert state.table.rows[1].cells == ("0", "1.5707963267948966", "150", "0", "0")
    q = STANFORD.q
    assert np.allclose(table_frame_poses(state.spec, q), table_frame_poses(STANFORD.spec, q), rtol=0, atol=1e-15)
    assert state.notice == "Parameters were replaced by their values."


def test_a_file_whose_values_share_an_anchor_is_rewritten() -> None:
    text = "name: x\nconvention: standard\njoints:\n  - {type: revolute, a: &l 0.3}\n  - {type: revolute, a: *l}\n"
    state = open_state(parse_robot(text))
    edited = after(state, events.EditCell(row=0, column="a", text="0.5"))
    assert [row.a for row in edited.spec.rows] == [0.5, 0.3]


def test_the_table_cannot_be_edited_during_a_simulation() -> None:
    driven = after(STANFORD, events.SetMode(mode=Mode.PHYSICS))
    edited = after(driven, events.EditCell(row=0, column="a", text="1"))
    assert edited.model is STANFORD.model
    assert edited.notice == "The table can be edited in manual mode only."


def test_only_a_simulation_may_pass_a_limit_and_only_until_it_ends() -> None:
    beyond = (*STANFORD.q[:2], -0.001, *STANFORD.q[3:])
    driven = after(STANFORD, events.SetMode(mode=Mode.PHYSICS), events.Follow(q=beyond))
    assert driven.q == beyond
    assert after(driven, events.MoveJoint(joint=0, value=0.0)).q == beyond
    assert after(driven, events.SetMode(mode=Mode.MANUAL)).q[2] == 0.0


def test_while_physics_is_on_the_user_moves_what_the_actuators_hold() -> None:
    driven = after(STANFORD, events.SetMode(mode=Mode.PHYSICS))
    assert driven.target == STANFORD.q
    moved = after(driven, events.MoveJoint(joint=0, value=9.0), events.Nudge(joint=2, direction=1))
    assert moved.q == STANFORD.q
    assert moved.commanded == (math.radians(170), STANFORD.q[1], STANFORD.q[2] + 0.0127, *STANFORD.q[3:])
    still = after(moved, events.SetMode(mode=Mode.MANUAL))
    assert still.commanded == STANFORD.q


def test_a_motion_is_paused_and_stepped_and_a_new_one_runs() -> None:
    assert after(STANFORD, events.Pause(on=True), events.Step()) == STANFORD
    for mode in (Mode.PHYSICS, Mode.REPLAY):
        moving = after(STANFORD, events.SetMode(mode=mode))
        assert (moving.paused, moving.steps) == (False, 0)
        stepped = after(moving, events.Step(), events.Step())
        assert (stepped.paused, stepped.steps) == (True, 2)
        going = after(stepped, events.Pause(on=False))
        assert (going.paused, going.steps) == (False, 2)
        restarted = after(stepped, events.SetMode(mode=mode))
        assert (restarted.paused, restarted.steps) == (False, 0)


def test_only_links_of_a_simulated_robot_can_be_dragged() -> None:
    drag = LinkDrag(link="link_3", point_in_link=(0.0, 0.1, 0.0), target=(1.0, 0.0, 0.0))
    assert after(STANFORD, events.DragLink(drag=drag)).drag is None
    driven = after(STANFORD, events.SetMode(mode=Mode.PHYSICS), events.DragLink(drag=drag))
    assert driven.drag == drag
    further = replace(drag, target=(1.0, 1.0, 0.0))
    assert after(driven, events.DragLink(drag=further)).drag == further
    for wrong in (replace(drag, link="base_link"), replace(drag, target=(math.nan, 0.0, 0.0))):
        assert after(driven, events.DragLink(drag=wrong)).drag == drag
    assert after(driven, events.ReleaseLink()).drag is None
    assert after(driven, events.SetMode(mode=Mode.MANUAL)).drag is None


def test_joints_cannot_be_moved_during_a_recording() -> None:
    played = after(STANFORD, events.SetMode(mode=Mode.REPLAY), events.Follow(q=(0.1,) * 6))
    assert after(played, events.SetConfiguration(name="zero"), events.Nudge(joint=0, direction=1)).q == (0.1,) * 6


def test_a_continuous_joint_turns_on_without_end() -> None:
    spec = parse_robot("name: x\nconvention: standard\njoints: [{type: continuous, a: 1}]\n")
    assert spec.rows[0].type is JointType.CONTINUOUS
    state = after(open_state(spec), events.MoveJoint(joint=0, value=math.pi + 0.1))
    assert state.q[0] == pytest.approx(-math.pi + 0.1, abs=1e-12)


def test_the_trace_follows_the_tool() -> None:
    state = after(STANFORD, events.Show(part=Part.TRACE, on=True))
    visited = [(0.1 * k, 0.5, 0.3, 0.0, 0.2, 0.0) for k in range(5)]
    state = after(state, *(events.SetJoints(q=q) for q in visited))
    expected = [table_tool_pose(STANFORD.spec, q)[:3, 3] for q in (STANFORD.q, *visited)]
    assert np.allclose(state.trace, expected, rtol=0, atol=1e-12)
    assert after(state, events.Show(part=Part.TRACE, on=False)).trace == ()


def test_the_ghost_of_the_other_reading_follows_the_table() -> None:
    compared = after(STANFORD, events.CompareMisread(), events.EditCell(row=1, column="a", text="0.4"))
    assert compared.ghost is not None
    ghost = compared.ghost.model.spec
    assert [row.convention for row in ghost.rows] == [Convention.MODIFIED] * 6
    assert [row.a for row in ghost.rows] == [row.a for row in compared.spec.rows]
