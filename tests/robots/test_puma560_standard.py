"""The PUMA 560 in both conventions is one arm.

With the constants of the two files, the products of the rows are

    standard: Rz(q1) Rx(+90) Rz(q2) Tx(a2) Rz(q3) Tz(d3) Tx(a3) Rx(-90) Rz(q4) Tz(d4) …
    modified: Rz(q1) Rx(-90) Rz(q2) Tx(a2) Rz(q3) Tz(d3) Tx(a3) Rx(-90) Rz(q4) Tz(d4) …

and both go on with Rx(90) Rz(q5) Rx(-90) Rz(q6). They differ in the sign of one quarter turn. Half a turn
about z on either side of it changes that sign, Rz(180) Rx(-90) Rz(180) = Rx(90), because half a turn about z
reverses x. So

    T_standard(q1, q2, q3, …) = Rz(180) T_modified(q1, q2 + 180, q3, …)

with nothing at the tool and no other offset: the base turned by half a turn about z, and joint 2 counted from
the other side. As Rz(180) and Rz(q1) turn about one axis, half a turn more at joint 1 does the same as at the
base.
"""

from __future__ import annotations

import math

import numpy as np

from dh2sim import build_chain, forward_kinematics, frame_poses
from dh2sim.typing import Array
from tests.sample_robots import robot

from .closed_forms import puma560
from .samples import limits, random_configurations

RZ_180 = np.diag([-1.0, -1.0, 1.0, 1.0])
"""T_base-standard_base-modified."""

JOINT_OFFSETS = np.array([0, math.pi, 0, 0, 0, 0])
"""What a joint vector of the standard file lacks to be one of the modified file, rad."""


def by_the_closed_form(q_modified: Array) -> Array:
    lengths = robot("puma560").parameters
    return puma560(*q_modified.T, a2=lengths["a2"], a3=lengths["a3"], d3=lengths["d3"], d4=lengths["d4"])


def test_standard_table_is_the_modified_closed_form_on_a_turned_base() -> None:
    spec = robot("puma560_standard")
    q = random_configurations(spec, seed=11)
    actual = forward_kinematics(build_chain(spec), q)
    np.testing.assert_allclose(actual, RZ_180 @ by_the_closed_form(q + JOINT_OFFSETS), rtol=0, atol=1e-12)


def test_half_a_turn_at_joint_1_does_the_same_as_the_turned_base() -> None:
    spec = robot("puma560_standard")
    q = random_configurations(spec, seed=12)
    actual = forward_kinematics(build_chain(spec), q)
    offsets = JOINT_OFFSETS + np.array([math.pi, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(actual, by_the_closed_form(q + offsets), rtol=0, atol=1e-12)


def test_wrist_frames_of_both_tables_are_the_same_frames() -> None:
    """From frame 4 on the origins coincide (the wrist's centre), and z_i stands where z_(i+1) does."""
    q = random_configurations(robot("puma560_standard"), seed=13)
    standard = frame_poses(build_chain(robot("puma560_standard")), q)
    modified = RZ_180 @ frame_poses(build_chain(robot("puma560")), q + JOINT_OFFSETS)
    np.testing.assert_allclose(standard[:, 4:, :3, 3], modified[:, 4:, :3, 3], rtol=0, atol=1e-12)
    np.testing.assert_allclose(standard[:, 3:6, :3, 2], modified[:, 4:7, :3, 2], rtol=0, atol=1e-12)


def test_both_files_have_the_same_parameters() -> None:
    assert dict(robot("puma560_standard").parameters) == dict(robot("puma560").parameters)


def test_both_files_have_the_same_limits_up_to_the_offset_and_whole_turns() -> None:
    turns = (limits(robot("puma560_standard")) + JOINT_OFFSETS - limits(robot("puma560"))) / math.tau
    np.testing.assert_allclose(turns, np.array([[0, 1, 0, 0, 0, 0]] * 2), rtol=0, atol=1e-12)


def test_both_files_have_the_same_tool_pose_at_home() -> None:
    poses = [
        forward_kinematics(build_chain(spec), spec.configurations["home"])
        for spec in (robot("puma560"), robot("puma560_standard"))
    ]
    np.testing.assert_allclose(poses[0], poses[1], rtol=0, atol=1e-12)
