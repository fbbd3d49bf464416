"""Robots that are off their tables come back from noisy measurements, as far as those can tell."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from dh2sim.calibrate.calibration import calibrate_robot
from dh2sim.calibrate.measurements import measurements
from dh2sim.calibrate.result import Calibration, ParameterStatus
from dh2sim.errors import CalibrationError
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.links import Pose, ToolSpec
from dh2sim.robot.row import Limits
from dh2sim.robot.spec import RobotSpec
from tests.calibrate.measured import SIGMA, measured, numbers, off, random_q, turned
from tests.refusals import refusal
from tests.sample_robots import ODD_ROBOT, robot, row

COUNTS = [("puma560", 30, 27), ("ur5e", 30, 27), ("franka_panda", 34, 31), ("stanford", 28, 25), ("scara", 20, 17)]
"""4 R + 2 P + 6 of poses, three less of positions."""


def fitted(name: str, kind: str, count: int = 50, **options: object) -> tuple[RobotSpec, Calibration]:
    nominal = robot(name)
    true = off(nominal, 1e-3, 1)
    q = random_q(nominal, count, 2)
    given = measured(nominal, true, kind, q, seed=3)
    options.setdefault("held_out", False)
    return true, calibrate_robot(nominal, given, noise=SIGMA, **options)  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "poses", "positions"), COUNTS)
def test_poses_tell_four_numbers_a_turning_joint_two_a_sliding_one_and_six(
    name: str, poses: int, positions: int
) -> None:
    true, found = fitted(name, "pose")
    assert (found.identifiable, found.possible) == (poses, poses)
    assert found.fit.basis.condition < 100
    assert found.fit.dof == 6 * 50 - poses
    assert abs(found.fit.chi2_per_dof - 1.0) < 4.0 * found.chi2_spread
    q = random_q(true, 100, 9)
    off_by = table_tool_pose(found.robot, q)[:, :3, 3] - table_tool_pose(true, q)[:, :3, 3]
    rms = float(np.sqrt((off_by**2).sum(axis=1).mean()))
    assert 0.5 * found.predicted.length < rms < 2.0 * found.predicted.length < 1e-4
    _, found = fitted(name, "position")
    assert (found.identifiable, found.possible) == (positions, positions)
    assert {each.name for each in found.parameters if each.status is ParameterStatus.UNSEEN} == {
        "tool.rx",
        "tool.ry",
        "tool.rz",
    }


def test_distances_from_four_unknown_points_tell_the_arm_but_not_where_it_is() -> None:
    true, found = fitted("stanford", "distance", 120)
    assert found.identifiable == found.possible == 25 - 6
    assert abs(found.fit.chi2_per_dof - 1.0) < 4.0 * found.chi2_spread
    assert {each.status for each in found.parameters if each.group == "base"} == {ParameterStatus.HELD}
    q = random_q(true, 60, 9)
    shape = [table_tool_pose(spec, q)[:, :3, 3] for spec in (found.robot, true)]
    lengths = [np.linalg.norm(points[:, None] - points[None], axis=2) for points in shape]
    assert np.abs(lengths[0] - lengths[1]).max() < 6.0 * found.predicted.length


def test_what_folds_into_what_is_named() -> None:
    _, found = fitted("stanford", "pose")
    into = {each.name: each.into for each in found.parameters if each.status is ParameterStatus.FOLDED}
    assert into["joint_1.d"] == ("base.z",)
    assert "base.rz" in into["joint_1.theta"]
    assert into["joint_6.d"] == ("tool.z",)
    assert len(into) == 36 - 28 + 1  # the Hayati row of the sliding joint has one number more
    unchanged = [each for each in found.parameters if each.status is ParameterStatus.FOLDED]
    assert all(each.change == 0.0 and each.value == each.nominal for each in unchanged)


@pytest.mark.slow
def test_a_tracker_may_stand_anywhere_and_the_tool_be_any() -> None:
    nominal = robot("ur5e")
    true = off(nominal, 1e-3, 1)
    far = Pose(xyz=numbers(2.1, -3.3, 0.7), rpy=numbers(0.4, -1.2, 2.9))
    true = replace(
        true,
        base=replace(true.base, pose=far),
        tool=replace(true.tool, xyz=numbers(0.03, -0.08, 0.21), rpy=numbers(2.0, 0.5, -1.0)),
    )
    q = random_q(nominal, 40, 2)
    for kind in ("pose", "position"):
        found = calibrate_robot(nominal, measured(nominal, true, kind, q, seed=3), noise=SIGMA, held_out=False)
        assert abs(found.fit.chi2_per_dof - 1.0) < 4.0 * found.chi2_spread
        assert found.errors_before.length < 10e-3
        assert np.abs(table_tool_pose(found.robot, q)[:, :3, 3] - table_tool_pose(true, q)[:, :3, 3]).max() < 3e-4
        assert "base_link is the frame of the measurements now" in "".join(found.notes)


def test_several_stations_have_poses_of_their_own_and_base_link_stays() -> None:
    nominal = robot("scara")
    true = off(nominal, 1e-3, 1)
    q = random_q(nominal, 60, 2)
    given = measured(nominal, true, "pose", q, seed=3)
    seen = np.eye(4)
    seen[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    seen[:3, 3] = [1.5, -2.0, 0.3]
    T = np.tile(np.eye(4), (60, 1, 1))
    assert given.position is not None
    assert given.rotation is not None
    T[:, :3, :3], T[:, :3, 3] = given.rotation, given.position
    T[::2] = seen @ T[::2]
    stations = ["left" if k % 2 == 0 else "right" for k in range(60)]
    found = calibrate_robot(nominal, measurements(nominal, q, poses=T, stations=stations), noise=SIGMA)
    assert abs(found.fit.chi2_per_dof - 1.0) < 4.0 * found.chi2_spread
    assert found.identifiable == 20 - 6
    assert np.array_equal(found.robot.base.pose.xyz, nominal.base.pose.xyz)
    left, right = found.fit.state.stations
    assert np.abs(left @ np.linalg.inv(right) - seen).max() < 1e-4
    assert found.held_out is not None
    assert found.held_out.fitted is not None
    assert found.held_out.by == "station"
    assert [fold.groups for fold in found.held_out.folds] == [("left",), ("right",)]
    assert found.held_out.fitted.length < 2.5 * SIGMA


def sockets(count: int = 30, places: int = 3) -> tuple[RobotSpec, dict[str, list[object]], np.ndarray]:
    """Joint vectors of a planar-free arm with its ball in sockets 60 mm apart, found by Newton on the oracle."""
    nominal = robot("franka_panda")
    true = off(replace(nominal, tool=replace(nominal.tool, xyz=numbers(0.02, 0.05, 0.2))), 1e-3, 4)
    rng = np.random.default_rng(5)
    q0 = random_q(nominal, places, 6) * 0.6
    rows: list[np.ndarray] = []
    names: dict[str, list[object]] = {"sockets": [], "placements": []}
    for place, start in enumerate(q0):
        middle = table_tool_pose(true, start)[:3, 3]
        way = rng.normal(size=3)
        for socket, side in (("a", -0.03), ("b", 0.03)):
            point = middle + side * way / np.linalg.norm(way)
            q = start + 0.5 * rng.normal(size=(count, 7))
            for _ in range(12):
                steps = q[:, None] + 1e-6 * np.concatenate([np.eye(7), -np.eye(7), np.zeros((1, 7))])
                p = table_tool_pose(true, steps)[..., :3, 3]
                J = (p[:, :7] - p[:, 7:14]).transpose(0, 2, 1) / 2e-6
                q = q + np.einsum("nij,nj->ni", np.linalg.pinv(J, rcond=1e-3), point - p[:, 14])
            q = q[np.linalg.norm(table_tool_pose(true, q)[:, :3, 3] - point, axis=1) < 1e-9]
            rows += list(q)
            names["sockets"] += [socket] * len(q)
            names["placements"] += [f"place {place}"] * len(q)
    q = np.array(rows)
    q += 2e-5 * rng.normal(size=q.shape)
    return nominal, names, q


@pytest.mark.slow
def test_a_ball_in_sockets_tells_the_arm_once_a_distance_is_known() -> None:
    nominal, names, q = sockets(12, 4)
    given = measurements(nominal, q, distances=np.full(len(q), 0.06), **names)  # type: ignore[arg-type]
    found = calibrate_robot(nominal, given)
    assert found.identifiable == 34 - 6 - 3
    assert found.errors_before.length > 10 * found.errors.length
    assert found.held_out is not None
    assert found.held_out.by == "placement"
    assert len(found.held_out.folds) == 4
    assert found.held_out.fitted is not None
    assert found.held_out.nominal is not None
    assert found.held_out.fitted.length < 0.2 * found.held_out.nominal.length
    assert found.held_out.fitted.artefact < 2e-4
    unknown = calibrate_robot(nominal, measurements(nominal, q, **names), held_out=False)  # type: ignore[arg-type]
    assert unknown.identifiable == 34 - 6 - 3 - 1
    held = [each for each in unknown.parameters if "scale" in each.reason]
    assert [each.name for each in held] == ["joint_5.d"]  # the longest


def test_outliers_are_named_and_left_out() -> None:
    nominal = robot("stanford")
    true = off(nominal, 1e-3, 1)
    q = random_q(nominal, 60, 2)
    given = measured(nominal, true, "position", q, seed=3)
    assert given.position is not None
    position = given.position.copy()
    position[[7, 23]] += [0.004, -0.002, 0.001]
    given = replace(given, position=position)
    plain = calibrate_robot(nominal, given, held_out=False)
    assert {outlier.row for outlier in plain.outliers} >= {7, 23}
    assert not any(outlier.left_out for outlier in plain.outliers)
    robust = calibrate_robot(nominal, given, robust=True, noise=SIGMA, held_out=False)
    assert {outlier.row for outlier in robust.outliers if outlier.left_out} == {7, 23}
    assert robust.fit.dof == 3 * 58 - 25
    assert abs(robust.fit.chi2_per_dof - 1.0) < 4.0 * robust.chi2_spread
    off_by = table_tool_pose(robust.robot, q)[:, :3, 3] - table_tool_pose(true, q)[:, :3, 3]
    assert np.abs(off_by).max() < 2e-4


def test_a_prior_keeps_what_measurements_do_not_tell() -> None:
    _, found = fitted("puma560", "pose", 8, prior={"length": 1e-3, "angle": 1e-3})
    assert found.identifiable == 30
    changed = [
        each for each in found.parameters if each.status is ParameterStatus.FITTED and each.nominal is not None
    ]
    assert all(abs(each.change) < 5e-3 for each in changed)
    assert all(each.sigma is not None and each.sigma < 1.0001e-3 for each in changed)


def test_only_what_is_asked_for_changes() -> None:
    _, found = fitted("ur5e", "pose", unknown=["theta", "tool", "elbow.a"])
    changed = {each.name for each in found.parameters if each.change != 0.0}
    assert changed <= {f"{row.name}.theta" for row in found.robot.rows} | {"elbow.a"} | {
        f"tool.{part}" for part in ("x", "y", "z", "rx", "ry", "rz")
    }
    assert "unknown parameter 'thta'. Did you mean 'theta'?" in refusal(
        CalibrationError, fitted, "ur5e", "pose", unknown=["thta"]
    )


def test_too_few_measurements_are_refused_in_words() -> None:
    text = refusal(CalibrationError, fitted, "puma560", "pose", 4)
    assert text.startswith("4 poses cannot fix 30 parameters of the robot: they are only 24 equations.")
    nominal = robot("puma560")
    q = random_q(nominal, 40, 2)
    q[:, 3] = 0.3
    given = measured(nominal, off(nominal, 1e-3, 1), "pose", q, seed=3)
    text = refusal(CalibrationError, calibrate_robot, nominal, given)
    assert "40 poses cannot fix 30 parameters of the robot: they determine only" in text
    assert "joint_4 does not move." in text
    text = refusal(CalibrationError, calibrate_robot, nominal, given.rows([0] * 40))
    assert "them, not joint_1.a, joint_1.alpha, joint_2.theta, joint_2.a, joint_2.alpha, joint_2.beta and " in text
    assert " others. No joint moves." in text
    narrow = random_q(nominal, 40, 2) * 1e-3
    given = measured(nominal, off(nominal, 1e-3, 1), "position", narrow, seed=3)
    assert "the tool would be known to" in refusal(CalibrationError, calibrate_robot, nominal, given, noise=SIGMA)


def test_positions_in_another_unit_are_refused() -> None:
    nominal = robot("scara")
    given = measured(nominal, off(nominal, 1e-3, 1), "position", random_q(nominal, 40, 2), seed=3)
    assert given.position is not None
    for factor, said in ((1e3, "mm taken for m"), (0.0254, "m taken for inches")):
        text = refusal(CalibrationError, calibrate_robot, nominal, replace(given, position=factor * given.position))
        assert text.startswith("40 positions: positions are spread over ")
        assert text.endswith(f", where the table says 0.354 m: they look like {said}")


def test_positions_whose_columns_are_exchanged_are_refused() -> None:
    nominal = robot("stanford")
    given = measured(nominal, off(nominal, 1e-3, 1), "position", random_q(nominal, 24, 2), seed=3)
    assert given.position is not None
    swapped = replace(given, position=given.position[:, [1, 0, 2]], station=("tracker",) * 24)
    text = refusal(CalibrationError, calibrate_robot, nominal, swapped, held_out=False)
    assert "a component, of an arm that gets around by 954 mm: columns or rows are exchanged" in text


@pytest.mark.parametrize("kind", ["pose", "position"])
def test_a_head_whose_own_table_has_no_length_that_moves_is_fitted(kind: str) -> None:
    pan = replace(row("pan", alpha=math.pi / 2.0, d=0.12), limits=Limits(position=(-2.9, 2.9)))
    tilt = replace(row("tilt"), limits=Limits(position=(-1.4, 1.4)))
    head = RobotSpec(name="head", rows=(pan, tilt), tool=ToolSpec(xyz=np.array([0.25, 0.0, 0.05])))
    true = off(head, 2e-3, 1)
    found = calibrate_robot(head, measured(head, true, kind, random_q(head, 60, 2), seed=3), held_out=False)
    q = random_q(head, 50, 9)
    off_by = table_tool_pose(found.robot, q)[:, :3, 3] - table_tool_pose(true, q)[:, :3, 3]
    assert np.linalg.norm(off_by, axis=1).max() < 2.0 * SIGMA


def test_copied_rows_are_noted() -> None:
    nominal = robot("scara")
    given = measured(nominal, off(nominal, 1e-3, 1), "pose", random_q(nominal, 30, 2), seed=3)
    found = calibrate_robot(nominal, given.rows([*range(30), 3, 7]), held_out=False)
    assert any(note.startswith("2 rows are exact copies of another:") for note in found.notes)


@pytest.mark.parametrize(("name", "size", "seed"), [("puma560", 0.0, 1), ("scara", 5e-5, 1), ("ur5e", 5e-5, 7)])
def test_a_tool_that_only_noise_moves_off_the_last_axis_is_fitted(name: str, size: float, seed: int) -> None:
    nominal = robot(name)
    true = off(nominal, size, seed)
    given = measured(nominal, true, "position", random_q(nominal, 60, 2), seed=3)
    found = calibrate_robot(nominal, given, noise=SIGMA, held_out=False)
    assert found.identifiable <= found.possible < {robot: count for robot, _, count in COUNTS}[name]
    off_by = [
        np.linalg.norm((table_tool_pose(found.robot, q) - table_tool_pose(true, q))[:3, 3])
        for q in random_q(nominal, 50, 4)
    ]
    assert np.sqrt(np.mean(np.square(off_by))) < SIGMA


def test_odd_robots_of_mixed_conventions_with_fixed_and_flipped_rows_are_fitted() -> None:
    true = off(ODD_ROBOT, 1e-3, 1)
    q = random_q(ODD_ROBOT, 80, 2)
    found = calibrate_robot(ODD_ROBOT, measured(ODD_ROBOT, true, "pose", q, seed=3), noise=SIGMA, held_out=False)
    turning = sum(row.type.turns for row in ODD_ROBOT.rows)
    sliding = sum(row.type.moves and not row.type.turns for row in ODD_ROBOT.rows)
    assert found.identifiable == 4 * turning + 2 * sliding + 6
    assert abs(found.fit.chi2_per_dof - 1.0) < 4.0 * found.chi2_spread


def test_estimated_noise_is_the_noise() -> None:
    nominal = robot("stanford")
    given = measured(nominal, off(nominal, 1e-3, 1), "pose", random_q(nominal, 80, 2), seed=3)
    found = calibrate_robot(nominal, given, held_out=False)
    assert math.isclose(found.fit.sigma.length, SIGMA, rel_tol=0.15)
    assert math.isclose(found.fit.sigma.angle, SIGMA, rel_tol=0.15)


@pytest.mark.parametrize("sigma", [(0.0, 0.0), (1e-4, 0.0), (0.0, 1e-4)], ids=["all", "rotations", "positions"])
def test_exact_data_are_fitted(sigma: tuple[float, float]) -> None:
    nominal = robot("scara")
    true, q = off(nominal, 1e-3, 1), random_q(nominal, 40, 2)
    rng = np.random.default_rng(3)
    poses = table_tool_pose(true, q).copy()
    poses[:, :3, 3] += sigma[0] * rng.normal(size=(40, 3))
    poses[:, :3, :3] = turned(sigma[1] * rng.normal(size=(40, 3))) @ poses[:, :3, :3]
    found = calibrate_robot(nominal, measurements(nominal, q, poses=poses), held_out=False)
    unseen = random_q(nominal, 50, 4)
    error = np.abs(table_tool_pose(found.robot, unseen) - table_tool_pose(true, unseen)).max()
    assert error < (1e-8 if sigma == (0.0, 0.0) else 4e-4)
