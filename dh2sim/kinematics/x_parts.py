"""Link parts X = Tx(a) Rx(alpha) as numbers: two that meet add up, and nothing is rounded that need not be."""

from __future__ import annotations

import math
from dataclasses import dataclass

from dh2sim.kinematics.transforms import compose, link_part, pose_from_rpy, rpy_from_rotation
from dh2sim.kinematics.trig import atan2, sin_cos
from dh2sim.robot.spec import Pose
from dh2sim.typing import Array, read_only


@dataclass(frozen=True, slots=True, kw_only=True)
class XPart:
    """X = Tx(a) Rx(alpha): a shift along x and a turn about it, in either order."""

    a: float = 0.0
    """m."""
    alpha: float = 0.0
    """rad."""

    @property
    def is_identity(self) -> bool:
        """Whether it leads nowhere."""
        return self.a == 0.0 and self.alpha == 0.0

    @property
    def transform(self) -> Array:
        """As a pose, shape (4, 4)."""
        return link_part(self.a, self.alpha)


def merged(first: XPart, second: XPart) -> XPart:
    """Return the product of two: a and alpha add.

    A sum of two angles is brought to (-pi, pi]; a number that meets a zero is handed on as it is.
    """
    if first.alpha == 0.0 or second.alpha == 0.0:
        alpha = first.alpha or second.alpha
    else:
        alpha = _wrapped(_wrapped(first.alpha) + _wrapped(second.alpha))
    return XPart(a=first.a + second.a, alpha=alpha)


def inverse(part: XPart) -> XPart:
    """Return the link part that leads back."""
    return XPart(a=0.0 - part.a, alpha=0.0 - part.alpha)


def x_part_of(pose: Pose) -> XPart | None:
    """Return a pose that is written as a pure Tx(a) Rx(alpha) as such, or None."""
    (x, y, z), (roll, pitch, yaw) = pose.xyz.tolist(), pose.rpy.tolist()
    return XPart(a=x, alpha=roll) if y == z == pitch == yaw == 0.0 else None


def as_pose(part: XPart) -> Pose:
    """Return a link part as a pose."""
    return Pose(xyz=read_only([part.a, 0.0, 0.0]), rpy=read_only([part.alpha, 0.0, 0.0]))


def before(part: XPart, pose: Pose) -> Pose:
    """Return X · T, the pose of a frame seen from where X begins."""
    return _product(part, pose, pose_first=False)


def behind(pose: Pose, part: XPart) -> Pose:
    """Return T · X, the pose of where X ends."""
    return _product(part, pose, pose_first=True)


def _product(part: XPart, pose: Pose, *, pose_first: bool) -> Pose:
    if part.is_identity:
        return pose
    if (other := x_part_of(pose)) is not None:
        return as_pose(merged(other, part))
    T = pose_from_rpy(pose.xyz, pose.rpy)
    product = compose(T, part.transform) if pose_first else compose(part.transform, T)
    return Pose(xyz=read_only(product[:3, 3]), rpy=rpy_from_rotation(product))


def _wrapped(angle: float) -> float:
    """The angle in (-pi, pi], rad; one that is in it already stays as it is."""
    if -math.pi < angle <= math.pi:
        return angle
    return atan2(*sin_cos(angle))
