"""The configurations that have a name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only


def named_configurations(spec: RobotSpec) -> Mapping[str, Array]:
    """Return home and zero, which every robot has, and those of the robot file.

    Where the file has no ``home``, it is zero moved inside the limits.

    Returns:
        Joint vectors, rad and m, each of shape (n,).
    """
    limits = [row.limits.position or (0.0, 0.0) for row in spec.moving_rows]
    home = read_only([min(max(0.0, lower), upper) for lower, upper in limits])
    return MappingProxyType({"home": home, "zero": read_only([0.0] * len(limits)), **spec.configurations})
