"""``dh2sim import``, ``convert`` and ``frames``: the commands that make robot files from something else."""

from __future__ import annotations

import ast
import re
import shlex
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import ForceOption, RobotArgument, choice, complete_robot, load_one, other_format, tolerance_of
from dh2sim.cli.output import hand_over, json_text, require_free
from dh2sim.errors import Dh2simError, ImportedFileError, MissingExtraError
from dh2sim.messages import printable

if TYPE_CHECKING:
    from dh2sim.importing.result import Imported
    from dh2sim.robot.spec import RobotSpec

ToleranceOption = Annotated[
    float, typer.Option(metavar="T", help="Largest residual, rad and m; numbers are rounded as far as it allows.")
]
OutOption = Annotated[
    Path | None, typer.Option("--out", "-o", metavar="ROBOT.yaml", help="File to write. [default: print it]")
]
_QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but the robot file and errors.")]
JsonOption = Annotated[
    bool, typer.Option("--json", help="Print JSON: the robot file as a text, its notes, how far it is off.")
]


def import_robot(
    file: Annotated[
        str,
        typer.Argument(
            metavar="FILE",
            help="A URDF, an MJCF, a DH table (Markdown, LaTeX, CSV, a toolbox's script, …), or a calibration; "
            "- reads from standard input.",
        ),
    ],
    base: Annotated[
        str | None, typer.Option(metavar="LINK", help="Link that becomes base_link. [default: the root]")
    ] = None,
    tip: Annotated[
        str | None,
        typer.Option(metavar="LINK|SITE", help="Link or site that becomes tool0. [default: where the arm ends]"),
    ] = None,
    convention: Annotated[
        str | None,
        typer.Option(
            metavar="standard|modified", help="Convention of the table to make (default standard) or to read."
        ),
    ] = None,
    angle: Annotated[str | None, typer.Option(metavar="deg|rad", help="Unit of a table's angles.")] = None,
    length: Annotated[str | None, typer.Option(metavar="m|mm|cm|in", help="Unit of a table's lengths.")] = None,
    table: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, help="Table to read, from 1, of a file that has several. [default: the first]"
        ),
    ] = None,
    tolerance: ToleranceOption = 1e-9,
    package_path: Annotated[
        list[Path] | None,
        typer.Option(metavar="FOLDER", help="Folder to find package:// in; may be repeated."),
    ] = None,
    root: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", help="Folder to read included files and meshes in and below. [default: the file's own]"
        ),
    ] = None,
    arg: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME:=VALUE", help="Argument of a xacro file; may be repeated."),
    ] = None,
    nominal: Annotated[
        str | None,
        typer.Option(
            metavar="ROBOT",
            help="Robot that a calibration file is of: gives the nominal table, limits, masses.",
            autocompletion=complete_robot,
        ),
    ] = None,
    name: Annotated[str | None, typer.Option(metavar="NAME", help="Name of the robot. [default: the file's]")] = None,
    out: OutOption = None,
    force: ForceOption = False,
    quiet: _QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Make a robot file from a URDF, an MJCF, a table, or a maker's calibration file.

    The joints of a URDF or an MJCF become DH rows, however their axes lie; where axes are nearly parallel, Hayati's
    row is used. All joint axes and the tip are compared with the file's own kinematics at 1000 random
    configurations, and a residual above the tolerance is an error; so are the mass matrix and the forces of gravity
    at 20, and a difference is reported. Limits, masses, inertias and meshes are kept;
    what cannot be is listed. With --tolerance 1e-4 angles such as 1.5708 become 90 degrees.

    Tables are read from Markdown, LaTeX, HTML, MediaWiki, CSV, YAML and JSON, from printouts of the Robotics
    Toolbox, and from its scripts in MATLAB and Python, which are read as text and never run. What a table does not
    say, its convention or its units, is asked for.

    \b
    Examples:
      dh2sim import panda.urdf --tip panda_link8 -o panda.yaml
      dh2sim import arm.xml --base base_link --tip attachment_site
      dh2sim import urdf/ur.urdf.xacro --root . --arg ur_type:=ur5e --arg name:=ur
      dh2sim import table.md --convention modified --angle deg -o arm.yaml
      dh2sim import README.md --table 2
      dh2sim import mdl_puma560.m -o puma560.yaml
      dh2sim import my_robot_calibration.yaml --nominal ur5e -o my_ur5e.yaml
      dh2sim import calibration.conf --nominal ur10e
      dh2sim import - --convention standard < table.csv
    """
    from dh2sim.importing.sources import ImportOptions, import_data, read_file
    from dh2sim.robot.row import CONVENTIONS, Convention
    from dh2sim.robot.units import AngleUnit, LengthUnit

    require_free(out, force=force)
    options = ImportOptions(
        base=base,
        tip=tip,
        convention=choice(
            convention, Convention, "--convention", without=(Convention.HAYATI,), other_names=CONVENTIONS
        ),
        angle=choice(angle, AngleUnit, "--angle"),
        length=choice(length, LengthUnit, "--length"),
        table=table,
        tolerance=tolerance_of(tolerance),
        package_paths=tuple(package_path or ()),
        root=root,
        arguments=dict(map(_argument, arg or ())),
        nominal=nominal,
        name=name,
    )
    folder = Path.cwd() if out is None else out.resolve().parent
    data = read_file(Path(file))
    with errors_with_options():
        imported = import_data(data, file, options, folder=folder)
    notes = [*(_with_options(note) for note in imported.notes), *_other_masses(imported)]
    if as_json:
        hand_over_json(imported.text, out, imported.spec, notes, _residual(imported))
        return
    hand_over(imported.text, out, summary=summary(imported), notes=notes, quiet=quiet)


def _other_masses(imported: Imported) -> list[str]:
    """Return a sentence on masses that are not those of the source."""
    found = imported.mechanics
    if found is None or found.small:
        return []
    return [
        f"The mass matrix differs from the file's by up to {100 * found.mass_matrix:.2g} %, the forces of gravity by "
        f"{100 * found.gravity:.2g} %, most at {found.worst}: masses are estimated or left out, as said above."
    ]


def _residual(imported: Imported) -> dict[str, object] | None:
    residual = imported.residual
    if residual is None:
        return None
    return {
        "position": residual.position,
        "rotation": residual.rotation,
        "worst": residual.worst,
        "configurations": residual.configurations,
        **(
            {}
            if (found := imported.mechanics) is None
            else {"mass_matrix": found.mass_matrix, "gravity": found.gravity}
        ),
    }


def _read_axes_file(file: str) -> bytes:
    """Return the content of an axes file.

    Raises:
        Dh2simError: It cannot be read, or is something else: a robot file, a URDF, an MJCF, a table.
    """
    from dh2sim.importing.sources import read_file

    data = read_file(Path(file))
    kind = other_format(file)
    if kind is not None:
        raise Dh2simError(f"{file}: this is {kind}, not a list of axes: run 'dh2sim import {shlex.quote(file)}'")
    if re.search(rb"^joints\s*:", data, re.MULTILINE) and not re.search(rb"^axes\s*:", data, re.MULTILINE):
        raise Dh2simError(
            f"{file}: this is a robot file, not a list of axes; 'dh2sim info {shlex.quote(file)}' shows its table"
        )
    return data


def _argument(text: str) -> tuple[str, str]:
    """Return the name and the value of ``--arg``."""
    name, between, value = text.partition(":=")
    if not between or not name.strip():
        raise typer.BadParameter(f"must be NAME:=VALUE, got {text!r}", param_hint="--arg")
    return name.strip(), value


_XACRO = re.compile(r"arguments=\{'([^']*)': \.\.\.\}")
_ARGUMENT = re.compile(r"\b(tip|nominal|convention|angle|length|root|table)=('[^']*'|\"[^\"]*\"|\d+)")


@contextmanager
def errors_with_options() -> Iterator[None]:
    """Raise errors of an import with options in place of the library's arguments."""
    try:
        yield
    except ImportedFileError as error:
        raise ImportedFileError(
            replace(problem, message=_with_options(problem.message)) for problem in error.problems
        ) from error
    except Dh2simError as error:
        error.args = (_with_options(str(error)),)
        raise


