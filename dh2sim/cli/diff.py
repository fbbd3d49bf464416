"""``dh2sim diff``: are two robots the same mechanism, and where do they differ?"""

from __future__ import annotations

import sys
import textwrap
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import DONE, FELL_SHORT, complete_robot, tolerance_of
from dh2sim.cli.output import json_text, table_lines
from dh2sim.messages import printable

if TYPE_CHECKING:
    from dh2sim.compare.comparison import Comparison, Equivalence

WIDTH = 80


def diff(
    a: Annotated[
        str,
        typer.Argument(
            metavar="A",
            help="A robot: a robot file, a URDF, an MJCF, a DH table, or the name of one that comes with dh2sim.",
            autocompletion=complete_robot,
        ),
    ],
    b: Annotated[
        str, typer.Argument(metavar="B", help="The robot to compare with it.", autocompletion=complete_robot)
    ],
    tolerance: Annotated[
        float,
        typer.Option(metavar="T", help="Largest difference of tool0: rad, and m for a reach of up to 1 m."),
    ] = 1e-6,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON alone.")] = False,
) -> int:
    """Compare two robots: are they the same mechanism?

    Kinematics are the same up to base, tool, zeros and senses of the joints, and names; what of these differs is
    told. Otherwise: where the mechanisms first differ, and which single misreading of the table explains it.

    Exit status: 0 the same mechanism, 1 different, 2 bad input.

    \b
    Examples:
      dh2sim diff puma560 puma560_standard
      dh2sim diff my_arm.yaml my_arm.urdf
      dh2sim diff panda.urdf panda.xml --tolerance 1e-4 --json
    """
    from dh2sim.compare.comparison import diff as compare

    found = compare(a, b, tolerance=tolerance_of(tolerance))
    if as_json:
        print(json_text(found.to_dict()))
    else:
        _print(found)
    return DONE if found.same else FELL_SHORT


def _print(found: Comparison) -> None:
    for label, spec in (("A", found.a), ("B", found.b)):
        joints = "".join("R" if row.type.turns else "P" for row in spec.moving_rows)
        print(printable(f"{label}  {spec.name}: {len(joints)} joints, {joints}"))
    for note in found.notes:
        print(
            textwrap.fill(f"dh2sim: note: {printable(note)}", WIDTH, subsequent_indent="  ", break_on_hyphens=False),
            file=sys.stderr,
        )
    print()
    if found.equivalence is not None:
        _print_same(found.equivalence)
        return
    print("Different mechanisms.")
    for sentence in found.sentences():
        print_item(sentence)


def _print_same(same: Equivalence) -> None:
    sentences = list(same.sentences())
    print("The same mechanism." if not sentences else "The same mechanism, but:")
    for sentence in sentences:
        print_item(sentence)
    residual = same.residual
    print(
        f"Residual of tool0 at {residual.configurations} configurations: {residual.position:.1e} m, "
        f"{residual.rotation:.1e} rad"
    )
    if any(joint.formula(same.smallest) != "q" for joint in same.joints):
        print()
        rows = [["A", "B", "q of B"]]
        rows += [[joint.a, joint.b, joint.formula(same.smallest)] for joint in same.joints]
        print(printable("\n".join(table_lines(rows, left=3))))


def print_item(sentence: str) -> None:
    """Print a sentence as an item of a list, wrapped at 80 columns."""
    print(
        textwrap.fill(
            f"  - {printable(sentence)}",
            WIDTH,
            subsequent_indent="    ",
            break_long_words=False,
            break_on_hyphens=False,
        )
    )
