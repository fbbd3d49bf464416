from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dh2sim.errors import ConfigurationError
from dh2sim.inverse.branches import branch_names
from dh2sim.inverse.textbook import explain_inverse_kinematics
from dh2sim.kinematics.conversion import convert_rows
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.links import BaseSpec, Pose
from dh2sim.robot.row import Convention
from dh2sim.typing import read_only
from tests.inverse.disguised_arms import CLASSES, disguised, random_configuration, textbook_table
from tests.sample_robots import ODD_ROBOT, robot


@pytest.mark.parametrize("name", CLASSES)
def test_names_of_closed_forms_branches_are_those_of_their_configurations(name: str) -> None:
    spec = disguised(textbook_table(name, 2), 7)
    explanation = explain_inverse_kinematics(spec, table_tool_pose(spec, random_configuration(spec, 2)))
    found = np.array([branch.q for branch in explanation.branches])
    assert branch_names(spec, found) == tuple(branch.name for branch in explanation.branches)


def test_whole_turns_do_not_change_a_name() -> None:
    spec = robot("puma560")
    q = random_configuration(spec, 1)
    assert branch_names(spec, [q, q + 2 * np.pi, q - 4 * np.pi]) == branch_names(spec, [q]) * 3


@pytest.mark.parametrize(
    ("q", "name"),
    [
        # at zero the upper arm is level and the forearm hangs down from the elbow; the shoulder is to the left
        ([0.0, 0.0, 0.0, 0.0, 0.5, 0.0], "left, above, no flip"),
        ([0.0, 0.0, 0.0, 0.0, -0.5, 0.0], "left, above, flip"),
        # the forearm points upwards: the elbow is below the line from shoulder to wrist
        ([0.0, 0.0, np.pi, 0.0, 0.5, 0.0], "left, below, no flip"),
        # the upper arm points backwards over the base
        ([0.0, -np.pi, np.pi, 0.0, 0.5, 0.0], "right, above, no flip"),
    ],
)
def test_the_pumas_names_say_where_shoulder_and_elbow_are(q: list[float], name: str) -> None:
    assert branch_names(robot("puma560"), [q]) == (name,)


def test_an_elbow_at_the_left_of_the_line_from_base_to_tool_is_a_left_scara() -> None:
    # joint 2 turns clockwise, seen from above
    assert branch_names(robot("scara"), [[0.3, -0.7, 0.1, 0.0], [0.3, 0.7, 0.1, 0.0]]) == ("left", "right")


def test_an_arm_that_textbooks_do_not_name_has_no_names() -> None:
    assert branch_names(ODD_ROBOT, np.zeros((2, 5))) == ("", "")


@pytest.mark.parametrize(
    ("name", "q", "words"),
    [
        ("scara", [0.3, 0.0, 0.1, 0.0], "elbow straight"),
        ("scara", [0.3, np.pi, 0.1, 0.0], "elbow folded"),
        ("planar_2r", [0.3, 0.0], "elbow straight"),
        ("puma560", [0.0, 0.0, 0.0, 0.0, 0.0, 0.0], "left, above, wrist singular"),
        ("puma560", [0.0, 0.0, -np.arctan2(0.4318, 0.0203), 0.0, 0.5, 0.0], "left, elbow straight, no flip"),
        ("ur5e", [0.0, -1.0, 0.0, -1.0, 0.0, 0.0], "left, elbow straight, wrist singular"),
        ("stanford", [0.3, 0.2, 0.3, 0.4, 0.0, 0.5], "left, slide out, wrist singular"),
        ("stanford", [0.3, 0.0, 0.3, 0.4, 0.5, 0.5], "shoulder singular, slide out, no flip"),
    ],
)
def test_what_is_singular_is_told(name: str, q: list[float], words: str) -> None:
    assert branch_names(robot(name), [q]) == (words,)


def test_a_calibrated_arm_has_the_names_of_its_class() -> None:
    spec = robot("puma560")
    rng = np.random.default_rng(0)
    bent = replace(
        spec,
        rows=tuple(
            replace(row, a=row.a + rng.normal() * 3e-4, alpha=row.alpha + rng.normal() * 1e-3) for row in spec.rows
        ),
    )
    q = np.array([random_configuration(spec, seed) for seed in range(20)])
    assert branch_names(bent, q) == branch_names(spec, q)
    assert all(branch_names(spec, q))


def test_a_joint_vector_of_the_wrong_length_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="expected 6 joint coordinates"):
        branch_names(robot("puma560"), [[0.0, 0.0]])


@pytest.mark.parametrize("name", CLASSES)
def test_names_are_the_same_in_both_conventions_for_any_size_and_from_any_base(name: str) -> None:
    spec = textbook_table(name, 3)
    q = np.array([random_configuration(spec, seed) for seed in range(5)])
    names = branch_names(spec, q)
    assert any(names)
    assert branch_names(convert_rows(spec, Convention.MODIFIED).spec, q) == names
    moved = replace(spec, base=BaseSpec(pose=Pose(xyz=read_only([0.3, -2.0, 0.7]), rpy=read_only([0.4, -1.0, 2.0]))))
    assert branch_names(moved, q) == names
    scale = np.array([1.0 if row.type.turns else 1e-3 for row in spec.rows])
    small = replace(spec, rows=tuple(replace(row, a=1e-3 * row.a, d=1e-3 * row.d) for row in spec.rows))
    assert branch_names(small, q * scale) == names


@pytest.mark.parametrize("name", ["puma", "stanford", "cylindrical", "scara", "planar 3R", "offset wrist"])
def test_another_zero_changes_no_name(name: str) -> None:
    spec = textbook_table(name, 2)
    rng = np.random.default_rng(6)
    shift = rng.uniform(-0.3, 0.3, len(spec.rows))
    rows = tuple(
        replace(row, theta=row.theta + by) if row.type.turns else replace(row, d=row.d + by)
        for row, by in zip(spec.rows, shift.tolist(), strict=True)
    )
    q = np.array([random_configuration(spec, seed) for seed in range(10)])
    assert branch_names(replace(spec, rows=rows), q - shift) == branch_names(spec, q)
