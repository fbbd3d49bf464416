"""``dh2sim mobility``: degrees of freedom, counted and true."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dh2sim.cli.common import JsonOption, RobotArgument, load_one
from dh2sim.cli.output import json_text, print_wrapped, table_lines
from dh2sim.messages import printable

if TYPE_CHECKING:
    from dh2sim.mobility.result import Mobility


def mobility(
    robot: RobotArgument,
    as_json: JsonOption = False,
) -> None:
    """Count the degrees of freedom of a robot or a mechanism, and find out how it really moves.

    Gruebler's count in both forms, with lambda chosen from the screws of the joints; the instantaneous mobility, by
    the rank of the loops' constraints at the assembly; the finite one, by walking along them; and a verdict.

    \b
    Examples:
      dh2sim mobility four_bar
      dh2sim mobility bennett
      dh2sim mobility my_mechanism.yaml --json
    """
    from dh2sim.mobility.robot_mechanism import find_mobility

    found = find_mobility(load_one(robot))
    if as_json:
        print(json_text(found.to_dict()))
    else:
        _print(found)


def _print(found: Mobility) -> None:
    mechanism, count = found.mechanism, found.count
    print(f"{mechanism.name}: {count.links} links, {count.joints} joints")
    print()
    rows = [["joint", "type", "between", "f", "C"]]
    for joint, constraints in zip(mechanism.joints, count.constraints, strict=True):
        a, b = (mechanism.links[link] for link in joint.links)
        rows.append([joint.name, joint.type.value, f"{a}, {b}", str(joint.freedoms), str(constraints)])
    if len(rows) > 1:
        print(printable("\n".join(table_lines(rows, left=3))))
        print()
    n, j, f, c = count.links, count.joints, sum(count.freedoms), sum(count.constraints)
    size = count.dimension
    lines = [
        f"lambda = {size}: dimension of the Lie algebra of all screws",
        f"F = lambda (n - j - 1) + sum f = {size} ({n} - {j} - 1) + {f} = {count.gruebler}",
        f"F = lambda (n - 1) - sum C     = {size} ({n} - 1) - {c} = {count.constraints_form}",
    ]
    if mechanism.loops:
        dimensions = " + ".join(map(str, count.loop_dimensions))
        total = f"{f} - ({dimensions})" if len(mechanism.loops) > 1 else f"{f} - {dimensions}"
        lines.append(f"F = sum f - lambda of each loop = {total} = {count.by_loop}")
        lines += ["", _rank_line(found), _finite_line(found)]
    print("\n".join(lines))
    if len(mechanism.loops) > 1:
        print()
        for k, loop in enumerate(mechanism.loops, 1):
            names = ", ".join(mechanism.joints[i].name for i in loop.joints)
            print_wrapped(f"loop {k}: lambda {loop.dimension}, joints {names}")
    print()
    print_wrapped(found.verdict)


def _rank_line(found: Mobility) -> str:
    rank = found.rank
    text = f"instantaneous {found.instantaneous}: rank {rank.rank} of {len(found.mechanism.owners)} joint freedoms"
    if rank.kept is None:
        return text
    if rank.dropped is None:
        return f"{text}, smallest singular value {rank.kept:.2g}"
    gap = f"gap {rank.gap:.1e}" if math.isfinite(rank.gap) else "no doubt"
    return f"{text},\n  singular values kept to {rank.kept:.2g}, dropped from {rank.dropped:.1e}: {gap}"


def _finite_line(found: Mobility) -> str:
    if found.walk is None:
        return f"finite {found.finite}: the constraints are independent, so every velocity goes on"
    if found.walk.dimension:
        return f"finite {found.finite}: counted after walking along the loops"
    return f"finite {found.finite}: no velocity goes on along the loops"
