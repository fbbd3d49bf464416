"""Robot files to RobotSpecs."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from dh2sim.errors import Dh2simError, UnknownRobotError
from dh2sim.robot.catalog import builtin_path, builtin_robots
from dh2sim.robot.checks import check
from dh2sim.robot.compose import compose
from dh2sim.robot.convert import to_spec
from dh2sim.robot.document import MAX_BYTES, check_size, decode
from dh2sim.robot.fields import Context
from dh2sim.robot.parameters import evaluate_parameters
from dh2sim.robot.report import Report
from dh2sim.robot.spec import RobotSpec, SourceFile
from dh2sim.robot.structure import read_structure
from dh2sim.robot.words import did_you_mean, listed, shown


def load_robot(path_or_name: str | os.PathLike[str]) -> RobotSpec:
    """Return the robot that a file describes.

    Args:
        path_or_name: A robot file; or the name of a robot that comes with dh2sim, with or without ``.yaml``.
            A path that exists wins.

    Raises:
        UnknownRobotError: There is neither such a file nor such a robot.
        RobotFileError: The file is wrong; the error holds everything that is.
        Dh2simError: The file cannot be read.
    """
    given = os.fsdecode(path_or_name)
    path, file = _find(given)
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
            size = max(len(data), os.fstat(stream.fileno()).st_size)
    except OSError as error:
        raise Dh2simError(f"{given}: cannot be read: {error.strerror or error}") from error
    check_size(size, Report(file))
    return parse_robot(data, file=file, directory=path.parent)


def parse_robot(
    text: str | bytes, *, file: str = "<string>", directory: Path | None = None, mesh_files: bool = True
) -> RobotSpec:
    """Return the robot that the text of a robot file describes.

    Args:
        text: The file's content.
        file: Its name, for messages.
        directory: Where paths in it start; by default the current folder.
        mesh_files: Whether it may name mesh files; if not, no path in it is followed.

    Raises:
        RobotFileError: The text is wrong; the error holds everything that is.
    """
    data = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
    report = Report(file)
    decoded = decode(data, report)
    root = compose(decoded, report)
    parameters = evaluate_parameters(root, report)
    folder = directory or Path.cwd()
    context = Context(parameters=parameters, directory=folder if mesh_files else None)
    entry = read_structure(root, context, report)
    check(root, parameters, report)
    if entry is None or report.problems:
        raise report.error()
    source = SourceFile(name=Path(file).name, path=file, text=decoded, sha256=hashlib.sha256(data).hexdigest())
    return to_spec(entry, root, source)


def _find(given: str) -> tuple[Path, str]:
    """Return the file that a path or a name stands for, and what messages call it."""
    path = Path(given)
    if given and os.path.lexists(given):
        if path.is_dir():
            named = given in builtin_robots()
            hint = f"; '{given}.yaml' is the robot that comes with dh2sim" if named else ""
            raise Dh2simError(f"{given}: is a folder, not a robot file{hint}")
        return path, given
    builtin = builtin_path(given)
    if builtin is not None:
        return builtin, builtin.name
    known = builtin_robots()
    hint = did_you_mean(given.removesuffix(".yaml"), known)
    list_of_them = f"Robots that come with dh2sim: {listed(known)}"
    raise UnknownRobotError(f"there is no file and no robot named {shown(given)}.{hint} {list_of_them}")
