#!/usr/bin/env python3
"""Write the README's accuracy table: the worst pose error of every engine on every robot, over 1000 configurations.

Run it without arguments; it replaces what stands between the markers in README.md. The last digits depend on the
machine, so the table is not checked for drift.
"""

from __future__ import annotations

from pathlib import Path

from dh2sim import build_model, load_robot
from dh2sim.robot.catalog import builtin_robots
from dh2sim.validate.report import Quantity, RobotReport
from dh2sim.validate.run import validate_robot

README = Path(__file__).resolve().parent.parent / "README.md"
BEGIN, END = "<!-- accuracy: begin -->", "<!-- accuracy: end -->"


def table() -> str:
    """Return the table as Markdown."""
    reports = [validate_robot(build_model(load_robot(name)), samples=1000) for name in builtin_robots()]
    engines = [check.engine for check in reports[0].checks if check.quantity is Quantity.POSE]
    lines = [
        f"| robot | reach | {' | '.join(engines)} |",
        f"|---|---:|{'---:|' * len(engines)}",
        *(_line(report, engines) for report in reports),
    ]
    return "\n".join(lines)


def _line(report: RobotReport, engines: list[str]) -> str:
    errors = {check.engine: check for check in report.checks if check.quantity is Quantity.POSE}
    cells = [f"{errors[engine].max_position_error:.0e}" for engine in engines]
    return f"| {report.name} | {report.reach:.3g} m | {' | '.join(cells)} |"


def main() -> None:
    """Replace the table in the README."""
    text = README.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    README.write_text(f"{before}{BEGIN}\n{table()}\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
