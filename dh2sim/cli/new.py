"""``dh2sim new``: a robot file to start from."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import ForceOption, choice, complete_robot, load_one
from dh2sim.cli.output import hand_over, require_free
from dh2sim.errors import Dh2simError
from dh2sim.messages import printable

if TYPE_CHECKING:
    from dh2sim.robot.row import Convention

DEFAULT_JOINTS = "RRPRRR"
MOST_JOINTS = 100
TYPES = {"R": "revolute", "P": "prismatic", "C": "continuous", "F": "fixed"}
TWISTS = (-90, 90, 0)
"""Of the rows, in turn; deg."""


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the robot.")],
    joints: Annotated[
        str | None,
        typer.Option(
            metavar="LETTERS",
            help="A letter for each row: R revolute, P prismatic, C continuous, F fixed. [default: RRPRRR]",
            show_default=False,
        ),
    ] = None,
    convention: Annotated[
        str | None,
        typer.Option(
            metavar="standard|modified|hayati",
            help="Convention of the table. [default: standard]",
            show_default=False,
        ),
    ] = None,
    source: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="ROBOT",
            help="Start from a copy of this robot file instead.",
            autocompletion=complete_robot,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE", help="File to write. [default: NAME.yaml]", show_default=False),
    ] = None,
    force: ForceOption = False,
) -> None:
    """Write a commented robot file to start from: replace its numbers with those of your table.

    \b
    Examples:
      dh2sim new my_arm
      dh2sim new my_arm --joints RRR --convention modified
      dh2sim new my_arm --from stanford -o robots/my_arm.yaml
    """
    from dh2sim.robot.fields import name_problem
    from dh2sim.robot.read import parse_robot
    from dh2sim.robot.row import CONVENTIONS, Convention

    name = name.removesuffix(".yaml")
    if (problem := name_problem(name)) is not None:
        raise typer.BadParameter(problem.removeprefix("a name "), param_hint="NAME")
    path = Path(f"{name}.yaml") if out is None else out
    require_free(path, force=force)
    if source is None:
        kind = choice(convention, Convention, "--convention", other_names=CONVENTIONS) or Convention.STANDARD
        text = template(name, _types(DEFAULT_JOINTS if joints is None else joints), kind)
    elif joints is not None or convention is not None:
        option = "--convention" if joints is None else "--joints"
        raise typer.BadParameter("must not be given together with --from, whose table has its own", param_hint=option)
    else:
        text = _renamed(source, name)
    spec = parse_robot(text, file=str(path), directory=path.absolute().parent)
    conventions = " and ".join(dict.fromkeys(row.convention.value for row in spec.rows))
    rows = f"{len(spec.rows)} {'row' if len(spec.rows) == 1 else 'rows'}"
    hand_over(text, path, summary=f"{name}, {rows}, {conventions}")
    file = shlex.quote(str(path))
    commands = (
        (f"dh2sim view {file}", "see it in the browser, and edit its table"),
        (f"dh2sim export {file}", f"write URDF and MJCF to generated/{name}/"),
        (f"dh2sim validate {file}", "check every engine against the table"),
    )
    width = max(len(command) for command, _ in commands)
    print("Next:")
    for command, purpose in commands:
        print(printable(f"  {command:{width}}  {purpose}"))


def _types(letters: str) -> list[str]:
    """Return the type of each row, of letters such as 'RRP'."""
    unknown = next((letter for letter in letters if letter.upper() not in TYPES), None)
    if unknown is not None:
        known = ", ".join(f"{letter} {kind}" for letter, kind in TYPES.items())
        raise typer.BadParameter(
            f"must not contain the letter '{unknown}'; allowed are {known}", param_hint="--joints"
        )
    if not 0 < len(letters) <= MOST_JOINTS:
        raise typer.BadParameter(f"needs 1 to {MOST_JOINTS} letters, got {len(letters)}", param_hint="--joints")
    return [TYPES[letter.upper()] for letter in letters]


def _renamed(source: str, name: str) -> str:
    """Return the text of another robot file with the name exchanged."""
    spec = load_one(source)
    original = "" if spec.source_file is None else spec.source_file.text
    text, count = re.subn(r"^(name:[ \t]*)([\w-]+|'[\w-]+'|\"[\w-]+\")", rf"\g<1>{name}", original, flags=re.M)
    if count != 1:
        raise Dh2simError(f"{source}: has no line 'name: {spec.name}' to replace the name in")
    return text


def template(name: str, types: list[str], convention: Convention) -> str:
    """Return the text of a robot file with comments that explain it.

    Args:
        name: Of the robot.
        types: Of the rows, at least one.
        convention: Of the table.
    """
    from dh2sim.robot.row import Convention

    product, indices = {
        Convention.STANDARD: ("Rz(theta) Tz(d) Tx(a) Rx(alpha)", "row i: theta_i, d_i, a_i, alpha_i"),
        Convention.MODIFIED: ("Tx(a) Rx(alpha) Rz(theta) Tz(d)", "row i: a_(i-1), alpha_(i-1), theta_i, d_i"),
        Convention.HAYATI: ("Rz(theta) Tx(a) Rx(alpha) Ry(beta)", "row i: theta_i, a_i, alpha_i, beta_i; no d"),
    }[convention]
    moving = [kind for kind in types if kind != "fixed"]
    home = ", ".join("0.3" if kind == "prismatic" else str((30, -40, 50)[i % 3]) for i, kind in enumerate(moving))
    zero = ", ".join(["0"] * len(moving))
    width = max(map(len, types)) + 1
    rows = "\n".join(_row(i, kind, width, convention) for i, kind in enumerate(types, start=1))
    configurations = (
        f"""
