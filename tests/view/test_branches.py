"""All ways to hold the tool where it is: drawn pale, listed, and clicked through."""

from __future__ import annotations

import numpy as np
import pytest

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.read import load_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.view.branches import branch_name_of, branches_of
from dh2sim.view.events import MoveJoint, Notify, SetJoints, SetMode, Show
from dh2sim.view.initial_state import open_state
from dh2sim.view.panel.branches import branches_markup, go_to
from dh2sim.view.scene.items import Solid
from dh2sim.view.scene.scene import BRANCHES, scene_of
from dh2sim.view.state import Mode, Part, ViewState, within
from tests.sample_robots import row
from tests.view.states import STANFORD, after

ON = Show(part=Part.BRANCHES, on=True)
PLANAR = after(open_state(load_robot("planar_2r")), MoveJoint(joint=0, value=0.4), MoveJoint(joint=1, value=0.9))


def ghosts(state: ViewState) -> set[str]:
    solids = [name for name, item in scene_of(state).items() if isinstance(item, Solid)]
    return {name.split("/")[2] for name in solids if name.startswith(f"{BRANCHES}/")}


@pytest.mark.parametrize("state", [STANFORD, PLANAR], ids=["stanford", "planar_2r"])
def test_every_branch_holds_the_tool_where_it_is_inside_the_limits(state: ViewState) -> None:
    found = branches_of(state).branches
    assert len(found) > 1
    assert [branch.q for branch in found if branch.here] == [state.q]
    for branch in found:
        assert within(state.model, branch.q) == pytest.approx(branch.q, abs=1e-12)
        here, there = (table_tool_pose(state.spec, np.array(q)) for q in (state.q, branch.q))
        held = slice(3, 4) if branches_of(state).point_only else slice(0, 4)
        assert there[:, held] == pytest.approx(here[:, held], abs=1e-10)


def test_the_other_branches_are_drawn_pale_only_on_request() -> None:
    assert ghosts(STANFORD) == set()
    state = after(STANFORD, ON)
    others = {f"branch_{i}" for i, branch in enumerate(branches_of(state).branches, 1) if not branch.here}
    assert ghosts(state) == others
    solids = [item for name, item in scene_of(state).items() if name.startswith(BRANCHES) and isinstance(item, Solid)]
    assert all(solid.opacity < 0.2 for solid in solids)


def test_while_something_else_moves_the_robot_no_branches_are_drawn() -> None:
    assert ghosts(after(STANFORD, ON, SetMode(mode=Mode.PHYSICS))) == set()


def test_the_list_stays_while_it_is_clicked_through() -> None:
    state = after(STANFORD, ON)
    listed = branches_of(state)
    for number, branch in enumerate(listed.branches, start=1):
        event = go_to(listed, str(number))
        assert isinstance(event, SetJoints)
        moved = after(state, event)
        assert moved.q == branch.q
        again = branches_of(moved).branches
        assert [other.name for other in again] == [other.name for other in listed.branches]
        assert [other.here for other in again].index(True) == number - 1
        assert np.array([other.q for other in again]) == pytest.approx(
            np.array([other.q for other in listed.branches]), abs=1e-6
        )


def test_a_number_that_is_no_longer_in_the_list_is_told() -> None:
    assert go_to(branches_of(PLANAR), "9") == Notify(notice="This branch is no longer in the list.")
    assert isinstance(go_to(None, "1"), Notify)


def test_a_joint_to_spare_stays_and_is_named() -> None:
    state = open_state(load_robot("ssrms"))
    found = branches_of(state)
    assert found.locked == ("joint_7",)
    assert [branch.q[6] for branch in found.branches] == pytest.approx([state.q[6]] * len(found.branches))
    assert "while joint_7 stays, inside the limits" in branches_markup(state, found)


def test_the_list_has_names_and_joint_values_in_the_units_of_the_page() -> None:
    text = branches_markup(PLANAR, branches_of(PLANAR))
    assert "2 ways to hold the point of tool0 here, inside the limits; ° and m" in text
    assert f"<b>{branch_name_of(PLANAR)}</b>, here" in text
    assert "22.9 51.6" in text


def test_a_robot_that_does_not_move_has_no_branches() -> None:
    state = open_state(RobotSpec(name="stick", rows=(row("j", "fixed", a=0.5),)))
    assert branches_of(state).branches == ()
    assert branch_name_of(state) == ""
