"""``dh2sim symbolic``: the table in symbols."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import ForceOption, RobotArgument, choice, load_one, refuse_options, words_of
from dh2sim.cli.output import hand_over, json_text, require_free
from dh2sim.cli.symbolic_code import LANGUAGES, is_about_code, print_code
from dh2sim.codegen.program import What as CodeWhat
from dh2sim.errors import Dh2simError

if TYPE_CHECKING:
    from dh2sim.robot.spec import RobotSpec, SpecLike


class Format(StrEnum):
    """How a form is written."""

    TEXT = "text"
    LATEX = "latex"
    MARKDOWN = "markdown"
    JSON = "json"


def symbolic(
    robot: RobotArgument,
    what: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WHAT",
            help="pose, matrices, jacobian, dynamics, inverse-dynamics; for code several, with commas or repeated. "
            "[default: pose]",
        ),
    ] = None,
    source: Annotated[
        str, typer.Option("--from", metavar="FRAME", help="Frame that the pose is given in.")
    ] = "base_link",
    target: Annotated[
        str, typer.Option("--to", metavar="FRAME", help="tool0, base_link, dh_0 … dh_n or link_1 … link_n.")
    ] = "tool0",
    style: Annotated[
        str, typer.Option(metavar="STYLE", help="Nested from the 'base' or from the 'tool', or 'expanded'.")
    ] = "base",
    lengths: Annotated[
        str | None,
        typer.Option(metavar="PLACE", help="Lengths 'first' or 'last' in products. [default: first with tool]"),
    ] = None,
    names: Annotated[bool, typer.Option("--names/--no-names", help="Name sums that recur #1, #2, …")] = True,
    numbers: Annotated[bool, typer.Option("--numbers", help="Numbers instead of the file's parameters.")] = False,
    letters: Annotated[
        bool, typer.Option("--letters", help="Letters for lengths, masses and inertias, too.")
    ] = False,
    fold: Annotated[
        str,
        typer.Option(metavar="AXES", help="Add up angles across 'parallel' axes, 'all' (antiparallel too), 'none'."),
    ] = "parallel",
    no_fold: Annotated[bool, typer.Option("--no-fold", help="The same as --fold none.")] = False,
    q: Annotated[bool, typer.Option("--q", help="Call all joint coordinates q_i.")] = False,
    as_: Annotated[str, typer.Option("--as", metavar="FORMAT", help=f"{', '.join((*Format, *LANGUAGES))}.")] = "text",
    out: Annotated[Path | None, typer.Option("-o", "--out", metavar="FILE", help="Write to a file.")] = None,
    force: ForceOption = False,
) -> None:
    """Print a robot's kinematics or dynamics in symbols, as a textbook does.

    Parameters of the robot file stay letters; every expression is compared with the table before it is printed.

    \b
    Examples:
      dh2sim symbolic puma560
      dh2sim symbolic stanford --style tool
      dh2sim symbolic puma560 --from dh_3 --to dh_6
      dh2sim symbolic scara --what jacobian --as latex -o scara.tex
      dh2sim symbolic planar_2r --what dynamics --letters
      dh2sim symbolic ur5e --what pose,jacobian,inverse-dynamics --as c -o ur5e.c
    """
    frames = {"--from": source != "base_link", "--to": target != "tool0"}
    nesting = {
        "--style": style != "base",
        "--lengths": lengths is not None,
        "--fold": fold != "parallel",
        "--no-fold": no_fold,
    }
    parts = words_of(what, "--what") or ["pose"]
    if is_about_code(parts, as_):
        words = {"--no-names": not names, "--numbers": numbers, "--letters": letters, "--q": q}
        refuse_options("code", frames | nesting | words)
        print_code(robot, parts, as_, out, force=force)
        return
    # imported here: code needs none of it
    from dh2sim.symbolic.expression import Lengths, Style
    from dh2sim.symbolic.request import What, symbolic_form
    from dh2sim.symbolic.table import Fold

    wanted = choice(parts[0], What, "--what", others=(CodeWhat.INVERSE_DYNAMICS,))
    format_ = choice(as_, Format, "--as", others=LANGUAGES)
    nested = choice(style, Style, "--style")
    place = choice(lengths, Lengths, "--lengths")
    axes = Fold.NONE if no_fold else choice(fold, Fold, "--fold")
    assert wanted is not None
    assert nested is not None
    assert axes is not None
    if wanted is What.MATRICES:
        refuse_options("--what matrices", frames)
    elif wanted is What.DYNAMICS:
        refuse_options("--what dynamics", frames | nesting)
    require_free(out, force=force)
    spec = load_one(robot)
    weighed: SpecLike = spec
    if wanted is What.DYNAMICS:
        _require_few_joints(spec)
        if not letters:
            from dh2sim.model.build import build_model

            weighed = build_model(spec)
    form = symbolic_form(
        weighed,
        wanted,
        source=source,
        target=target,
        style=nested,
        lengths=place,
        names=names,
        numbers=numbers,
        letters=letters,
        fold=axes,
        joint_names="q" if q else "theta",
    )
    match format_:
        case Format.LATEX:
            text = form.latex()
        case Format.MARKDOWN:
            text = form.markdown()
        case Format.JSON:
            text = json_text(form.data(), ensure_ascii=False) + "\n"
        case _:
            text = f"{spec.name}: {form}\n"
    hand_over(text, out, summary=f"{spec.name}: {wanted} as {format_}", quiet=out is None)


def _require_few_joints(spec: RobotSpec) -> None:
    from dh2sim.symbolic.motion_form import MOST_JOINTS

    if len(spec.moving_rows) > MOST_JOINTS:
        raise Dh2simError(
            f"{spec.name}: has {len(spec.moving_rows)} joints that move; equations of motion are printed for up to "
            f"{MOST_JOINTS}. For any arm: --what inverse-dynamics --as c"
        )
