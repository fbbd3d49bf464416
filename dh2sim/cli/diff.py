"""``dh2sim diff``: are two robots the same mechanism, and where do they differ?"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import DONE, FELL_SHORT, JsonOption, choice, complete_robot, other_format, tolerance_of
from dh2sim.cli.importing import errors_with_options
from dh2sim.cli.output import json_text, print_wrapped, table_lines
from dh2sim.messages import printable

if TYPE_CHECKING:
    from dh2sim.compare.comparison import Comparison, Equivalence
    from dh2sim.importing.sources import ImportOptions


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
    base: Annotated[
        list[str] | None,
        typer.Option(metavar="LINK", help="Base link of a URDF or an MJCF; given twice, that of A and that of B."),
    ] = None,
    tip: Annotated[
        list[str] | None,
        typer.Option(metavar="LINK|SITE", help="Tip of a URDF or an MJCF; given twice, that of A and that of B."),
    ] = None,
    convention: Annotated[
        str | None, typer.Option(metavar="standard|modified", help="Convention of a table that does not say it.")
    ] = None,
    angle: Annotated[
        str | None, typer.Option(metavar="deg|rad", help="Unit of angles of a table that does not say it.")
    ] = None,
    length: Annotated[
        str | None, typer.Option(metavar="m|mm|cm|in", help="Unit of lengths of a table that does not say it.")
    ] = None,
    kinematics: Annotated[
        bool, typer.Option("--kinematics", help="Compare the mechanisms alone: no limits, masses and gains.")
    ] = False,
    as_json: JsonOption = False,
) -> int:
    """Compare two robots: are they the same?

    Mechanisms are the same if they differ at most in base, tool, zeros and senses of the joints, and names. These
    differences are listed, and limits, masses and gains that both give differently. Otherwise it is printed where
    the mechanisms first differ, and which single misreading of the table explains it.

    Exit status: 0 the same mechanism, with the same limits, masses and gains; 1 different; 2 bad input.

    \b
    Examples:
      dh2sim diff puma560 puma560_standard
      dh2sim diff my_arm.yaml my_arm.urdf
      dh2sim diff panda.urdf panda.xml --tolerance 1e-4 --json
    """
    from dh2sim.compare.comparison import diff as compare

    allowed = tolerance_of(tolerance)
    words = (convention, angle, length)
    options_a, options_b = (_options(file, which, (base, tip), words) for which, file in enumerate((a, b)))
    with errors_with_options():
        found = compare(a, b, tolerance=allowed, options_a=options_a, options_b=options_b)
    if kinematics:
        found = replace(found, quantities=())
    if as_json:
        print(json_text(found.to_dict()))
    else:
        _print(found)
    return DONE if found.equal else FELL_SHORT


def _options(
    file: str, which: int, links: tuple[list[str] | None, list[str] | None], words: tuple[str | None, ...]
) -> ImportOptions:
    """Return how one of the two files is to be read: links are of models, words of tables.

    Raises:
        BadParameter: A link is given three times, or a word is not allowed.
    """
    from dh2sim.importing.sources import ImportOptions
    from dh2sim.robot.row import CONVENTIONS, Convention
    from dh2sim.robot.units import AngleUnit, LengthUnit

    for name, given in zip(("--base", "--tip"), links, strict=True):
        if given is not None and len(given) > 2:
            raise typer.BadParameter("must be given once for both robots, or twice", param_hint=name)
    base, tip = (None if not given else given[min(which, len(given) - 1)] for given in links)
    convention, angle, length = words
    read = (
        choice(convention, Convention, "--convention", without=(Convention.HAYATI,), other_names=CONVENTIONS),
        choice(angle, AngleUnit, "--angle"),
        choice(length, LengthUnit, "--length"),
    )
    kind = other_format(file)
    if kind in ("a URDF", "an MJCF"):
        return ImportOptions(base=base, tip=tip)
    return ImportOptions(convention=read[0], angle=read[1], length=read[2])


def _print(found: Comparison) -> None:
    for label, spec in (("A", found.a), ("B", found.b)):
        joints = "".join("R" if row.type.turns else "P" for row in spec.moving_rows)
        count = "1 joint" if len(joints) == 1 else f"{len(joints)} joints"
        print(printable(f"{label}  {spec.name}: {', '.join(filter(None, (count, joints)))}"))
    print()
    if found.equivalence is not None:
        _print_same(found.equivalence)
        _print_quantities(found)
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


def _print_quantities(found: Comparison) -> None:
    """Print limits, masses and gains that differ; texts that are too long for 80 columns go on the next line."""
    if not found.quantities:
        return
    print("\nOf what both give, these differ (B as A counts):")
    for quantity in found.quantities:
        print_item(str(quantity))


def print_item(sentence: str) -> None:
    """Print a sentence as an item of a list, wrapped at 80 columns."""
    print_wrapped(sentence, first="  - ", rest="    ")
