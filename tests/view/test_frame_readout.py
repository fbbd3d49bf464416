"""The readout of a pose and a Jacobian, against the table and its differences."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.read import load_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from dh2sim.view.events import ChooseFrame, ChooseReference, RandomConfiguration, SelectRow, SetJoints
from dh2sim.view.frame_readout import readout_of
from dh2sim.view.initial_state import open_state
from dh2sim.view.panel.pose import frame_title, jacobian_markup
from dh2sim.view.panel.table import row_matrix
from dh2sim.view.reduce import reduce


def jacobian_by_differences(spec: RobotSpec, q: tuple[float, ...], step: float = 1e-5) -> Array:
    """The geometric Jacobian of tool0 in base_link, shape (6, n), out of the table alone."""
    columns = []
    here = table_tool_pose(spec, q)
    for k in range(len(q)):
        ahead, behind = (
            table_tool_pose(spec, [value + sign * step * (i == k) for i, value in enumerate(q)]) for sign in (1, -1)
        )
        velocity = (ahead[:3, 3] - behind[:3, 3]) / (2.0 * step)
        spin = (ahead[:3, :3] - behind[:3, :3]) @ here[:3, :3].T / (2.0 * step)
        columns.append([*velocity, spin[2, 1], spin[0, 2], spin[1, 0]])
    return np.array(columns).T


@pytest.mark.parametrize("robot", builtin_robots())
def test_manipulability_and_distance_to_singularity_are_those_of_the_table(robot: str) -> None:
    spec = load_robot(robot)
    state = reduce(open_state(spec), RandomConfiguration(seed=3))
    readout, J = readout_of(state), jacobian_by_differences(spec, state.q)
    gram = J @ J.T if J.shape[1] >= 6 else J.T @ J
    size = max(1.0, state.model.reach) ** 3
    assert readout.manipulability == pytest.approx(math.sqrt(max(np.linalg.det(gram), 0.0)), abs=1e-6 * size)
    least = math.sqrt(max(float(np.linalg.eigvalsh(gram)[0]), 0.0))
    assert readout.smallest_singular_value == pytest.approx(least, abs=1e-5 * size)


def test_the_distance_to_singularity_is_zero_with_a_stretched_wrist() -> None:
    spec = load_robot("stanford")
    bent = readout_of(reduce(open_state(spec), SetJoints(q=(0.3, 0.5, 0.4, 0.2, 0.9, 0.1))))
    stretched = readout_of(reduce(open_state(spec), SetJoints(q=(0.3, 0.5, 0.4, 0.2, 0.0, 0.1))))
    assert bent.smallest_singular_value > 0.01
    assert bent.manipulability > 0.01
    assert stretched.smallest_singular_value < 1e-12
    assert stretched.manipulability < 1e-12


@pytest.mark.parametrize("frame", ["dh_0", "dh_3", "tool0"])
def test_a_pose_is_given_in_three_notations_that_agree_with_the_table(frame: str) -> None:
    spec = load_robot("stanford")
    state = reduce(reduce(open_state(spec), RandomConfiguration(seed=5)), ChooseFrame(name=frame))
    frames = table_frame_poses(spec, state.q)
    expected = table_tool_pose(spec, state.q) if frame == "tool0" else frames[int(frame.removeprefix("dh_"))]
    readout = readout_of(state)
    assert np.allclose(readout.T_reference_frame, expected, rtol=0, atol=1e-12)
    assert np.allclose(readout.xyz, expected[:3, 3], rtol=0, atol=1e-12)
    # rpy: about the fixed axes x, y and z in turn, as URDF has it; quaternion: the scalar first
    turns = [turn_about(axis, angle) for axis, angle in enumerate(readout.rpy)]
    assert np.allclose(turns[2] @ turns[1] @ turns[0], expected[:3, :3], rtol=0, atol=1e-12)
    w, *vector = readout.quaternion
    v, cross = np.array(vector), np.cross(np.eye(3), vector)
    assert np.allclose((w * w - v @ v) * np.eye(3) + 2.0 * np.outer(v, v) + 2.0 * w * cross, expected[:3, :3])


@pytest.mark.parametrize(
    ("reference", "frame"), [("dh_2", "dh_3"), ("tool0", "dh_1"), ("dh_4", "dh_4"), ("dh_0", "tool0")]
)
@pytest.mark.parametrize("robot", ["stanford", "puma560"])
def test_a_pose_in_another_frame_is_the_product_of_the_rows_between(robot: str, reference: str, frame: str) -> None:
    spec = load_robot(robot)
    state = reduce(open_state(spec), RandomConfiguration(seed=5))
    state = reduce(reduce(state, ChooseFrame(name=frame)), ChooseReference(name=reference))
    poses = {f"dh_{i}": T for i, T in enumerate(table_frame_poses(spec, state.q))}
    poses["tool0"] = table_tool_pose(spec, state.q)
    expected = np.linalg.solve(poses[reference], poses[frame])
    assert np.allclose(readout_of(state).T_reference_frame, expected, rtol=0, atol=1e-12)
    assert frame_title(state) == f"<b>{frame}</b> in {reference}"
    assert reduce(state, ChooseReference(name="dh_99")) == state


@pytest.mark.parametrize("robot", ["stanford", "puma560"])
def test_the_matrix_of_each_row_is_printed_and_their_product_is_the_pose(robot: str) -> None:
    spec = load_robot(robot)
    state = reduce(open_state(spec), RandomConfiguration(seed=8))
    product = table_frame_poses(spec, state.q)[0]
    for row in range(len(spec.rows)):
        html = row_matrix(reduce(state, SelectRow(row=row)))
        product = product @ np.array(re.findall(r">([-+]\d+\.\d+)<", html), dtype=np.float64).reshape(4, 4)
        assert f"<b>dh_{row + 1}</b> in dh_{row}" in html
    assert np.allclose(product, table_frame_poses(spec, state.q)[-1], rtol=0, atol=1e-5)


def test_the_jacobian_is_printed_with_the_half_axes_of_its_ellipsoid() -> None:
    spec = load_robot("stanford")
    state = reduce(open_state(spec), RandomConfiguration(seed=8))
    html, J = jacobian_markup(readout_of(state)), jacobian_by_differences(spec, state.q)
    printed = np.array(re.findall(r">([-+]\d+\.\d+)<", html), dtype=np.float64).reshape(6, 6)
    assert np.allclose(printed, J, rtol=0, atol=6e-4)
    halves = np.sqrt(np.linalg.eigvalsh(J[:3] @ J[:3].T))[::-1]
    assert " ".join(f"{half:.4g}" for half in halves) in html
    assert "-0.000" not in jacobian_markup(readout_of(open_state(spec)))


def turn_about(axis: int, angle: float) -> Array:
    """The rotation about x, y or z."""
    T, i, j = np.eye(3), (axis + 1) % 3, (axis + 2) % 3
    T[i, i] = T[j, j] = math.cos(angle)
    T[j, i] = math.sin(angle)
    T[i, j] = -T[j, i]
    return T
