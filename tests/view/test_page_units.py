"""Units and conventions of the table in a real browser: other numbers, the same robot."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.row import Convention
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.view.initial_state import open_state
from tests.view.on_page import (
    Serve,
    choose,
    field,
    open_tab,
    shown,
    wait_for_equal,
    wait_for_position,
    wait_for_text,
    wait_for_value,
    wait_for_whole_text,
    wait_until,
)

STANFORD = load_robot("stanford")
HOME = STANFORD.configurations["home"].tolist()
SOMEWHERE = [0.3, -0.7, 0.45, 1.1, -0.2, 0.9]


@pytest.mark.slow
def test_the_table_is_written_in_radians_and_millimetres_and_the_robot_stays(serve: Serve) -> None:
    page, served = serve(open_state(STANFORD))
    open_tab(page, "Table")
    page.get_by_text("Whole table").click()
    choose(page, "Row", "2: joint_2")
    wait_for_value(page, "α₂", "90")
    choose(page, "Angles in", "rad")
    wait_for_value(page, "α₂", "1.5707963267948966")
    choose(page, "Lengths in", "mm")
    wait_for_value(page, "d₂", f"{1000.0 * STANFORD.rows[1].d:g}")
    assert served.state.table.errors == ()
    wait_for_whole_text(page, "cell-errors", "")
    written = parse_robot(served.state.text)
    assert (served.state.table.units.angle, served.state.table.units.length) == (AngleUnit.RAD, LengthUnit.MM)
    for q in (HOME, SOMEWHERE):
        assert np.allclose(table_tool_pose(written, q), table_tool_pose(STANFORD, q), rtol=0, atol=1e-12)
    open_tab(page, "Joints")
    wait_for_position(page, STANFORD, HOME)
    field(page, "joint_1 [°]").wait_for()  # the panel's own unit is another matter


@pytest.mark.slow
def test_a_converted_table_is_another_one_of_the_same_robot(serve: Serve) -> None:
    page, served = serve(open_state(STANFORD))
    open_tab(page, "Table")
    page.get_by_text("Whole table").click()
    page.get_by_role("button", name="modified").last.click()
    wait_until(lambda: shown(page, "notice").startswith("Converted: "), "the table is converted")
    written = parse_robot(served.state.text)
    assert {row.convention for row in STANFORD.rows} == {Convention.STANDARD}
    assert {row.convention for row in written.rows} == {Convention.MODIFIED}
    for q in (HOME, SOMEWHERE):
        assert np.allclose(table_tool_pose(written, q), table_tool_pose(STANFORD, q), rtol=0, atol=1e-9)
    open_tab(page, "Joints")
    wait_for_position(page, STANFORD, HOME)


@pytest.mark.slow
def test_the_same_table_read_in_another_convention_is_another_robot(serve: Serve) -> None:
    page, served = serve(open_state(STANFORD))
    open_tab(page, "Table")
    page.get_by_text("Whole table").click()
    page.get_by_role("button", name="modified").first.click()
    wait_until(
        lambda: {row.convention for row in served.state.spec.rows} == {Convention.MODIFIED}, "it is read again"
    )
    assert [row.alpha for row in served.state.spec.rows] == [row.alpha for row in STANFORD.rows]
    assert not np.allclose(table_tool_pose(served.state.spec, HOME), table_tool_pose(STANFORD, HOME), atol=0.1)
    open_tab(page, "Joints")
    wait_for_position(page, served.state.spec, HOME)


@pytest.mark.slow
def test_sliders_show_degrees_or_radians(serve: Serve) -> None:
    page, served = serve(open_state(STANFORD))
    wait_for_value(page, "joint_2 [°]", f"{math.degrees(HOME[1]):g}")
    wait_for_text(page, "readout", "rpy [°]")
    choose(page, "Angles in", "rad")
    wait_for_equal(lambda: float(field(page, "joint_2 [rad]").input_value()), pytest.approx(HOME[1], abs=0.6e-4))
    field(page, "joint_3 [m]").wait_for()
    wait_for_text(page, "readout", "rpy [rad]")
    field(page, "joint_2 [rad]").fill("0.5")
    wait_for_position(page, STANFORD, [HOME[0], 0.5, *HOME[2:]])
    assert served.state.q[1] == 0.5
    choose(page, "Angles in", "deg")
    wait_for_value(page, "joint_2 [°]", "28.65")
