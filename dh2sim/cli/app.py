"""The commands of the ``dh2sim`` program; only the one that is called is imported."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from itertools import takewhile
from typing import Annotated, Any, Final, NamedTuple

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup

from dh2sim.cli.common import MANY, complain, guarded
from dh2sim.cli.values import PlainValues


class Command(NamedTuple):
    """Where a command is defined, and its line in the help of the program."""

    module: str
    """Of ``dh2sim.cli``."""
    function: str
    help: str
    settings: dict[str, Any] = {}  # noqa: RUF012
    many: tuple[str, ...] = ()
    """Options that take all words up to the next option."""
    bare: tuple[str, ...] = ()
    """Those of them that may have no word."""


UsageError: Any = typer.BadParameter.__base__
"""Of typer, or of click in its earlier versions."""

NEGATIVE_NUMBERS: Final = {"ignore_unknown_options": True}
"""A negative number is an argument, not an option."""

_NO_NUMBER: Final = re.compile(r"--.*|-(?!pi$)[A-Za-z]+", re.DOTALL)
"""An option rather than a coordinate, such as -1.5 or -pi/2."""

COMMANDS: Final = {
    "new": Command("new", "new", "Write a robot file to start from."),
    "export": Command("export", "export", "Write URDF and MJCF, verified against the table."),
    "validate": Command("validate", "validate", "Check every engine against the table."),
    "check": Command("check", "check", "Check a repository: robot files, exports, poses."),
    "fk": Command("fk", "fk", "Print the pose of a frame.", NEGATIVE_NUMBERS),
    "jacobian": Command("fk", "jacobian", "Print the Jacobian, and how close it is to singular.", NEGATIVE_NUMBERS),
    "ik": Command("ik", "ik", "Find all joint vectors that reach a pose.", many=("--at", "--near", "--lock")),
    "trajectory": Command(
        "trajectory",
        "trajectory",
        "Plan motions through waypoints, within limits.",
        NEGATIVE_NUMBERS,
        many=("--limits",),
        bare=("--limits",),
    ),
    "workspace": Command("workspace", "workspace", "Find what a robot reaches, and its boundary."),
    "symbolic": Command("symbolic", "symbolic", "Print kinematics in symbols, as a textbook does."),
    "mobility": Command("mobility", "mobility", "Count degrees of freedom, and find the true ones."),
    "info": Command("info", "info", "Print the table, frames, mass and reach."),
    "view": Command("view", "view", "Show a robot in the browser, and edit its table."),
    "import": Command("importing", "import_robot", "Make a robot file from a URDF, an MJCF or a table."),
    "convert": Command("importing", "convert", "Write a table in the other convention."),
    "diff": Command("diff", "diff", "Say whether two robots are the same mechanism."),
    "grade": Command("grade", "grade", "Grade students' tables against a solution."),
    "exercise": Command("exercise", "exercise", "Make a random arm as an exercise."),
    "frames": Command("importing", "frames", "Assign DH frames to joint axes, step by step."),
    "calibrate": Command("calibrate", "calibrate", "Fit a table to measurements of the real robot."),
    "rollout": Command("rollout", "rollout", "Simulate many rollouts into a dataset."),
    "sweep": Command("sweep", "sweep", "Measure what each of many designs can do."),
    "render": Command("pictures", "render", "Render a rollout as a video, or a robot as an image."),
    "draw": Command(
        "draw",
        "draw",
        "Draw a robot as textbooks do, as SVG, TikZ, PNG or PDF.",
        NEGATIVE_NUMBERS,
        many=("--workspace",),
    ),
    "plot": Command("pictures", "plot", "Plot joints, tool, energy or tracking."),
    "runs": Command("runs", "runs", "Describe a run, or convert it to Parquet or HDF5."),
    "list": Command("robots", "list_robots", "List the robots that come with dh2sim."),
    "schema": Command("robots", "schema", "Print the JSON Schema of robot files."),
}

HELP = """\
From a Denavit-Hartenberg table to a simulated robot that provably matches it.

\b
Examples:
  dh2sim new my_arm                  a robot file to start from
  dh2sim list                        the robots that come with dh2sim
  dh2sim info stanford               its table, frames, mass and reach
  dh2sim export stanford             its URDF and MJCF, in generated/stanford/
  dh2sim validate stanford           check every engine against the table
  dh2sim check my_arm.yaml           its file, exports and poses; or a folder's
  dh2sim fk stanford 17 -40 0.5 63 34 -23
  dh2sim jacobian stanford home
  dh2sim ik puma560 --at home        all ways to get there
  dh2sim workspace puma560 --section -o reach.svg
  dh2sim trajectory puma560 home zero -o motion.csv
  dh2sim symbolic puma560            its pose in symbols
  dh2sim mobility four_bar           its degrees of freedom, counted and true
  dh2sim draw stanford               a drawing of it
  dh2sim view stanford --export stanford.html
  dh2sim import arm.urdf -o arm.yaml
  dh2sim convert stanford --to modified
  dh2sim frames axes.yaml            from joint axes to a table
  dh2sim diff puma560 puma560_standard
  dh2sim calibrate ur5e --plan 30 -o configurations.csv
  dh2sim rollout stanford --out run.zarr
  dh2sim runs run.zarr               what a run contains
  dh2sim sweep stanford --vary d2=0.2 --count 32 -o arms.csv
  dh2sim plot run.zarr               how its joints move
  dh2sim render run.zarr             a video of it

