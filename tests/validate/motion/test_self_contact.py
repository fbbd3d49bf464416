"""Links that touch by construction make no contacts; an exclusion that is missing is found."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from dh2sim.model.collision_exclusions import Reason
from dh2sim.model.robot_model import RobotModel
from dh2sim.validate.motion.free_motion import compile_model
from dh2sim.validate.motion.self_contact import by_construction, check_self_contact, random_tour
from dh2sim.validate.report import Check
from tests.robot_files import ODD, snake
from tests.sample_robots import COSTLY_NAMES
from tests.validate.motion.robots import FOLDED, built


def checked(model: RobotModel, *, seed: int = 0) -> Check:
    return check_self_contact(model, compile_model(model), seed=seed)


@pytest.mark.slow
@pytest.mark.parametrize("robot", [*COSTLY_NAMES, ODD, snake(12)], ids=lambda text: text.split("\n")[0])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_robot_makes_no_contacts_by_construction(robot: str, seed: int) -> None:
    check = checked(built(robot), seed=seed)
    assert (check.ok, check.max_error, check.samples) == (True, 0.0, 601)


@pytest.mark.parametrize("name", COSTLY_NAMES)
def test_links_that_touch_by_construction_are_excluded_ones(name: str) -> None:
    model = built(name)
    excluded = {(pair.link1, pair.link2) for pair in model.excluded}
    found = by_construction(model)
    shapeless = {link.name for link in model.all_links if not link.shapes}
    assert {pair for pair in found if shapeless.isdisjoint(pair)} <= excluded


@pytest.mark.parametrize("reason", [Reason.DEFAULT, Reason.ADJACENT], ids=lambda reason: reason.value)
def test_a_missing_exclusion_is_found(reason: Reason) -> None:
    """MuJoCo itself leaves out parents and children, but not the base and its child."""
    model = built("stanford")
    missing = next(pair for pair in model.excluded if pair.reason is reason)
    less = replace(model, excluded=tuple(pair for pair in model.excluded if pair is not missing))
    check = checked(less)
    assert check.ok is False
    assert check.worst is not None
    assert check.worst.where == f"{missing.link1}, {missing.link2}"
    assert check.reason is not None
    assert check.reason.startswith(f"{missing.link1} and {missing.link2} overlap by ")
    assert check.reason.endswith("Simulated, they would push each other away")


def test_an_exclusion_that_matters_only_on_the_way_is_found_on_the_tour() -> None:
    model = built("puma560")
    found = 0
    for missing in model.excluded:
        less = replace(model, excluded=tuple(pair for pair in model.excluded if pair is not missing))
        check = checked(less)
        if check.ok is False and check.worst is not None and check.worst.sample is not None:
            assert check.reason is not None
            assert " on a tour of the workspace, and touch by construction. " in check.reason
            assert np.array_equal(check.worst.q, random_tour(model, 0)[check.worst.sample])
            found += 1
    assert found


def test_links_that_touch_all_along_the_tour_are_found() -> None:
    """The second link hardly turns, so that the third stays inside the first, though they do not touch at home."""
    model = built(FOLDED)
    narrow = FOLDED.replace("[-3, 3]", "[2.0, 2.2]").replace("home: [0, 0, 0]", "home: [2.1, 2.1, 2.1]")
    folded = built(narrow.replace("folded: [0, 2.1, 2.1]", "other: [2.1, 2.1, 2.1]"))
    assert ("link_1", "link_3") not in {(pair.link1, pair.link2) for pair in model.excluded}
    less = replace(folded, home=np.zeros(3), excluded=model.excluded, spec=replace(folded.spec, configurations={}))
    check = checked(less)
    assert check.ok is False
    assert check.reason is not None
    assert " and touch all along a tour of the workspace" in check.reason


def test_a_configuration_in_which_links_touch_is_named() -> None:
    check = checked(built(FOLDED))
    assert check.ok is False
    assert check.worst is not None
    assert check.worst.q == (0.0, 2.1, 2.1)
    assert check.max_error is not None
    assert check.reason == (
        f"link_1 and link_3 overlap by {check.max_error:.2g} m in configuration 'folded', and 1 other pair of "
        "links. Simulated, they would push each other away"
    )


def test_what_an_arm_may_do_to_itself_on_the_way_is_no_fault_of_its_model() -> None:
    model = built(FOLDED.replace(", folded: [0, 2.1, 2.1]", ""))
    compiled = compile_model(model)
    data = mujoco.MjData(compiled)
    contacts = 0
    for q in random_tour(model, 0):
        data.qpos[:] = q
        mujoco.mj_forward(compiled, data)
        contacts += data.ncon
    assert contacts > 0
    assert checked(model).ok


def test_the_tour_stays_inside_the_limits_and_moves_in_straight_lines() -> None:
    model = built("stanford")
    tour = random_tour(model, 5)
    assert np.array_equal(tour, random_tour(model, 5))
    assert not np.array_equal(tour, random_tour(model, 6))
    for column, joint in zip(tour.T, model.moving_joints, strict=True):
        assert joint.position_range is not None
        lower, upper = joint.position_range
        assert lower <= column.min() < column.max() <= upper
    bends = np.abs(np.diff(tour, n=2, axis=0)).max(axis=1) > 1e-12
    assert np.flatnonzero(bends).tolist() == list(range(39, 599, 40))
