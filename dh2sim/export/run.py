"""Exporting one robot: render, stage, verify, put in place; or compare with what stands on disk."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from dh2sim.export.losses import losses
from dh2sim.export.render import Format, render
from dh2sim.export.transaction import put_in_place, staged
from dh2sim.export.verify import Verified, verify
from dh2sim.model.robot_model import RobotModel

ALL_FORMATS = (Format.URDF, Format.MJCF)


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportedFile:
    """A file that an export put in place."""

    path: Path
    size: int
    """Bytes."""
    changed: bool
    """Whether it differs from what stood there before."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportReport:
    """What an export did."""

    name: str
    files: tuple[ExportedFile, ...]
    verified: tuple[Verified, ...]
    """Empty where verification was left out."""
    losses: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Drift:
    """A file on disk that is not what an export would write."""

    path: Path
    what: str
    """'missing', 'unreadable: …' or where it differs."""


def export_robot(
    model: RobotModel,
    out: Path,
    *,
    formats: Collection[Format] = ALL_FORMATS,
    dh_frames: bool = True,
    verified: bool = True,
) -> ExportReport:
    """Write a robot's files to ``out``/<name>/, all of them or none; a file that is the same already is left alone.

    Args:
        model: the robot.
        out: the folder that holds a folder for each robot.
        formats: what to write.
        dh_frames: whether the URDF has a link for every DH frame.
        verified: whether to compare the written files with the table before they are put in place.

    Returns:
        What was written, how well it matches, and what the formats cannot carry.

    Raises:
        ModelError: a format cannot hold the robot.
        EngineError: MuJoCo refuses a file.
        MismatchError: a file's poses differ from the table's.
        OutputError: the files cannot be written. In each case what stood there before stands untouched.
    """
    files = render(model, formats, dh_frames=dh_frames)
    target = out / model.name
    with staged(out, model.name, files) as folder:
        checks = verify(model, folder, formats) if verified else []
        changed = [relative for relative, data in files.items() if not _holds(target / relative, data)]
        put_in_place(folder, target, changed)
    return ExportReport(
        name=model.name,
        files=tuple(
            ExportedFile(path=target / relative, size=len(data), changed=relative in changed)
            for relative, data in files.items()
        ),
        verified=tuple(checks),
        losses=tuple(losses(model, formats)),
    )


def drift(
    model: RobotModel, out: Path, *, formats: Collection[Format] = ALL_FORMATS, dh_frames: bool = True
) -> list[Drift]:
    """Compare ``out``/<name>/ with what an export would write there, byte for byte.

    Raises:
        ModelError: a format cannot hold the robot.
    """
    found = []
    for relative, expected in render(model, formats, dh_frames=dh_frames).items():
        path = out / model.name / relative
        try:
            actual = path.read_bytes()
        except FileNotFoundError:
            found.append(Drift(path=path, what="missing"))
        except OSError as error:
            found.append(Drift(path=path, what=f"unreadable: {error.strerror or error}"))
        else:
            if actual != expected:
                found.append(Drift(path=path, what=_difference(actual, expected)))
    return found


def _holds(path: Path, data: bytes) -> bool:
    try:
        return path.read_bytes() == data
    except OSError:
        return False


def _difference(actual: bytes, expected: bytes) -> str:
    if b"\0" in expected:
        return "differs"
    ours, theirs = actual.splitlines(), expected.splitlines()
    if ours == theirs:
        return "differs in its line ends"
    for line, (a, b) in enumerate(zip(ours, theirs, strict=False), start=1):
        if a != b:
            return f"differs from line {line}"
    return f"differs from line {min(len(ours), len(theirs)) + 1}"
