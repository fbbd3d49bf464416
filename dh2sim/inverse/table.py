"""What inverse kinematics depends on, a bare table, and what solvers of equal tables share."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from dh2sim.robot.links import BaseSpec, ToolSpec
from dh2sim.robot.row import Limits, Row
from dh2sim.robot.spec import RobotSpec


def shared_builds(spec: RobotSpec) -> dict[Any, Any]:
    """Return where what is built for a table is kept, the same for equal tables."""
    return _shared(_key(spec))


@lru_cache(maxsize=64)
def _shared(key: tuple[object, ...]) -> dict[Any, Any]:  # noqa: ARG001
    """Return a place for what is built, the same for equal keys."""
    return {}


def _key(spec: RobotSpec) -> tuple[object, ...]:
    """Return the numbers of a table, which tell it from others."""
    poses = (spec.base.pose, spec.tool)
    return (
        *(tuple(values.tolist()) for pose in poses for values in (pose.xyz, pose.rpy)),
        *((r.type, r.convention, r.a, r.alpha, r.d, r.theta, r.beta, r.flip, r.limits.position) for r in spec.rows),
    )


def bare_table(spec: RobotSpec) -> RobotSpec:
    """Return a robot without all that does not count for inverse kinematics."""

    def bare(row: Row) -> Row:
        return Row(
            name=row.name,
            type=row.type,
            convention=row.convention,
            a=row.a,
            alpha=row.alpha,
            d=row.d,
            theta=row.theta,
            beta=row.beta,
            flip=row.flip,
            limits=Limits(position=row.limits.position),
        )

    home = {name: q for name, q in spec.configurations.items() if name == "home"}
    return RobotSpec(
        name=spec.name,
        units=spec.units,
        base=BaseSpec(pose=spec.base.pose),
        tool=ToolSpec.at(spec.tool),
        rows=tuple(bare(row) for row in spec.rows),
        configurations=home,
    )
