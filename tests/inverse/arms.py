"""Arms of the literature, and odd ones, for tests of the inverse kinematics."""

from __future__ import annotations

import math

from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec

_RIGHT = math.pi / 2


def arm(name: str, *rows: tuple[float, float, float, float, str]) -> RobotSpec:
    """Return a robot of standard rows (a, alpha, d, theta, type); lengths in m, angles in rad."""
    kinds = {"R": JointType.REVOLUTE, "P": JointType.PRISMATIC}
    table = tuple(Row(type=kinds[kind], a=a, alpha=alpha, d=d, theta=theta) for a, alpha, d, theta, kind in rows)
    return RobotSpec(name=name, convention=Convention.STANDARD, rows=table)


SIXTEEN = arm(
    "manocha_canny",
    (0.3, _RIGHT, 0.0, 0.0, "R"),
    (1.0, math.radians(1), 0.0, 0.0, "R"),
    (0.0, _RIGHT, 0.2, 0.0, "R"),
    (1.5, math.radians(1), 0.0, 0.0, "R"),
    (0.0, _RIGHT, 0.0, 0.0, "R"),
    (1.1358, math.radians(1), 0.0, 0.0, "R"),
)
"""An arm that reaches some poses in sixteen ways (Manocha and Canny, 1994)."""
GENERAL = arm(
    "general_6r",
    (0.3, 1.1, 0.2, 0.0, "R"),
    (0.5, -0.7, 0.15, 0.0, "R"),
    (0.2, 1.3, 0.4, 0.0, "R"),
    (0.35, 0.9, 0.1, 0.0, "R"),
    (0.25, -1.2, 0.3, 0.0, "R"),
    (0.1, 0.6, 0.2, 0.0, "R"),
)
UR5 = arm(
    "ur5",
    (0.0, _RIGHT, 0.089159, 0.0, "R"),
    (-0.425, 0.0, 0.0, 0.0, "R"),
    (-0.39225, 0.0, 0.0, 0.0, "R"),
    (0.0, _RIGHT, 0.10915, 0.0, "R"),
    (0.0, -_RIGHT, 0.09465, 0.0, "R"),
    (0.0, 0.0, 0.0823, 0.0, "R"),
)
JACO = arm(
    "jaco",
    (0.0, _RIGHT, 0.2755, 0.0, "R"),
    (0.41, math.pi, 0.0, 0.0, "R"),
    (0.0, _RIGHT, -0.0098, 0.0, "R"),
    (0.0, math.radians(55), -0.2502, 0.0, "R"),
    (0.0, math.radians(55), -0.0856, 0.0, "R"),
    (0.0, math.pi, -0.2228, 0.0, "R"),
)
"""A wrist of 55 degrees whose axes do not meet."""
CRX = arm(
    "crx_like",
    (0.0, -_RIGHT, 0.0, 0.0, "R"),
    (0.54, math.pi, 0.0, 0.0, "R"),
    (0.0, -_RIGHT, 0.0, 0.0, "R"),
    (0.0, _RIGHT, -0.54, 0.0, "R"),
    (0.0, -_RIGHT, 0.15, 0.0, "R"),
    (0.0, math.pi, -0.16, 0.0, "R"),
)
ORTHOGONAL = arm(
    "orthogonal",
    (0.3, _RIGHT, 0.2, 0.0, "R"),
    (0.5, -_RIGHT, 0.1, 0.0, "R"),
    (0.2, _RIGHT, 0.4, 0.0, "R"),
    (0.35, -_RIGHT, 0.15, 0.0, "R"),
    (0.25, _RIGHT, 0.3, 0.0, "R"),
    (0.1, 0.0, 0.2, 0.0, "R"),
)
"""All axes at right angles, with offsets."""


def odd_arm(pattern: str) -> RobotSpec:
    """Return an arm of these joints, R or P, with odd twists and offsets everywhere."""
    rows = [
        (0.21 + 0.05 * i, (1.1, -0.7, 1.3, 0.9, -1.2, 0.6)[i], 0.35 - 0.06 * i, 0.4 * i - 1.0, kind)
        for i, kind in enumerate(pattern)
    ]
    return arm(f"odd_{pattern.lower()}", *rows)


ARMS = {
    spec.name: spec
    for spec in (
        UR5,
        GENERAL,
        SIXTEEN,
        JACO,
        CRX,
        ORTHOGONAL,
        *(odd_arm(pattern) for pattern in ("RRPRRR", "RPRPRR", "PRRPRR", "PRPRPR")),
    )
}
