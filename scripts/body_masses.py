#!/usr/bin/env python3
"""Compare estimated masses with published ones, and write the table of docs/bodies.md.

    python scripts/body_masses.py [--check]

Of arms in robots/, what the file gives is taken away and estimated again; arms of Universal Robots that are not there
have their table and masses here.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from dh2sim import build_model, load_robot
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.links import LinkSpec
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "bodies.md"
TABLE = re.compile(r"(<!-- masses: begin -->\n).*(<!-- masses: end -->)", flags=re.DOTALL)
MOVING = 0.85
"""Share of an arm's mass that moves, where only the whole arm's is published, base included."""
WHOLE = {"abb_irb120": 25.0}
"""kg, base included; from the sources that the robot files name."""
IN_FILES = ("ur5e", "ur10e", "franka_panda", "kuka_iiwa14", "kinova_gen3", "xarm7", "kuka_kr6_r900", "so101")
"""Arms of robots/ whose links have masses."""
UNIVERSAL_ROBOTS = {
    "ur3e": ((0.15185, -0.24355, -0.2132, 0.13105, 0.08535, 0.0921), (1.98, 3.4445, 1.437, 0.871, 0.805, 0.261)),
    "ur16e": ((0.1807, -0.4784, -0.36, 0.17415, 0.11985, 0.11655), (7.369, 10.45, 4.321, 2.18, 2.033, 0.907)),
    "ur20": ((0.2363, -0.862, -0.7287, 0.201, 0.1593, 0.1543), (16.343, 29.632, 7.879, 3.054, 3.126, 0.926)),
}
"""d1, a2, a3, d4, d5, d6 in m, and the masses of links 1 to 6 in kg: Universal Robots, 'DH Parameters for
calculations of kinematics and dynamics', masses also in UniversalRobots/Universal_Robots_ROS2_Description,
config/*/physical_parameters.yaml."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """An arm with its published and its estimated moving mass."""

    name: str
    model: RobotModel
    published: float
    """kg."""

    @property
    def ratio(self) -> float:
        """Estimated over published."""
        return self.model.mass / self.published


def estimated(spec: RobotSpec) -> RobotModel:
    """Return a robot whose links have the shapes and masses that dh2sim gives them."""
    return build_model(replace(spec, rows=tuple(replace(row, link=LinkSpec()) for row in spec.rows)))


def universal_robot(name: str) -> RobotSpec:
    """Return the table of an arm of Universal Robots."""
    (d1, a2, a3, d4, d5, d6), _ = UNIVERSAL_ROBOTS[name]
    table = ((0, math.pi / 2, d1), (a2, 0, 0), (a3, 0, 0), (0, math.pi / 2, d4), (0, -math.pi / 2, d5), (0, 0, d6))
    rows = [
        Row(name=f"joint_{i}", type=JointType.REVOLUTE, convention=Convention.STANDARD, a=a, alpha=alpha, d=d)
        for i, (a, alpha, d) in enumerate(table, start=1)
    ]
    return RobotSpec(name=name, rows=tuple(rows))


def compared() -> Iterator[Compared]:
    """Yield every arm whose mass is published."""
    for name in IN_FILES:
        spec = load_robot(ROOT / "robots" / f"{name}.yaml")
        given = math.fsum(row.link.mass or 0.0 for row in spec.rows)
        yield Compared(name=name, model=estimated(spec), published=given)
    for name, whole in WHOLE.items():
        spec = load_robot(ROOT / "robots" / f"{name}.yaml")
        yield Compared(name=name, model=estimated(spec), published=MOVING * whole)
    for name, (_, masses) in UNIVERSAL_ROBOTS.items():
        yield Compared(name=name, model=estimated(universal_robot(name)), published=math.fsum(masses))


def table() -> str:
    """Return the table, arms in the order of the ratio."""
    lines = ["| arm | reach | published, moving | estimated | ratio |", "|---|---|---|---|---|"]
    for arm in sorted(compared(), key=lambda arm: arm.ratio):
        of_whole = f" ({MOVING:g} of {WHOLE[arm.name]:g} kg)" if arm.name in WHOLE else ""
        lines.append(
            f"| {arm.name} | {arm.model.reach:.2f} m | {arm.published:.3g} kg{of_whole} | {arm.model.mass:.3g} kg "
            f"| {arm.ratio:.2f} |"
        )
    return "\n".join(lines) + "\n"


def main() -> int:
    """Write the table, or check that it is up to date."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="only say whether the page is up to date")
    check = parser.parse_args().check
    page = PAGE.read_text(encoding="utf-8")
    new = TABLE.sub(lambda found: found.group(1) + table() + found.group(2), page)
    if new == page:
        print(f"{PAGE.name}: up to date")
        return 0
    if check:
        print(f"{PAGE.name}: out of date; run python scripts/body_masses.py")
        return 1
    PAGE.write_text(new, encoding="utf-8")
    print(PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
