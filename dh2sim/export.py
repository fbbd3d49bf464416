"""Files: written whole or not at all, verified before they are put in place.

RobotModel -> the files of its export, as bytes.

What a format cannot carry of what a robot file says: told at every export, so that nothing is lost in silence.

Do the files that were written hold the table? Asked of MuJoCo, which reads both formats.

Exporting one robot: render, stage, verify, put in place; or compare with what stands on disk.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from dh2sim.errors import EngineError, MismatchError, ModelError
from dh2sim.files import put_in_place, staged
from dh2sim.formats.mjcf.scene import to_scene
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.kinematics.sampling import scattered_configurations
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.kinematics.transforms import pose_errors
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.spec import ActuatorSpec, ActuatorType
from dh2sim.typing import Array


class Format(StrEnum):
    """What a robot can be exported as."""

    URDF = "urdf"
    MJCF = "mjcf"


def render(model: RobotModel, formats: Collection[Format], *, dh_frames: bool = True) -> dict[str, bytes]:
    """Return the files of an export.

    Args:
        model: the robot.
        formats: what to write.
        dh_frames: whether the URDF has a link for every DH frame.

    Returns:
        Contents by path relative to the robot's folder, with forward slashes.

    Raises:
        ModelError: a format cannot hold the robot, or its name is that of another file.
    """
    files: dict[str, bytes] = {}
    if Format.URDF in formats:
        files[f"{model.name}.urdf"] = to_urdf(model, dh_frames=dh_frames).encode()
    if Format.MJCF in formats:
        if model.name.lower() == "scene":
            raise ModelError(
                f"{model.name}: its MJCF and the scene around it would both be scene.xml; rename the robot"
            )
        files[f"{model.name}.xml"] = to_mjcf(model).encode()
        files["scene.xml"] = to_scene(model).encode()
    for link in model.all_links:
        if link.mesh is not None:
            files[f"meshes/{link.mesh.file_name}"] = link.mesh.data
    return files


STANDARD_GRAVITY = (0.0, 0.0, -9.81)


def losses(model: RobotModel, formats: Collection[Format]) -> list[str]:
    """List what the robot file says and the formats leave out, a line each, beginning with the format's name."""
    lines = []
    if Format.URDF in formats:
        lines += [f"URDF: {loss}" for loss in _urdf(model)]
    if Format.MJCF in formats:
        lines += [f"MJCF: {loss}" for loss in _mjcf(model)]
    for link in model.all_links:
        if link.mesh is not None and link.mesh.converted_from is not None:
            lines.append(
                f"mesh of {link.name}: converted from {link.mesh.converted_from} to binary STL, "
                "which has no colours or textures"
            )
    return lines


def _urdf(model: RobotModel) -> Iterable[str]:
    if any(_said(row.actuator) for row in model.spec.moving_rows):
        yield "actuators and their gains"
    armature = [row.name for row in model.spec.rows if row.dynamics.armature]
    if armature:
        yield f"armature of {', '.join(armature)}"
    if model.spec.configurations:
        yield f"configurations ({', '.join(model.spec.configurations)})"
    if tuple(float(g) for g in model.spec.gravity) != STANDARD_GRAVITY:
        yield "gravity"
    if model.excluded:
        count = len(model.excluded)
        pairs = "1 pair" if count == 1 else f"{count} pairs"
        yield f"{pairs} of links that do not collide ('dh2sim info' lists them, as in an SRDF)"


def _mjcf(model: RobotModel) -> Iterable[str]:
    velocity = [
        row.name
        for row in model.spec.rows
        if row.limits.velocity is not None and row.actuator.type is not ActuatorType.VELOCITY
    ]
    if velocity:
        yield f"velocity limits of {', '.join(velocity)}"


def _said(actuator: ActuatorSpec) -> bool:
    """Whether the robot file drives the joint in a way of its own; 'none' is what a URDF has anyway."""
    of_its_own = actuator.type in (ActuatorType.VELOCITY, ActuatorType.MOTOR)
    return of_its_own or actuator.kp is not None or actuator.kv is not None


TOLERANCE = 1e-12
"""Of rotations in rad, and of positions as a share of the larger of 1 m and the reach."""
SAMPLES = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Verified:
    """How far the poses that MuJoCo reads from a file are from the table's."""

    format: Format
    position_error: float
    """Greatest distance, m."""
    rotation_error: float
    """Greatest angle, rad."""


def sampling_limits(model: RobotModel) -> tuple[Array, Array]:
    """Lower and upper joint coordinates to sample between, rad and m, shape (n,) each; ±π for continuous joints."""
    ranges = [joint.range for joint in model.moving_joints]
    lower = [-np.pi if r is None else r.lower for r in ranges]
    upper = [np.pi if r is None else r.upper for r in ranges]
    return np.array(lower, dtype=np.float64), np.array(upper, dtype=np.float64)


def verify(model: RobotModel, folder: Path, formats: Collection[Format]) -> list[Verified]:
    """Compare all frames of the files in ``folder`` with the table at scattered configurations.

    Raises:
        EngineError: MuJoCo refuses a file.
        MismatchError: a pose differs by more than rounding.
    """
    from dh2sim.engines.mujoco_engine import MujocoEngine

    lower, upper = sampling_limits(model)
    q = scattered_configurations(lower, upper, SAMPLES)
    table = np.concatenate([table_frame_poses(model.spec, q), table_tool_pose(model.spec, q)[:, None]], axis=1)
    names = [joint.name for joint in model.moving_joints]
    results = []
    for format_ in formats:
        path = folder / f"{model.name}.{'urdf' if format_ is Format.URDF else 'xml'}"
        try:
            engine = MujocoEngine(path, names, len(model.joints))
        except EngineError as error:
            told = str(error).replace(str(path), path.name)  # the temporary folder is nobody's business
            raise EngineError(f"{model.name}: {told}; nothing was written") from error
        reference = table if len(engine.frames) > 1 else table[:, -1:]
        position, rotation = pose_errors(engine.frame_poses(q), reference)
        result = Verified(
            format=format_, position_error=float(np.max(position)), rotation_error=float(np.max(rotation))
        )
        allowed = TOLERANCE * max(1.0, model.reach)
        if not (result.position_error <= allowed and result.rotation_error <= TOLERANCE):
            raise MismatchError(
                f"{model.name}: the {format_.value.upper()} differs from the table by {result.position_error:.3g} m "
                f"and {result.rotation_error:.3g} rad (allowed: {allowed:.3g} m and {TOLERANCE:.3g} rad); nothing "
                "was written. This is a defect of dh2sim: please report it with the robot file"
            )
        results.append(result)
    return results


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
