"""Every robot matches its table: those that come with dh2sim, and any other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, given, settings

from dh2sim import build_model, parse_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.validate.run import validate_robot
from tests.engines.files import PYBULLET
from tests.export.broken import SHIFT, shifted_chain
from tests.robot_files import ODD, RICH, small, write
from tests.sample_robots import NAMES, ROBOTS_DIR
from tests.strategies import robot_specs
from tests.validate.files import failures, validated

ENGINES = ["dh2sim", "mujoco-mjcf", "mujoco-urdf", "yourdfpy", "pinocchio", *(["pybullet"] if PYBULLET else [])]


@pytest.mark.parametrize("name", NAMES)
def test_a_robot_that_comes_with_dh2sim_matches_its_table(name: str) -> None:
    report = validated(ROBOTS_DIR / f"{name}.yaml", samples=50)
    assert failures(report) == {}
    [robot] = report["robots"]
    poses = [entry for entry in robot["engines"] if entry["quantity"] == "pose" and entry["ok"] is not None]
    assert [entry["engine"] for entry in poses] == ENGINES
    assert {entry["samples"] for entry in poses} == {50}
    assert len({entry["frames"] for entry in poses}) == 1
    assert all(entry["max_rotation_error"] < 1e-13 for entry in poses)


SNAPPED = 1e-5
"""m or rad: MuJoCo takes a centre of mass that is 1e-6 from its body's frame to be in it."""


def _numbers(spec: RobotSpec) -> Iterator[float]:
    """Every length and angle of a robot."""
    for row in spec.rows:
        yield from (row.a, row.alpha, row.d, row.theta)
        if row.link.com is not None:
            yield from row.link.com
    for pose in (spec.base.pose, spec.tool):
        yield from (*pose.xyz, *pose.rpy)


@settings(
    max_examples=min(25, settings().max_examples),
    deadline=None,
    derandomize=True,
    suppress_health_check=list(HealthCheck),
)
@given(robot_specs(max_rows=6, must_move=False))
def test_any_robot_matches_its_table(spec: RobotSpec) -> None:
    assume(all(x == 0.0 or abs(x) > SNAPPED for x in _numbers(spec)))
    report = validate_robot(build_model(replace(spec, name="arm")), samples=5)
    assert [check for check in report.checks if check.ok is False] == []
    assert {check.engine for check in report.checks if check.ok is None} <= {"pybullet"}


ALL_FIXED = ODD.replace("type: revolute", "type: fixed").replace("type: continuous", "type: fixed")
ALL_FIXED = ALL_FIXED.replace("type: prismatic", "type: fixed").replace(", flip: true", "")
ALL_FIXED = ALL_FIXED.replace(", limits: {position: [-2.5, 2.7]}", "")


@pytest.mark.parametrize(
    "text",
    [ODD, RICH, ALL_FIXED, ODD.replace("type: fixed", "type: continuous"), ODD.replace(", flip: true", "")],
    ids=["mixed rows", "dynamics", "all fixed", "continuous joints", "no flips"],
)
@pytest.mark.parametrize("samples", [1, 7])
def test_a_robot_of_any_kind_of_rows_matches_its_table(tmp_path: Path, text: str, samples: int) -> None:
    report = validated(write(tmp_path, text), samples=samples)
    assert failures(report) == {}
    [robot] = report["robots"]
    poses = [entry for entry in robot["engines"] if entry["quantity"] == "pose" and entry["ok"] is not None]
    assert [entry["engine"] for entry in poses] == ENGINES


def test_a_rotor_that_spins_in_place_matches_its_table(tmp_path: Path) -> None:
    # what its own axis goes through: MuJoCo computes the inertia of such a joint once, with the rotor's in it
    joint = "{type: revolute, dynamics: {damping: 0.1, friction: 0.05, armature: 0.01}}"
    text = f"name: rotor\nconvention: standard\njoints: [{joint}]\n"
    assert failures(validated(write(tmp_path, text), samples=7)) == {}


def test_samples_keep_within_the_limits_and_follow_the_seed(tmp_path: Path) -> None:
    robot = write(tmp_path, small())
    worst: dict[int, list[list[float]]] = {}
    for seed in (0, 0, 1):
        report = validated(robot, None, "--seed", str(seed), "--tolerance", "1e-17")
        reported = [entry["worst"]["q"] for entry in failures(report).values()]
        assert all(-2 <= value <= 2 for q in reported for value in q)
        assert worst.setdefault(seed, reported) == reported
    assert worst[0] != worst[1]


def test_a_wrong_chain_is_found_by_the_library_itself_though_all_engines_agree_with_it() -> None:
    spec = parse_robot(ODD)
    right = build_model(spec)
    wrong = shifted_chain(spec)
    joints = tuple(
        replace(model, T_parent_joint=joint.T_parent_joint, T_joint_dh=joint.T_joint_dh)
        for model, joint in zip(right.joints, wrong.joints, strict=True)
    )
    report = validate_robot(replace(right, chain=wrong, joints=joints), samples=5)
    assert not report.ok
    poses = {check.engine: check for check in report.checks if check.frames is not None}
    assert list(poses) == ENGINES
    for check in poses.values():
        assert check.ok is False
        assert check.max_position_error == pytest.approx(SHIFT, rel=1e-6)
        assert check.worst is not None
        assert check.worst.where in {"dh_2", "dh_3", "dh_4", "dh_5", "tool0"}


