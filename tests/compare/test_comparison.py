"""Comparing two robots: the same mechanism, what differs although it is, and where two first differ."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dh2sim
from dh2sim.compare.comparison import diff
from dh2sim.compare.matching import ObstacleKind
from dh2sim.errors import Dh2simError, ModelError
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.robot.links import Pose, ToolSpec
from dh2sim.robot.spec import RobotSpec
from tests.compare.disguises import disguised, equation_error, random_table
from tests.compare.misread_tables import misread
from tests.refusals import refusal
from tests.sample_robots import ODD_ROBOT, ROBOTS_DIR, robot, row

GENERATED = ROBOTS_DIR.parent / "generated"


def edited(spec: RobotSpec, index: int, **values: Any) -> RobotSpec:
    rows = list(spec.rows)
    rows[index] = replace(rows[index], **values)
    return replace(spec, rows=tuple(rows))


def test_a_comparison_prints_its_verdict_and_what_differs() -> None:
    found = diff("puma560", "stanford")
    assert repr(found) == "<Comparison of 'puma560' with 'stanford': different>"
    assert str(found).splitlines()[:2] == [
        "Different mechanisms.",
        "  - first difference: joint_3 turns in A, joint_3 slides in B",
    ]
    spec = robot("rpr")
    assert str(diff(spec, spec)) == "The same mechanism."


@pytest.mark.parametrize("seed", range(12))
def test_a_table_written_otherwise_is_the_same_mechanism_and_its_equation_holds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a = random_table(rng, 1 + seed % 7, odd=seed % 2 == 0)
    b = disguised(a, rng)
    same = diff(a, b).equivalence
    assert same is not None
    assert equation_error(a, b, same) < 1e-12


def test_what_differs_although_the_mechanism_is_the_same_is_said() -> None:
    a = robot("puma560")
    b = edited(a, 3, name="wrist", flip=True, theta=math.radians(-90))
    b = replace(b, tool=ToolSpec.at(Pose(xyz=b.tool.xyz, rpy=np.array([0, 0, math.pi / 4]))))
    found = diff(a, b)
    assert found.same
    assert found.sentences() == [
        "wrist of B turns the other way and starts at -90°",
        "tool differs by Rz(45°)",
        "names differ: joint_4 is wrist",
    ]


@pytest.mark.parametrize("kind", ["urdf", "xml"])
def test_the_files_that_a_robot_is_exported_to_are_the_same_robot(kind: str) -> None:
    assert diff("stanford", GENERATED / "stanford" / f"stanford.{kind}").sentences() == []


def test_joints_that_may_be_exchanged_are_found_in_another_order() -> None:
    slides = [
        row("x", "prismatic", alpha=math.pi / 2),
        row("y", "prismatic", alpha=0.7, a=0.1),
        row("z", "prismatic"),
    ]
    a = RobotSpec(name="a", rows=(row("turn", alpha=0.0), row("slide", "prismatic"), row("last", a=0.2, alpha=0.3)))
    b = replace(a, rows=(a.rows[1], a.rows[0], a.rows[2]))
    found = diff(a, b)
    assert found.equivalence is not None
    assert found.equivalence.order == (1, 0, 2)
    assert found.sentences() == ["joints of B are in another order: turn, slide, last"]
    gantry = RobotSpec(name="gantry", rows=tuple(slides))
    assert diff(gantry, gantry).sentences() == []


@pytest.mark.parametrize(
    ("index", "values", "kind", "sentence"),
    [
        (
            1,
            {"a": 0.5},
            ObstacleKind.DISTANCE,
            "the axes of joint_2 and joint_3 are 431.8 mm apart in A, 500 mm in B",
        ),
        (2, {"alpha": 1.0}, ObstacleKind.TWIST, "the axes of joint_3 and joint_4 are 90° apart in A, 57.2958° in B"),
        (3, {"d": 0.4}, ObstacleKind.OFFSET, "along the axis of joint_4, its two common normals are "),
    ],
)
def test_the_first_difference_has_its_numbers(
    index: int, values: dict[str, float], kind: ObstacleKind, sentence: str
) -> None:
    a = robot("puma560_standard")
    found = diff(a, edited(a, index, **values))
    assert not found.same
    assert found.difference is not None
    assert found.difference.kind is kind
    assert found.difference.sentence.startswith(sentence)


def test_robots_that_differ_by_little_are_the_same_at_the_tolerance_that_is_named() -> None:
    a = robot("rpr")
    b = edited(a, 1, alpha=a.rows[1].alpha + 3.7e-6)
    found = diff(a, b)
    assert not found.same
    assert found.same_at is not None
    assert diff(a, b, tolerance=1.01 * found.same_at).same
    assert not diff(a, b, tolerance=0.5 * found.same_at).same


@pytest.mark.parametrize("name", ["ur5e", "stanford", "kuka_iiwa14"])
def test_robots_all_of_whose_numbers_are_slightly_off_are_the_same_to_about_that_tolerance(name: str) -> None:
    """Parallel and intersecting axes, whose common normals turn anywhere when they are slightly off."""
    a = robot(name)
    rng = np.random.default_rng(0)
    rows = [
        replace(each, **{key: getattr(each, key) + 1e-5 * rng.normal() for key in ("a", "alpha", "d")})
        for each in a.rows
    ]
    b = replace(a, rows=tuple(rows), source_file=None)
    assert diff(a, b, tolerance=1e-4).same


def test_where_no_number_is_far_off_by_itself_the_first_that_is_off_is_named() -> None:
    a = robot("planar_2r")
    b = edited(a, 0, a=a.rows[0].a + 4e-6)
    found = diff(a, b)
    assert found.difference is not None
    assert found.difference.kind is ObstacleKind.SUM
    assert found.difference.joints == ("joint_1", "joint_2")
    assert found.difference.sentence.startswith("number by number they nearly agree, but tool0 is up to 0.004")
    assert found.difference.sentence.endswith(
        "the axes of joint_1 and joint_2 are 1000 mm apart in A, 1000.004 mm in B"
    )
    assert "a of row 1 is 1000.004 mm, not 1000 mm" in found.misreadings[0].sentence


def test_a_robot_with_fixed_rows_flips_and_all_conventions_is_itself_in_another_place() -> None:
    b = replace(ODD_ROBOT, base=replace(ODD_ROBOT.base, pose=Pose(xyz=np.array([1.0, 2.0, 3.0]))))
    same = dh2sim.Robot.from_spec(ODD_ROBOT).diff(b).equivalence
    assert same is not None
    assert [joint.sense for joint in same.joints] == [1] * len(same.joints)
    np.testing.assert_allclose([joint.zero for joint in same.joints], 0.0, atol=1e-12)
    pose = ODD_ROBOT.base.pose
    moved = pose_from_rpy([1, 2, 3], [0, 0, 0]) @ np.linalg.inv(pose_from_rpy(pose.xyz, pose.rpy))
    np.testing.assert_allclose(same.T_a_base_b_base, np.linalg.inv(moved), atol=1e-12)


def test_mechanisms_and_wrong_arguments_are_refused_in_words(tmp_path: Path) -> None:
    assert "four_bar: has closed loops" in refusal(ModelError, diff, "four_bar", "puma560")
    assert refusal(Dh2simError, diff, "scara", "scara", tolerance=0) == "tolerance must be above 0 and below 1, got 0"
    assert "no file or robot named" in refusal(Dh2simError, diff, "scara", str(tmp_path / "none.yaml"))


@pytest.mark.parametrize("seed", range(24))
def test_a_misreading_is_named_or_changes_nothing(seed: int) -> None:
    made = misread(seed)
    found = diff(made.right, made.wrong)
    if found.equivalence is not None:
        assert equation_error(made.right, made.wrong, found.equivalence) < 1e-3 * max(1.0, made.size)
        return
    names = [(misreading.kind, misreading.rows, misreading.columns) for misreading in found.misreadings]
    assert (made.kind, made.rows, made.columns) in names


def test_limits_masses_and_gains_are_compared_as_a_counts() -> None:
    a = robot("ur5e")
    same = diff(a, replace(a, base=replace(a.base, pose=Pose(xyz=np.array([0.1, 0.2, 0.3])))))
    assert same.quantities == ()
    first = a.rows[1]
    lower, upper = first.limits.position or (0.0, 0.0)
    heavier = replace(first.link, mass=1.0 + (first.link.mass or 0.0))
    changed = edited(a, 1, link=heavier, flip=True, limits=replace(first.limits, position=(-upper, -lower + 0.1)))
    found = [(q.joint, q.quantity, q.b) for q in diff(a, changed).quantities]
    assert [(name, quantity) for name, quantity, _ in found] == [
        (first.name, "position limits"),
        (first.name, "mass"),
    ]


def test_a_robot_whose_rows_are_all_fixed_is_the_same_as_any_other_such() -> None:
    still = RobotSpec(name="still", rows=(row("bracket", "fixed", a=0.1),))
    other = RobotSpec(name="other", rows=(row("bracket", "fixed", a=0.2, alpha=0.3),))
    assert diff(still, still).sentences() == []
    assert diff(still, other).same


def test_robots_of_very_many_joints_are_refused_at_once() -> None:
    long = replace(
        robot("planar_2r"), rows=tuple(row(name=f"joint_{k}", a=0.1) for k in range(65)), configurations={}
    )
    assert refusal(Dh2simError, diff, long, robot("planar_2r")) == (
        "planar_2r: 65 joints move; robots with at most 64 can be compared"
    )
