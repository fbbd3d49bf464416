from __future__ import annotations

import ast
import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics import table_oracle as table
from dh2sim.kinematics.table_oracle import row_matrix, table_frame_poses, table_tool_errors, table_tool_pose
from dh2sim.kinematics.transforms import pose_errors
from dh2sim.robot.links import Pose, ToolSpec
from dh2sim.robot.row import Convention, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.sample_robots import HAYATI, MODIFIED, ODD, ODD_ROBOT, REVOLUTE, STANDARD, STANFORD, row
from tests.strategies import robots_with_joint_vectors

BETA = math.radians(123.4)
# cos and sin of 37.3 degrees, of 20 degrees and of 123.4 degrees, from tables
CA, SA = 0.7954734808548959, 0.605988400265711
CT, ST = 0.9396926207859084, 0.3420201433256687
CB, SB = -0.5504807400849956, 0.8348478632634065


def test_standard_row_is_the_hand_expanded_product() -> None:
    one = row("one", a=0.3, alpha=ODD, d=0.5, theta=math.radians(5.0))
    expected: list[list[float]] = [
        [CT, -ST * CA, ST * SA, 0.3 * CT],
        [ST, CT * CA, -CT * SA, 0.3 * ST],
        [0, SA, CA, 0.5],
        [0, 0, 0, 1],
    ]
    found = row_matrix(one, np.array([math.radians(15.0)]))
    np.testing.assert_allclose(found[:, :, 0], expected, rtol=0, atol=1e-15)


def test_modified_row_is_the_hand_expanded_product() -> None:
    one = row("one", "revolute", MODIFIED, a=0.3, alpha=ODD, d=0.5, theta=math.radians(5.0))
    expected: list[list[float]] = [
        [CT, -ST, 0, 0.3],
        [ST * CA, CT * CA, -SA, -SA * 0.5],
        [ST * SA, CT * SA, CA, CA * 0.5],
        [0, 0, 0, 1],
    ]
    found = row_matrix(one, np.array([math.radians(15.0)]))
    np.testing.assert_allclose(found[:, :, 0], expected, rtol=0, atol=1e-15)


