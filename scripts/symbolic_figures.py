#!/usr/bin/env python3
"""Measure what forms in symbols cost, and write the table into docs/symbolic.md.

    scripts/symbolic_figures.py            print the table
    scripts/symbolic_figures.py --write    write it into the page

Times are processor time of the library, best of five, checks included; reading the robot file and starting Python
come on top. Operations are those of the pose with its sums named.
"""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Callable
from pathlib import Path

from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.read import load_robot
from dh2sim.symbolic.expression import operation_count
from dh2sim.symbolic.request import SymbolicForm, symbolic_form

PAGE = Path(__file__).resolve().parent.parent / "docs" / "symbolic.md"
TABLE = re.compile(r"(<!-- figures: begin -->\n).*(<!-- figures: end -->)", flags=re.DOTALL)


def measured(make: Callable[[], SymbolicForm]) -> tuple[SymbolicForm, float]:
    """Return a form and the least time, ms, that it took of five."""
    times = []
    for _ in range(5):
        start = time.process_time()
        form = make()
        times.append(time.process_time() - start)
    return form, 1e3 * min(times)


def main() -> None:
    """Measure all robots."""
    lines = [
        "| robot | multiplications | additions | sums named | pose, ms | Jacobian, ms |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    for name in builtin_robots():
        spec = load_robot(name)
        pose, pose_time = measured(lambda spec=spec: symbolic_form(spec))  # type: ignore[misc]
        _, jacobian_time = measured(lambda spec=spec: symbolic_form(spec, "jacobian"))  # type: ignore[misc]
        multiplications, additions = operation_count([*pose.form.named.values(), *pose.form.sums])
        lines.append(
            f"| `{name}` | {multiplications} | {additions} | {len(pose.form.named)} "
            f"| {pose_time:.1f} | {jacobian_time:.1f} |"
        )
    table = "\n".join(lines)
    print(table)
    if "--write" in sys.argv[1:]:
        page = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(TABLE.sub(rf"\g<1>{table}\n\g<2>", page), encoding="utf-8")


if __name__ == "__main__":
    main()