def _with_options(message: str) -> str:
    """Return a message of the library with options for its arguments: ``--tip hand`` for ``tip='hand'``."""
    message = _XACRO.sub(r"--arg \1:=VALUE", message)
    return _ARGUMENT.sub(lambda found: f"--{found[1]} {shlex.quote(str(ast.literal_eval(found[2])))}", message)


def summary(imported: Imported) -> str:
    """Return one line on a robot file that was made."""
    from dh2sim.importing.serial import residual_text

    spec = imported.spec
    conventions = list(dict.fromkeys(row.convention.value for row in spec.rows))
    rows = f"{spec.name}, {len(spec.rows)} {'row' if len(spec.rows) == 1 else 'rows'}, {' and '.join(conventions)}"
    residual = imported.residual
    if residual is None:
        return rows
    text = f"{rows}; off by at most {residual_text(residual)} at {residual.configurations} configurations"
    found = imported.mechanics
    return text if found is None else f"{text}, its mass matrix by {found.mass_matrix:.1e}"


def frames(
    axes: Annotated[str, typer.Argument(metavar="AXES.yaml", help="File of joint axes: points and directions.")],
    convention: Annotated[
        str | None,
        typer.Option(metavar="standard|modified", help="Convention of the table. [default: the file's, or standard]"),
    ] = None,
    explain: Annotated[
        bool, typer.Option("--explain", help="Explain every step at the head of the robot file, and draw the frames.")
    ] = False,
    picture: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Picture of the frames: .svg, .png or .pdf. [default with --explain: NAME-frames.svg]",
        ),
    ] = None,
    tolerance: ToleranceOption = 1e-9,
    out: OutOption = None,
    force: ForceOption = False,
    quiet: _QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Assign DH frames to joint axes, step by step as in a textbook.

    The file lists the axes, base first, in base_link at joint coordinates zero:

    \b
      name: two_joints
      axes:
        - {type: revolute, point: [0, 0, 0], direction: [0, 0, 1]}
        - {type: prismatic, direction: [1, 0, 0]}
      tool: {xyz: [0.5, 0, 0.2]}

    Axes may intersect, be parallel, antiparallel, coincident, skew or nearly parallel.

    \b
    Examples:
      dh2sim frames axes.yaml
      dh2sim frames axes.yaml --explain -o arm.yaml
    """
    from dh2sim.importing.axes import import_axes
    from dh2sim.importing.source_errors import errors_of
    from dh2sim.robot.axes_file import read_axes
    from dh2sim.robot.row import CONVENTIONS, Convention

    chosen = choice(convention, Convention, "--convention", without=(Convention.HAYATI,), other_names=CONVENTIONS)
    allowed = tolerance_of(tolerance)
    if picture is not None:
        _require_frame_figure(picture)
    require_free(out, force=force)
    spec = read_axes(_read_axes_file(axes), file=axes, directory=Path(axes).parent)
    drawing = picture
    if drawing is None and explain:
        drawing = (out.parent if out is not None else Path()) / f"{spec.name}-frames.svg"
        try:
            _require_frame_figure(drawing)
        except MissingExtraError as error:
            drawing = None
            print(f"dh2sim: no picture is drawn: {error}", file=sys.stderr)
    require_free(drawing, force=force)
    folder = Path.cwd() if out is None else out.resolve().parent
    with errors_of(axes):
        imported = import_axes(spec, convention=chosen, tolerance=allowed, explain=explain, folder=folder)
    if as_json:
        hand_over_json(imported.text, out, imported.spec, imported.notes, _residual(imported))
    else:
        hand_over(imported.text, out, summary=summary(imported), notes=imported.notes, quiet=quiet)
    if drawing is not None:
        from dh2sim.draw.frame_figure.figure import draw_assignment

        draw_assignment(imported, drawing)
        if not quiet:
            print(printable(f"{drawing}: axes and frames"), file=sys.stderr if out is None or as_json else sys.stdout)


def _require_frame_figure(path: Path) -> None:
    from dh2sim.draw.frame_figure.figure import require_frame_figure

    require_frame_figure(path)


def convert(
    robot: RobotArgument,
    to: Annotated[str, typer.Option(metavar="standard|modified|compact", help="Form of the table to convert to.")],
    out: OutOption = None,
    force: ForceOption = False,
    quiet: _QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Write a robot's table in the other convention, or with every frame within reach of the arm.

    standard, modified: a and alpha move by one row; what is left over at the ends goes to base and tool.
    compact: rows that lead far out and back, as those of a calibrated robot do (d = 574 m), are rewritten, as
    Hayati rows where axes are nearly parallel; the other rows keep their numbers.

    The arm stays the same, which is checked at random configurations. Its DH frames change; masses and meshes are
    moved with them.

    \b
    Examples:
      dh2sim convert stanford --to modified
      dh2sim convert my_arm.yaml --to standard -o my_arm_standard.yaml
      dh2sim convert calibrated_ur5.yaml --to compact -o ur5_compact.yaml
    """
    from dh2sim.importing.convert import TableForm, convert_robot
    from dh2sim.robot.row import CONVENTIONS

    target = choice(to, TableForm, "--to", other_names=CONVENTIONS)
    require_free(out, force=force)
    spec = load_one(robot)
    folder = Path.cwd() if out is None else out.resolve().parent
    converted = convert_robot(spec, target or TableForm.STANDARD, folder=folder)
    if as_json:
        errors = {"position": converted.position_error, "rotation": converted.rotation_error}
        hand_over_json(
            converted.text,
            out,
            converted.spec,
            converted.notes,
            {**errors, "configurations": converted.configurations},
        )
        return
    hand_over(converted.text, out, summary=converted.summary, notes=converted.notes, quiet=quiet)


def hand_over_json(
    text: str, out: Path | None, spec: RobotSpec, notes: Iterable[str], residual: dict[str, object] | None
) -> None:
    """Print what was made as JSON; the robot file is in it, or written to ``out``."""
    if out is not None:
        hand_over(text, out, summary="", quiet=True)
    made: dict[str, object] = {"robot": spec.name, "rows": len(spec.rows)}
    made["conventions"] = list(dict.fromkeys(row.convention.value for row in spec.rows))
    made["residual"] = residual
    made["notes"] = list(notes)
    made |= {"text": text} if out is None else {"file": str(out)}
    print(json_text(made, ensure_ascii=False))