def test_hayati_row_is_the_hand_expanded_product() -> None:
    one = row("one", "prismatic", HAYATI, a=0.3, alpha=ODD, d=0.2, theta=math.radians(20.0), beta=BETA)
    expected: list[list[float]] = [
        [CT * CB - ST * SA * SB, -ST * CA, CT * SB + ST * SA * CB, 0.3 * CT],
        [ST * CB + CT * SA * SB, CT * CA, ST * SB - CT * SA * CB, 0.3 * ST],
        [-CA * SB, SA, CA * CB, 0.5],
        [0, 0, 0, 1],
    ]
    found = row_matrix(one, np.array([0.3]))
    np.testing.assert_allclose(found[:, :, 0], expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize("joint_type", ["revolute", "continuous", "prismatic", "fixed"])
@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("convention", list(Convention))
def test_row_is_the_product_of_its_moves(joint_type: str, flip: bool, convention: Convention) -> None:
    q = 0.7
    one = row("one", joint_type, convention, a=0.3, alpha=ODD, d=0.5, theta=-1.1, beta=BETA, flip=flip)
    moved = -q if flip else q
    theta = -1.1 + (moved if joint_type in ("revolute", "continuous") else 0.0)
    d = 0.5 + (moved if joint_type == "prismatic" else 0.0)
    Rz, Tz, Tx, Rx, Ry = np.eye(4), np.eye(4), np.eye(4), np.eye(4), np.eye(4)
    Rz[:2, :2] = [[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]]
    Rx[1:3, 1:3] = [[math.cos(ODD), -math.sin(ODD)], [math.sin(ODD), math.cos(ODD)]]
    Ry[0, [0, 2]], Ry[2, [0, 2]] = [math.cos(BETA), math.sin(BETA)], [-math.sin(BETA), math.cos(BETA)]
    Tz[2, 3], Tx[0, 3] = d, 0.3
    expected = {
        STANDARD: Rz @ Tz @ Tx @ Rx,
        MODIFIED: Tx @ Rx @ Rz @ Tz,
        HAYATI: Rz @ Tz @ Tx @ Rx @ Ry,
    }[convention]
    np.testing.assert_allclose(row_matrix(one, np.array([q]))[:, :, 0], expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize("q", [(0.3, 0.4), (-2.0, 1.1), (3.0, -2.9)])
def test_planar_arm_reaches_where_trigonometry_says(q: tuple[float, float]) -> None:
    l1, l2, (q1, q2) = 0.7, 0.4, q
    x, y = l1 * math.cos(q1) + l2 * math.cos(q1 + q2), l1 * math.sin(q1) + l2 * math.sin(q1 + q2)
    standard = RobotSpec(name="planar", rows=(row("one", a=l1), row("two", a=l2)))
    modified = RobotSpec(
        name="planar",
        rows=(row("one", "revolute", MODIFIED), row("two", "revolute", MODIFIED, a=l1)),
        tool=ToolSpec(xyz=read_only([l2, 0, 0])),
    )
    for spec in (standard, modified):
        T = table_tool_pose(spec, q)
        np.testing.assert_allclose(T[:3, 3], [x, y, 0], rtol=0, atol=1e-15)
        np.testing.assert_allclose(T[:2, 0], [math.cos(q1 + q2), math.sin(q1 + q2)], rtol=0, atol=1e-15)


def test_stanford_arm_is_where_its_closed_form_says() -> None:
    t1, t2, d3, t4, t5, t6 = 0.4, -0.9, 0.35, 1.2, 0.8, -2.0
    c1, s1, c2, s2, c4, s4 = (f(t) for t in (t1, t2, t4) for f in (math.cos, math.sin))
    c5, s5, c6, s6 = (f(t) for t in (t5, t6) for f in (math.cos, math.sin))
    d1, d2, d6 = 0.4, 0.15, 0.3
    z_wrist = np.array([c4 * s5, s4 * s5, c5])  # approach vector in frame 3
    R_0_3 = np.array([[c1 * c2, -s1, c1 * s2], [s1 * c2, c1, s1 * s2], [-s2, 0, c2]])
    position = [0, 0, d1] + d2 * np.array([-s1, c1, 0]) + R_0_3 @ ([0, 0, d3] + d6 * z_wrist)
    x_wrist = np.array([c4 * c5 * c6 - s4 * s6, s4 * c5 * c6 + c4 * s6, -s5 * c6])
    T = table_tool_pose(STANFORD, [t1, t2, d3, t4, t5, t6])
    np.testing.assert_allclose(T[:3, 3], position, rtol=0, atol=1e-15)
    np.testing.assert_allclose(T[:3, 2], R_0_3 @ z_wrist, rtol=0, atol=1e-15)
    np.testing.assert_allclose(T[:3, 0], R_0_3 @ x_wrist, rtol=0, atol=1e-15)


def test_base_and_tool_poses_stand_at_the_ends() -> None:
    q = [0.1, 0.2, 0.3, 0.4, 0.5]
    bare = RobotSpec(name="bare", rows=ODD_ROBOT.rows)
    poses = table_frame_poses(ODD_ROBOT, q)
    np.testing.assert_allclose(poses, poses[0] @ table_frame_poses(bare, q), rtol=0, atol=1e-15)
    np.testing.assert_array_equal(poses[0, :3, 3], ODD_ROBOT.base.pose.xyz)
    T_dhn_tool0 = np.linalg.inv(poses[-1]) @ table_tool_pose(ODD_ROBOT, q)
    np.testing.assert_allclose(T_dhn_tool0[:3, 3], ODD_ROBOT.tool.xyz, rtol=0, atol=1e-15)


@pytest.mark.parametrize("batch", [(), (0,), (1,), (2, 3), (5000,)])
def test_table_poses_take_any_batch_shape(batch: tuple[int, ...]) -> None:
    q = np.random.default_rng(0).uniform(-1, 1, (*batch, 5))
    poses = table_frame_poses(ODD_ROBOT, q)
    assert poses.shape == (*batch, 7, 4, 4)
    assert table_tool_pose(ODD_ROBOT, q).shape == (*batch, 4, 4)
    for index in list(np.ndindex(batch))[-3:]:
        np.testing.assert_allclose(poses[index], table_frame_poses(ODD_ROBOT, q[index]), rtol=0, atol=1e-15)


@pytest.mark.parametrize("q", [0.3, [0.1, 0.2], np.zeros((2, 6))])
def test_table_poses_refuse_a_wrong_shape(q: object) -> None:
    with pytest.raises(ConfigurationError) as caught:
        table_frame_poses(ODD_ROBOT, np.asarray(q))
    assert str(caught.value) == f"expected an array of shape (..., 5), got shape {np.shape(np.asarray(q))}"


def test_the_oracle_imports_nothing_of_what_it_judges() -> None:
    tree = ast.parse(Path(table.__file__).read_text(encoding="utf-8"))
    imported = {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    imported |= {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    ours = {name for name in imported if name.startswith("dh2sim")}
    assert ours == {"dh2sim.errors", "dh2sim.robot.links", "dh2sim.robot.row", "dh2sim.robot.spec", "dh2sim.typing"}


@given(robot=robots_with_joint_vectors(max_rows=6))
def test_errors_in_exact_arithmetic_are_those_of_doubles(robot: tuple[RobotSpec, Array]) -> None:
    spec, q = robot
    longer = dataclasses.replace(
        spec, tool=ToolSpec(xyz=spec.tool.xyz + np.array([0, 0.03, 0.04]), rpy=spec.tool.rpy)
    )
    position, rotation = table_tool_errors(longer, spec, q)
    assert position == pytest.approx(0.05, rel=1e-12)
    assert rotation == 0.0
    turned = dataclasses.replace(spec, base=dataclasses.replace(spec.base, pose=Pose(rpy=read_only([0.0, 0.0, 0.3]))))
    expected = pose_errors(table_tool_pose(turned, q), table_tool_pose(spec, q))
    found = table_tool_errors(turned, spec, q)
    assert found[0] == pytest.approx(expected[0].max(), abs=1e-12)
    assert found[1] == pytest.approx(2.0 * np.sin(0.5 * expected[1].max()), abs=1e-12)


def test_errors_in_exact_arithmetic_do_not_drown_in_far_rows() -> None:
    rows = (Row(type=REVOLUTE, d=4e5, a=0.4), Row(type=REVOLUTE, d=-4e5, alpha=0.3), Row(type=REVOLUTE, a=0.2))
    far = RobotSpec(name="far", rows=rows)
    moved = dataclasses.replace(far, rows=(dataclasses.replace(far.rows[0], a=0.4 + 1e-15), *far.rows[1:]))
    assert table_tool_errors(moved, far, [[0.1, 0.2, 0.3]])[0] == pytest.approx(1e-15, rel=0.2)
