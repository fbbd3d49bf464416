"""Workspaces of all kinds of robots."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim import Continuous, Fixed, Prismatic, Revolute, Robot
from dh2sim.errors import ConfigurationError, SettingsError, UnknownFrameError
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.read import parse_robot
from dh2sim.workspace.workspace import compute_workspace

QUICKLY = ("so101", "ssrms")


@pytest.mark.parametrize(
    "robot", [name if name in QUICKLY else pytest.param(name, marks=pytest.mark.slow) for name in builtin_robots()]
)
def test_every_voxel_of_every_robot_is_reached_by_its_configuration(robot: str) -> None:
    arm = Robot.load(robot)
    found = arm.workspace(samples=3000, size=max(0.06, 0.06 * arm.model.reach), threads=1)
    p = arm.fk(found.q)[:, :3, 3]
    off = np.abs((p - found.centers) @ found.axes.T)
    assert off.max(initial=0.0) <= 0.5 * found.size * (1.0 + 1e-9)
    lower, upper = arm.limits
    assert ((found.q >= lower) & (found.q <= upper)).all()
    assert found.count.sum() == 3000


def test_results_do_not_depend_on_the_number_of_threads() -> None:
    arm = Robot.load("stanford")
    one, three = (arm.workspace(samples=20000, size=0.1, threads=threads) for threads in (1, 3))
    for name in ("centers", "count", "manipulability", "q"):
        np.testing.assert_array_equal(getattr(one, name), getattr(three, name))


def test_search_finds_what_more_random_configurations_find() -> None:
    arm = Robot.load("puma560")
    few = arm.workspace(samples=2000, size=0.08, threads=1)
    many = arm.workspace(samples=120000, size=0.08, threads=1)
    sampled = {tuple(center) for center in many.centers[many.count > 0].round(6)}
    found = {tuple(center) for center in few.centers.round(6)}
    assert len(sampled - found) <= 0.002 * len(sampled)
    assert (few.count > 0).sum() < 0.3 * len(found)


@pytest.mark.slow
def test_voxels_fill_the_section_turned_about_the_first_axis() -> None:
    found = Robot.load("arm_5r").workspace(samples=20000, size=0.04, section=True, threads=1)
    assert found.section is not None
    assert found.volume is not None
    shell = 2.0 * math.pi * found.section.area**0.5 * 0.04 * 8  # voxels at the boundary, some of them hardly reached
    assert found.volume < len(found.centers) * 0.04**3 < found.volume + shell


@pytest.mark.parametrize(
    ("rows", "dimension", "axes", "count"),
    [
        ([Revolute(a=0.5, limits=(0.0, 1.0))], 1, 2, None),
        ([Prismatic(limits=(0.1, 0.5))], 1, 1, 11),
        ([Revolute(limits=(0.0, 1.0))], 0, 1, 1),
        ([Continuous(a=0.3, alpha=1.0), Continuous(a=0.2)], 2, 3, None),
        ([Fixed(d=0.2), Prismatic(alpha=-1.2, limits=(0, 0.3)), Revolute(a=0.3, limits=(-1, 1))], 2, 3, None),
    ],
)
def test_points_curves_and_surfaces_are_told_apart(
    rows: list[Revolute], dimension: int, axes: int, count: int | None
) -> None:
    found = Robot(rows).workspace(samples=2000, size=0.04, threads=1)
    assert (found.dimension, len(found.axes)) == (dimension, axes)
    assert found.volume is None
    if count is not None:
        assert len(found.centers) == count


@pytest.mark.slow
def test_a_planar_arm_that_stands_upright_and_askew_has_flat_cells() -> None:
    tilted = np.eye(4)
    tilted[:3, :3] = [[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]]
    flat = [
        Robot([Revolute(a=0.5, limits=(-1, 1)), Revolute(a=0.3, limits=(0.2, 2))], base=base).workspace(
            samples=3000, section=True, threads=1
        )
        for base in (np.eye(4), tilted)
    ]
    assert flat[0].area == pytest.approx(flat[1].area, rel=1e-3)
    assert flat[1].area == pytest.approx(2.0 * 0.15 * (math.cos(0.2) - math.cos(2.0)), rel=2e-2)
    assert np.abs(flat[1].centers @ tilted[:3, 2]).max() < 1e-12


def test_an_arm_whose_first_joint_slides_has_voxels_but_no_section() -> None:
    rows = [Prismatic(alpha=math.pi / 2, limits=(0, 1)), Revolute(alpha=1.0, a=0.4), Revolute(a=0.3)]
    assert Robot(rows, name="gantry").workspace(samples=2000, size=0.1, threads=1).dimension == 3
    with pytest.raises(ConfigurationError) as caught:
        Robot(rows, name="gantry").workspace(section=True)
    assert str(caught.value) == (
        "gantry has no section in r and z: its first joint, joint_1, slides; its voxels show what it reaches"
    )


def test_a_travel_that_is_assumed_is_noted() -> None:
    found = Robot([Revolute(alpha=1.2), Prismatic()]).workspace(samples=500, size=0.2, threads=1)
    assert any(note.startswith("joint_2 has no limits: ") for note in found.notes)


def test_dexterity_of_a_planar_3r_arm_is_the_share_of_angles() -> None:
    lengths = (0.5, 0.4, 0.1)
    arm = Robot([Continuous(a=length) for length in lengths], name="planar_3r")
    found = arm.workspace(samples=2000, size=0.2, dexterity=True, orientations=16, threads=1)
    assert found.dexterity is not None
    assert found.dexterity.kind == "angles"
    # the wrist must be at most 0.9 and at least 0.1 from the base: all angles from 0.2 to 0.8
    r = np.hypot(*found.centers[:, :2].T)
    assert (found.dexterity.share[(r > 0.31) & (r < 0.69)] == 1.0).all()
    assert found.dexterity.share[r > 0.95].max(initial=0.0) < 0.7


def test_dexterity_of_a_full_arm_is_what_inverse_kinematics_says() -> None:
    arm = Robot.load("puma560")
    found = arm.workspace(samples=2000, size=0.5, dexterity=True, orientations=6, threads=1)
    assert found.dexterity is not None
    assert found.dexterity.kind == "orientations"
    assert 0.1 < found.dexterity.share.mean() < 0.9


def test_arms_without_a_choice_of_orientations_have_no_dexterity() -> None:
    with pytest.raises(ConfigurationError, match=r"^planar_2r, with 2 joints, cannot choose the orientation"):
        Robot.load("planar_2r").workspace(samples=500, dexterity=True)


def test_wrong_arguments_are_reported_together() -> None:
    with pytest.raises(SettingsError) as caught:
        Robot.load("puma560").workspace(size=-1.0, samples=0, seed=-2)
    assert [name for name, _ in caught.value.problems] == ["size", "samples", "seed"]
    with pytest.raises(SettingsError, match=r"^size of 0\.001 m would need .* voxels, more than 8,000,000; use 0\.0"):
        Robot.load("puma560").workspace(size=0.001)
    with pytest.raises(UnknownFrameError):
        Robot.load("puma560").workspace(frame="dh_9")


@pytest.mark.slow
def test_voxels_are_as_fine_as_the_arm_is_large_unless_a_size_is_given() -> None:
    def scaled(factor: float) -> Robot:
        links = [
            Revolute(d=0.3 * factor, alpha=1.5),
            Revolute(a=0.4 * factor, limits=(-2, 1)),
            Revolute(a=0.3 * factor),
        ]
        return Robot(links)

    sizes = {factor: scaled(factor).workspace(samples=500, threads=1) for factor in (1.0, 10.0, 1000.0)}
    assert sizes[10.0].size == pytest.approx(10.0 * sizes[1.0].size)
    assert sizes[1000.0].size == pytest.approx(1000.0 * sizes[1.0].size)
    assert 10_000 < len(sizes[1.0].centers) < 100_000
    assert scaled(1.0).workspace(samples=500, size=0.1, threads=1).size == 0.1


def test_an_arm_of_very_many_joints_is_refused_at_once() -> None:
    rows = "\n".join("  - {type: revolute, a: 0.1, alpha: 1.0}" for _ in range(31))
    spec = parse_robot(f"name: long\nconvention: standard\njoints:\n{rows}\n")
    with pytest.raises(ConfigurationError, match=r"long: 31 joints move tool0; workspaces are found for at most 30"):
        compute_workspace(spec, section=True, dexterity=True)
    assert len(compute_workspace(spec, frame="dh_3", samples=1000).joints) == 31
