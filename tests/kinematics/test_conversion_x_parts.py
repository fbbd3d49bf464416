from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given

from dh2sim.kinematics.conversion import XPart, as_pose, before, behind, inverse, merged, x_part_of
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.robot.links import Pose
from dh2sim.typing import Array, read_only
from tests.sample_robots import ODD
from tests.strategies import angles, lengths, poses


def matrix(pose: Pose) -> Array:
    return pose_from_rpy(pose.xyz, pose.rpy)


def lead(a: float, alpha: float) -> Array:
    """Tx(a) Rx(alpha), by hand."""
    c, s = math.cos(alpha), math.sin(alpha)
    return np.array([[1, 0, 0, a], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])


@given(lengths, angles, lengths, angles)
def test_merging_is_multiplying(a: float, alpha: float, a2: float, alpha2: float) -> None:
    both = merged(XPart(a=a, alpha=alpha), XPart(a=a2, alpha=alpha2))
    np.testing.assert_allclose(both.transform, lead(a, alpha) @ lead(a2, alpha2), rtol=0, atol=1e-15)


@given(lengths, angles)
def test_a_part_and_its_inverse_cancel_to_the_last_bit(a: float, alpha: float) -> None:
    part = XPart(a=a, alpha=alpha)
    assert merged(part, inverse(part)) == merged(inverse(part), part) == XPart()
    assert merged(part, inverse(part)).is_identity


@given(poses, lengths, angles)
def test_a_part_leads_to_a_pose_or_away_from_it(pose: Pose, a: float, alpha: float) -> None:
    part, T, X = XPart(a=a, alpha=alpha), matrix(pose), lead(a, alpha)
    np.testing.assert_allclose(matrix(before(part, pose)), X @ T, rtol=0, atol=2e-15)
    np.testing.assert_allclose(matrix(behind(pose, part)), T @ X, rtol=0, atol=2e-15)


@pytest.mark.parametrize(
    ("first", "second", "total"),
    [
        (math.pi / 2, math.pi / 2, math.pi),
        (-math.pi / 2, -math.pi / 2, math.pi),
        (math.pi, math.pi, 0.0),
        (math.pi, math.pi / 2, -math.pi / 2),
        (-math.pi, math.pi / 2, -math.pi / 2),
        (3 * math.pi / 2, 3 * math.pi / 2, math.pi),
        (math.radians(170), math.radians(40), math.radians(-150)),
        (7.0, -6.5, 0.5),
        (ODD, 1e-9, ODD + 1e-9),
    ],
)
def test_a_sum_of_angles_is_between_minus_and_plus_pi(first: float, second: float, total: float) -> None:
    for x, y in ((first, second), (second, first)):
        alpha = merged(XPart(alpha=x), XPart(alpha=y)).alpha
        assert -math.pi < alpha <= math.pi
        assert alpha == pytest.approx(total, abs=1e-15)


@pytest.mark.parametrize("alpha", [0.1, -math.pi, 3 * math.pi / 2, 1000.0, 5e-324])
def test_an_angle_that_meets_none_is_handed_on_as_it_is(alpha: float) -> None:
    part = XPart(a=0.1, alpha=alpha)
    assert merged(part, XPart(a=0.2)) == merged(XPart(a=0.2), part) == XPart(a=0.1 + 0.2, alpha=alpha)


@pytest.mark.parametrize("part", [XPart(), XPart(a=0.3), XPart(alpha=ODD), XPart(a=-0.1, alpha=-4.0)])
def test_a_pure_part_is_known_by_its_pose(part: XPart) -> None:
    assert x_part_of(as_pose(part)) == part


@pytest.mark.parametrize(
    "pose",
    [
        Pose(xyz=read_only([0, 0.1, 0])),
        Pose(xyz=read_only([0, 0, 1e-9])),
        Pose(rpy=read_only([0, 1e-9, 0])),
        Pose(rpy=read_only([0, 0, math.pi])),
    ],
)
def test_any_other_pose_is_no_pure_part(pose: Pose) -> None:
    assert x_part_of(pose) is None


def test_what_leads_nowhere_leaves_a_pose_as_it_is() -> None:
    pose = Pose(xyz=read_only([0.1, 0.2, 0.3]), rpy=read_only([4.0, 5.0, 6.0]))
    assert before(XPart(), pose) is pose
    assert behind(pose, XPart()) is pose


def test_poses_that_are_made_are_read_only() -> None:
    general = Pose(xyz=read_only([0.1, 0.2, 0.3]))
    for pose in (as_pose(XPart(a=1.0)), before(XPart(a=1.0), general), behind(general, XPart(alpha=1.0))):
        assert not pose.xyz.flags.writeable
        assert not pose.rpy.flags.writeable