ROBOT is the path of a robot file, or the name of a robot that comes with dh2sim.

Exit status: 0 done, 1 a check failed, 2 bad input or usage, 130 interrupted.
"""


class LazyGroup(PlainValues, TyperGroup):
    """Builds a command when it is called: importing and building them all takes longer than most of them run."""

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002
        """Return the names, in the order of the help."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ARG002
        """Return a command, None if there is none of this name."""
        if cmd_name not in COMMANDS:
            return None
        command = COMMANDS[cmd_name]
        single = _plain_app(add_completion=False)
        function = getattr(import_module(f"dh2sim.cli.{command.module}"), command.function)
        settings = {**_SETTINGS, **command.settings}
        single.command(cmd_name, cls=_taking_many(command.many, command.bare), context_settings=settings)(
            guarded(function)
        )
        return typer.main.get_command(single)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command that the first argument names."""
        name = args[0]
        if name not in COMMANDS and not name.startswith("-") and not ctx.resilient_parsing:
            from dh2sim.cli.usage import unknown

            raise SystemExit(complain(unknown("command", name, COMMANDS, ctx)))
        return super().resolve_command(ctx, args)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the options of the program itself."""
        with _usage_errors(ctx):
            return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        with _usage_errors(ctx):
            return super().invoke(ctx)

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002
        """List the commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, command.help) for name, command in COMMANDS.items()])


@contextmanager
def _usage_errors(ctx: Any) -> Iterator[None]:
    """Report errors in how a command was called as this program reports all errors."""
    try:
        yield
    except UsageError as error:
        if ctx.resilient_parsing:  # a shell completes a word
            raise
        from dh2sim.cli.usage import complain_usage

        raise SystemExit(complain_usage(error, error.ctx or ctx)) from None


class PlainCommand(PlainValues, TyperCommand):
    """A command."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the parameters; the help shows no Python types of arguments, such as ``<list[str]>``."""
        parameters = super().get_params(ctx)
        for parameter in parameters:
            if isinstance(parameter, TyperArgument):
                parameter.display_type_rich = _no_type  # type: ignore[method-assign]
        return parameters

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the options and arguments; a required one has no braces."""
        return [re.sub(r"^{(.*)}", r"\1", piece) for piece in super().collect_usage_pieces(ctx)]

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the options and arguments; where those may be negative numbers, refuse unknown options itself."""
        typed = list(takewhile("--".__ne__, args))
        with _usage_errors(ctx):
            rest = super().parse_args(ctx, args)
        if ctx.ignore_unknown_options and not ctx.resilient_parsing:
            for word in (word for value in ctx.params.values() if isinstance(value, list) for word in value):
                if isinstance(word, str) and _NO_NUMBER.fullmatch(word) and word in typed:
                    from dh2sim.cli.usage import unknown_option

                    raise SystemExit(complain(unknown_option(word, ctx)))
        return rest


def _no_type(ctx: Any) -> str:  # noqa: ARG001
    return ""


def _taking_many(options: tuple[str, ...], bare: tuple[str, ...] = ()) -> type[TyperCommand]:
    """Return the class of a command some of whose options take all words up to the next option.

    Negative numbers among them are no options; those of ``bare`` may stand alone. The command gets the words of an
    option as one text, with MANY between them; that alone, where there are none.
    """

    class TakingMany(PlainCommand):
        def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
            given = list(args)
            for start in reversed(range(len(given))):
                if given[start] in options:
                    words = list(takewhile(_is_value, given[start + 1 :]))
                    given[start + 1 : start + 1 + len(words)] = (
                        [MANY.join(words)] if words else [MANY] if given[start] in bare else []
                    )
            return super().parse_args(ctx, given)

    return TakingMany if options else PlainCommand


def _is_value(word: str) -> bool:
    return not word.startswith("--") and word != "-h"


_SETTINGS: Final = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


def _plain_app(**options: Any) -> typer.Typer:
    """Return an app with plain help texts: importing rich for them would double the time that --help takes."""
    return typer.Typer(rich_markup_mode=None, pretty_exceptions_enable=False, context_settings=_SETTINGS, **options)


app = _plain_app(cls=LazyGroup, help=HELP, no_args_is_help=True)


def _show_version(requested: bool) -> None:
    if requested:
        from importlib.metadata import version

        typer.echo(f"dh2sim {version('dh2sim')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Hold the options of the program itself."""