configurations:                   # named joint vectors, in the units above
  home: [{home}]
  zero: [{zero}]
"""
        if moving
        else ""
    )
    return f"""\
# Replace the numbers by those of your table. The keys that are left out have sensible defaults;
# the file docs/robot-file.md explains all of them.
name: {name}
# description: What it is, in a few words
# source: Where the numbers come from
{f"convention: {convention}":32}  # standard, modified or hayati
units: {{angle: deg, length: m}}    # deg or rad; m, mm, cm or in
parameters: {{h: 0.4, l: 0.25}}     # lengths that have a letter; numbers may be expressions, as in 2*l

# base: {{xyz: [0, 0, 0], rpy: [0, 0, 0]}}     # pose of DH frame 0 in base_link
# tool: {{xyz: [0, 0, 0.1], rpy: [0, 0, 0]}}   # pose of tool0 in the last DH frame

# One entry for each row of the table, base first: A_i = {product}
# ({indices}).
# The joint variable is theta of a revolute joint and d of a prismatic one: leave it out, or write its offset.
joints:
{rows}
# More that a row may hold:
#   name: shoulder                      flip: true
#   limits: {{position: [-90, 90], velocity: 120, effort: 50}}
#   dynamics: {{damping: 0.1, friction: 0.05, armature: 0.01}}
#   link: {{mass: 2.5, com: [0, 0, 0.1], radius: 0.04, mesh: {{file: link.stl, scale: 0.001}}}}
{configurations}"""


def _row(index: int, kind: str, width: int, convention: Convention) -> str:
    """Return one line of the table: an arm that bends every way, whatever its joints are."""
    twist = TWISTS[(index - 1) % len(TWISTS)]
    cells = {"a": "0" if index == 1 else "l", "alpha": str(twist)}
    if convention == "hayati":
        if kind == "prismatic":
            cells["d"] = "0"
        cells["beta"] = "0"
    else:
        cells["d"] = "h" if index == 1 and kind != "prismatic" else "0"
    cells["theta"] = "0"
    limits = {"revolute": ", limits: {position: [-170, 170]}", "prismatic": ", limits: {position: [0, 0.6]}"}
    numbers = ", ".join(f"{key}: {value:>{3 if key == 'alpha' else 1}}" for key, value in cells.items())
    return f"  - {{type: {f'{kind},':{width}} {numbers}{limits.get(kind, '')}}}"