def test_a_wrong_direction_of_motion_is_found_by_the_differences_of_the_table() -> None:
    spec = parse_robot(small())
    right = build_model(spec)
    joints = (right.chain.joints[0], replace(right.chain.joints[1], sign=-1.0))
    report = validate_robot(replace(right, chain=replace(right.chain, joints=joints)), samples=5)
    failed = {(check.engine, check.quantity.value, check.reference) for check in report.checks if check.ok is False}
    assert ("dh2sim", "pose", "table") in failed
    assert ("dh2sim", "jacobian", "central differences") in failed
    assert not [engine for engine, quantity, _ in failed if quantity == "pose" and engine != "dh2sim"]


def test_a_tolerance_below_rounding_fails_and_names_the_worst_configuration(tmp_path: Path) -> None:
    robot = write(tmp_path, ODD)
    failed = failures(validated(robot, None, "--tolerance", "1e-17"))
    assert {engine for engine, quantity in failed if quantity == "pose"} == set(ENGINES)
    for entry in failed.values():
        assert entry["tolerance"] == 1e-17
        worst = entry["worst"]
        assert worst["where"] in {"one", "two", "four", "five", "tool0", *(f"dh_{i}" for i in range(6))}
        assert 0 <= worst["sample"] < 20
        assert len(worst["q"]) == 4
        assert -2.5 <= worst["q"][0] <= 2.7
        assert abs(worst["q"][2]) <= math.pi


@pytest.mark.slow
@pytest.mark.skipif(not PYBULLET, reason="PyBullet is not installed")
def test_a_rod_of_kilometres_that_turns_about_its_length_is_judged_by_its_inertia() -> None:
    rod = (
        "name: rod\nconvention: hayati\nunits: {length: in}\njoints:\n"
        "  - {type: continuous, convention: standard, d: 7145.706925471067, theta: -1.5707963267948966}\n"
        "  - {type: revolute, alpha: -999999.9999999999, theta: -1e-06, link: {mass: 1e-12,"
        " radius: 787401.5748031497, inertia: {ixx: 1.0, iyy: 0.50000000000001, izz: 0.50000000000001}}}\n"
        "  - {type: revolute, a: -8.297555178567258, alpha: -1e-06, theta: -1.0}\n"
        "  - {type: prismatic, alpha: 0.5235987755982988, d: -3937007.874015748, theta: -1.5707963267948966,"
        " beta: 1.5707963267948966}\n"
        "configurations: {home: [1.0, -1e-06, 999999.9999999999, -787401.5748031497]}\n"
    )
    report = validate_robot(build_model(parse_robot(rod)))
    assert [check for check in report.checks if check.ok is False] == []


@pytest.mark.slow
@pytest.mark.skipif(not PYBULLET, reason="PyBullet is not installed")
def test_a_mass_matrix_is_judged_beside_the_inertia_of_the_rods_that_a_joint_carries() -> None:
    rods = (
        "name: rods\nconvention: hayati\nbase: {rpy: [-1.5707963267948966, -1.5707963267948966, 1e-06]}\njoints:\n"
        "  - {type: continuous, a: 1e-06, beta: 1.5707963267948966, link: {density: 39.64740800021732}}\n"
        "  - {type: fixed, convention: modified, alpha: -1.0, theta: 3.141592653589793}\n"
        "  - {type: revolute, theta: 0.016206977847951044, beta: 1.5707963267948966}\n"
        "  - {type: continuous, a: -100000.0, alpha: -1000000.0}\n"
        "  - {type: prismatic, a: 0.5, limits: {position: [0, 1]}, link: {mass: 0.8783650558214348}}\n"
        "  - {type: fixed, a: -20000.0, theta: 1.5707963267948966, link: {radius: 1e-06}}\n"
        "  - {type: continuous, convention: standard, theta: 1.5707963267948966}\n"
        "  - {type: revolute, theta: -1.5707963267948966, link: {mass: 0.1, com: [1e-06, -20000.0, 1e-06],"
        " inertia: {ixx: 0.25, iyy: 1.0353981633974483, izz: 0.7853981633974583}}}\n"
    )
    report = validate_robot(build_model(parse_robot(rods)), samples=50)
    assert [check for check in report.checks if check.ok is False] == []


@pytest.mark.slow
def test_a_planet_on_a_fast_arm_is_judged_by_the_forces_that_its_motion_makes() -> None:
    planet = (
        "name: planet\nconvention: modified\nunits: {angle: deg}\njoints:\n"
        "  - {type: prismatic, d: -20000.0}\n"
        "  - {type: revolute, convention: standard, a: 1.0, alpha: 30.0, theta: -946.7104442348875, flip: true}\n"
        "  - {type: fixed, alpha: -5761.061580087594, d: 4.419700222058943e-06, theta: -90.0}\n"
        "  - {type: prismatic, a: 36905.07220454905, alpha: 180.0, theta: -57295779.513082325}\n"
        "  - {type: revolute, a: 1.0, alpha: 180.0, d: 1.5707963267948966}\n"
        "  - {type: revolute, link: {density: 1e5}}\n"
        "  - {type: revolute, flip: true}\n"
        "  - {type: revolute, a: 6.400124965202625e-07, alpha: 90.0, d: -1.5707963267948966,"
        " theta: -0.003219786678914402, link: {radius: 549248.8797627555,"
        " inertia: {ixx: 0.50000000000001, iyy: 2.834637082785638e-05, izz: 0.5000283463708178}}}\n"
    )
    report = validate_robot(build_model(parse_robot(planet)), samples=50)
    assert [check for check in report.checks if check.ok is False] == []
