"""Exporting a robot: render its files, verify them with MuJoCo, put them in place all at once; or compare with them.

Every export reports what its formats cannot hold of the robot file, so that nothing is lost in silence.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, fields
from enum import StrEnum
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from dh2sim.arguments import file_path, names
from dh2sim.errors import ArgumentError, EngineError, MismatchError, ModelError
from dh2sim.files import atomic_files, finish_interrupted
from dh2sim.formats.mjcf.scene import to_scene
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.formats.urdf.tree import DYNAMICS as URDF_DYNAMICS
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.input_files import read_input
from dh2sim.kinematics.loop_closure import constraint_jacobian
from dh2sim.kinematics.parallelograms import find_couplings
from dh2sim.kinematics.sampling import scattered_configurations
from dh2sim.kinematics.table_oracle import table_frame_poses, table_mechanism_frames, table_tool_pose
from dh2sim.kinematics.transforms import pose_errors
from dh2sim.messages import counted, listed, member
from dh2sim.model.mechanism import AnyModel, MechanismModel, written_model
from dh2sim.model.robot_model import FilledIn
from dh2sim.mujoco_warnings import mujoco_warnings, warning_sentences
from dh2sim.robot.row import ActuatorSpec, ActuatorType, Dynamics
from dh2sim.robot.spec import SpecLike


class Format(StrEnum):
    """A format of an export."""

    URDF = "urdf"
    MJCF = "mjcf"


def render(model: AnyModel, formats: Collection[Format], *, dh_frames: bool = True) -> dict[str, bytes]:
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
            raise ModelError(f"{model.name}: its MJCF and its scene would both be scene.xml; rename the robot")
        files[f"{model.name}.xml"] = to_mjcf(model).encode()
        files["scene.xml"] = to_scene(model).encode()
    for link in model.all_links:
        if link.mesh is not None:
            files[f"meshes/{link.mesh.file_name}"] = link.mesh.data
    return files


STANDARD_GRAVITY = (0.0, 0.0, -9.81)


class Lost(StrEnum):
    """What a format may be unable to hold."""

    ACTUATORS = "actuators and their gains"
    DYNAMICS = "dynamics"
    CONFIGURATIONS = "configurations"
    GRAVITY = "gravity"
    EXCLUSIONS = "pairs of links that do not collide"
    VELOCITY = "velocity limits"
    ACCELERATION = "limits of acceleration and jerk"
    CLOSURES = "joints that close loops"
    APPEARANCE = "colours and textures of meshes"


@dataclass(frozen=True, slots=True, kw_only=True)
class Loss:
    """Something in the robot file that an export leaves out."""

    what: Lost
    format: Format | None
    """None where no format can hold it."""
    where: tuple[str, ...] = ()
    """Names of the joints, links or configurations; ``a-b`` for a pair of links."""
    detail: str = ""
    """The key of a joint's dynamics, or the suffix of a mesh file."""

    def __str__(self) -> str:
        """Return it in words, such as ``URDF: armature of joint_1``."""
        names = listed(self.where)
        words: str = self.what
        match self.what:
            case Lost.DYNAMICS:
                words = f"{self.detail} of {names}"
            case Lost.VELOCITY | Lost.ACCELERATION | Lost.CLOSURES:
                words = f"{self.what}: {names}" if self.what is Lost.CLOSURES else f"{self.what} of {names}"
            case Lost.CONFIGURATIONS:
                words = f"{self.what} ({names})"
            case Lost.EXCLUSIONS:
                pairs = "1 pair" if len(self.where) == 1 else f"{len(self.where)} pairs"
                words = f"{pairs} of links that do not collide ('dh2sim info --srdf' lists them)"
            case Lost.APPEARANCE:
                words = (
                    f"mesh of {names}: converted from {self.detail} to binary STL, which has no colours or textures"
                )
        return words if self.format is None else f"{self.format.upper()}: {words}"


def losses(model: AnyModel, formats: Collection[Format]) -> list[Loss]:
    """List what is in the robot file and the formats cannot hold."""
    found: list[Loss] = []
    if Format.URDF in formats:
        found += _lost_in_urdf(model)
    if Format.MJCF in formats:
        found += _lost_in_mjcf(model)
    limited = [row for row in model.spec.rows if row.limits.acceleration is not None or row.limits.jerk is not None]
    if limited:
        found.append(Loss(what=Lost.ACCELERATION, format=None, where=tuple(row.name for row in limited)))
    for link in model.all_links:
        if link.mesh is not None and link.mesh.converted_from is not None:
            suffix = link.mesh.converted_from
            found.append(Loss(what=Lost.APPEARANCE, format=None, where=(link.name,), detail=suffix))
    return found


def _lost_in_urdf(model: AnyModel) -> Iterator[Loss]:
    spec, urdf = model.spec, Format.URDF
    kept = find_couplings(spec).closures if spec.closures else ()  # by joints that mimic others
    if lost := tuple(closure.name for closure in spec.closures if closure.name not in kept):
        yield Loss(what=Lost.CLOSURES, format=urdf, where=lost)
    if any(_drives(row.actuator) for row in spec.moving_rows):
        yield Loss(what=Lost.ACTUATORS, format=urdf)
    for key in (field.name for field in fields(Dynamics) if field.name not in URDF_DYNAMICS):
        if names := tuple(row.name for row in spec.all_rows if getattr(row.dynamics, key)):
            yield Loss(what=Lost.DYNAMICS, format=urdf, where=names, detail=key)
    if spec.configurations:
        yield Loss(what=Lost.CONFIGURATIONS, format=urdf, where=tuple(spec.configurations))
    if tuple(float(g) for g in spec.gravity) != STANDARD_GRAVITY:
        yield Loss(what=Lost.GRAVITY, format=urdf)
    if model.excluded:
        pairs = tuple(f"{pair.link1}-{pair.link2}" for pair in model.excluded)
        yield Loss(what=Lost.EXCLUSIONS, format=urdf, where=pairs)


def _lost_in_mjcf(model: AnyModel) -> Iterator[Loss]:
    names = tuple(
        row.name
        for row in model.spec.all_rows
        if row.limits.velocity is not None and row.actuator.type is not ActuatorType.VELOCITY
    )
    if names:
        yield Loss(what=Lost.VELOCITY, format=Format.MJCF, where=names)


def _drives(actuator: ActuatorSpec) -> bool:
    """Whether the robot file drives the joint in a way of its own; 'none' is what a URDF has anyway."""
    of_its_own = actuator.type in (ActuatorType.VELOCITY, ActuatorType.MOTOR)
    return of_its_own or actuator.kp is not None or actuator.kv is not None


TOLERANCE = 1e-12
"""Of rotations in rad, and of positions as a share of the larger of 1 m and the reach; more for very large angles."""
SAMPLES = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Verified:
    """How far the poses that MuJoCo reads from a file are from the table's."""

    format: Format
    position_error: float
    """Greatest distance, m."""
    rotation_error: float
    """Greatest angle, rad."""


def verify_files(model: AnyModel, folder: Path, formats: Collection[Format]) -> list[Verified]:
    """Compare all frames of the files in ``folder`` with the table at scattered configurations.

    Raises:
        EngineError: MuJoCo refuses a file.
        MismatchError: a pose differs by more than rounding.
    """
    if isinstance(model, MechanismModel):
        return _verify_mechanism(model, folder, formats)
    from dh2sim.engines.mujoco_engine import MujocoEngine

    q = scattered_configurations(*model.travel, SAMPLES)
    table = np.concatenate([table_frame_poses(model.spec, q), table_tool_pose(model.spec, q)[:, None]], axis=1)
    names = [joint.name for joint in model.moving_joints]
    results = []
    for format_ in formats:
        path = folder / f"{model.name}.{'urdf' if format_ is Format.URDF else 'xml'}"
        try:
            engine = MujocoEngine(path, names, len(model.joints))
            poses = engine.frame_poses(q)
        except EngineError as error:
            reason = str(error).replace(str(path), path.name)  # without the temporary folder
            raise EngineError(f"{model.name}: {reason}; nothing was written") from error
        reference = table if len(engine.frames) > 1 else table[:, -1:]
        position, rotation = pose_errors(poses, reference)
        result = Verified(
            format=format_, position_error=float(np.max(position)), rotation_error=float(np.max(rotation))
        )
        angle = max(TOLERANCE, model.angle_rounding)
        allowed = angle * max(1.0, model.extent)
        if not (result.position_error <= allowed and result.rotation_error <= angle):
            raise MismatchError(
                f"{model.name}: the {format_.value.upper()} differs from the table by {result.position_error:.3g} m "
                f"and {result.rotation_error:.3g} rad (allowed: {allowed:.3g} m and {angle:.3g} rad); nothing "
                "was written. This is a defect of dh2sim: please report it with the robot file"
            )
        results.append(result)
    return results


def _verify_mechanism(model: MechanismModel, folder: Path, formats: Collection[Format]) -> list[Verified]:
    """Compare all frames with the tables at scattered configurations, and the loops with ours at home.

    Raises:
        EngineError: MuJoCo refuses a file.
        MismatchError: A pose differs by more than rounding, a loop is open, or its constraints have another rank.
    """
    from dh2sim.engines.mujoco_mechanism import MujocoMechanism

    lower, upper = (np.array([joint.travel[side] for joint in model.moving_joints]) for side in (0, 1))
    q = scattered_configurations(lower, upper, SAMPLES)
    results = []
    for format_ in formats:
        engine = MujocoMechanism(folder / f"{model.name}.{'urdf' if format_ is Format.URDF else 'xml'}")
        names = [joint.name for joint in model.moving_joints]
        position, rotation = 0.0, 0.0
        for vector in q:
            poses = engine.frame_poses(dict(zip(names, vector.tolist(), strict=True)))
            reference = table_mechanism_frames(model.spec, vector)
            found = [name for name in reference if name in poses]
            errors = pose_errors(np.array([poses[k] for k in found]), np.array([reference[k] for k in found]))
            position = max(position, float(np.max(errors[0])))
            rotation = max(rotation, float(np.max(errors[1])))
        allowed = TOLERANCE * max(1.0, model.size)
        faults = [] if position <= allowed and rotation <= TOLERANCE else ["differs from the table"]
        if format_ is Format.MJCF and model.tree.closures:
            gap, freedoms = engine.loops_at_home()
            own = model.tree.n - int(np.linalg.matrix_rank(constraint_jacobian(model.tree, model.q), tol=1e-8))
            faults += [f"leaves loops open by {gap:.3g} m"] if gap > allowed else []
            faults += [f"leaves {counted(freedoms, 'freedom')} at home instead of {own}"] if freedoms != own else []
        if faults:
            raise MismatchError(
                f"{model.name}: the {format_.value.upper()} {listed(faults, ' and ')} ({position:.3g} m, "
                f"{rotation:.3g} rad); nothing was written. This is a defect of dh2sim: please report it with the "
                "robot file"
            )
        results.append(Verified(format=format_, position_error=position, rotation_error=rotation))
    return results


ALL_FORMATS = (Format.URDF, Format.MJCF)


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportedFile:
    """A file that an export put in place."""

    path: Path
    size: int
    """Bytes."""
    changed: bool
    """Whether it differs from the file that was there before."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportReport:
    """What an export did."""

    name: str
    files: tuple[ExportedFile, ...]
    verified: tuple[Verified, ...]
    """Empty without verification."""
    losses: tuple[Loss, ...]
    """What is in the robot file and the formats cannot hold."""
    estimates: tuple[FilledIn, ...]
    """Masses and inertias that were estimated from the shapes."""
    assumptions: tuple[FilledIn, ...]
    """Limits that were assumed."""
    warnings: tuple[str, ...] = ()
    """What MuJoCo finds questionable in the files, one sentence each."""

    def __repr__(self) -> str:
        files = listed(file.path.name for file in self.files)
        checked = "compared with the table" if self.verified else "not compared with the table"
        return f"<ExportReport of '{self.name}': {files}; {checked}>"

    def to_json(self) -> dict[str, Any]:
        """Return the entry of the ``robots`` list that ``dh2sim export --json`` prints."""
        return {
            "name": self.name,
            "files": [{"path": str(file.path), "bytes": file.size, "changed": file.changed} for file in self.files],
            "verified": [
                {
                    "format": each.format.value,
                    "max_position_error": each.position_error,
                    "max_rotation_error": each.rotation_error,
                }
                for each in self.verified
            ],
            "losses": [str(loss) for loss in self.losses],
            "estimates": [str(entry) for entry in self.estimates],
            "assumptions": [str(entry) for entry in self.assumptions],
            "warnings": list(self.warnings),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Drift:
    """A file on disk that is not what an export would write, or a folder with files of different exports."""

    path: Path
    what: str
    """'missing', 'unreadable: …', where it differs, or of a folder, which files of different exports it contains."""


def export_robot(
    robot: SpecLike,
    out: str | PathLike[str] = "generated",
    *,
    formats: Iterable[Format | str] | Format | str = ALL_FORMATS,
    dh_frames: bool = True,
    verify: bool = True,
    wait: bool = True,
    waiting: Callable[[Path], None] | None = None,
) -> ExportReport:
    """Write a robot's files to ``out``/<name>/, all of them or none; a file that is the same already is left alone.

    Args:
        robot: the robot, in any form.
        out: the folder that holds a folder for each robot.
        formats: 'urdf', 'mjcf' or both.
        dh_frames: whether the URDF has a link for every DH frame.
        verify: whether to compare the written files with the table before they are put in place.
        wait: whether to wait while another process writes the files of this robot, or to raise an error.
        waiting: called once with the folder if that takes longer than a moment.

    Returns:
        What was written, how well it matches, and what the formats cannot hold.

    Raises:
        ArgumentError: an argument is of a wrong kind, or no format is given.
        ModelError: a format cannot hold the robot.
        EngineError: MuJoCo refuses a file.
        MismatchError: a file's poses differ from the table's.
        OutputError: the files cannot be written. In each case the files that were there before are untouched.
    """
    folder = file_path("out", out)
    wanted = list(dict.fromkeys(member(Format, name, "format") for name in names("formats", formats)))
    if not wanted:
        raise ArgumentError(f"formats must be at least one of {listed(Format)}")
    model = written_model(robot)
    files = render(model, wanted, dh_frames=dh_frames)
    target = folder / model.name
    checks: list[Verified] = []
    warned: list[str] = []
    with atomic_files(folder, model.name, wait=wait, waiting=waiting) as staging:
        for relative, data in files.items():
            (staging / relative).parent.mkdir(parents=True, exist_ok=True)
            (staging / relative).write_bytes(data)
        if verify:
            with mujoco_warnings() as warned:
                checks = verify_files(model, staging, wanted)
        unchanged = {relative for relative, data in files.items() if _holds(target / relative, data)}
    return ExportReport(
        name=model.name,
        files=tuple(
            ExportedFile(path=target / relative, size=len(data), changed=relative not in unchanged)
            for relative, data in files.items()
        ),
        verified=tuple(checks),
        losses=tuple(losses(model, wanted)),
        estimates=model.estimates,
        assumptions=model.assumptions,
        warnings=warning_sentences(warned, [joint.name for joint in model.moving_joints]),
    )


_ORIGIN = re.compile(rb": made by dh2sim from (.+)\.\r?\n")
_HEADER = 4096
"""Bytes at the beginning of a file that contain its origin."""
_SHOWN = 12
"""Digits of a hash that messages show."""


def mixture(model: AnyModel, folder: Path, formats: Collection[Format] = ALL_FORMATS) -> str:
    """Return a sentence if the files of a robot come from different robot files, or an empty text.

    The first line of each says which, with its SHA-256. Files without such a line were not exported, and are ignored.

    Args:
        model: The robot.
        folder: The folder with its files.
        formats: What to look at.
    """
    names: dict[str, list[str]] = {}
    for relative in _names(model, formats):
        origin = _origin(folder / relative)
        if origin is not None:
            names.setdefault(origin, []).append(relative)
    if len(names) < 2:
        return ""
    parts = "; ".join(f"{listed(files)} from {_shortened(origin)}" for origin, files in names.items())
    return f"contains files of different exports: {parts}"


def _names(model: AnyModel, formats: Collection[Format]) -> list[str]:
    urdf = [f"{model.name}.urdf"] if Format.URDF in formats else []
    return [*urdf, *([f"{model.name}.xml", "scene.xml"] if Format.MJCF in formats else [])]


def _origin(path: Path) -> str | None:
    try:
        found = _ORIGIN.search(read_input(path, _HEADER))
    except OSError:
        return None
    return None if found is None else found[1].decode("utf-8", "replace")


def _shortened(origin: str) -> str:
    return re.sub(rf"(SHA-256 [0-9a-f]{{{_SHOWN}}})[0-9a-f]+", r"\1…", origin)


def drift(
    model: AnyModel,
    out: Path,
    *,
    formats: Collection[Format] = ALL_FORMATS,
    dh_frames: bool = True,
) -> list[Drift]:
    """Compare ``out``/<name>/ with what an export would write there, byte for byte.

    Files of an export that was killed while it moved them are put in place first.

    Raises:
        ModelError: a format cannot hold the robot.
        OutputError: the rest of an export that was killed cannot be put in place.
    """
    finish_interrupted(out, model.name)
    found = []
    for relative, expected in render(model, formats, dh_frames=dh_frames).items():
        path = out / model.name / relative
        try:
            actual = read_input(path, 2 * len(expected))  # every line end may be longer
        except FileNotFoundError:
            found.append(Drift(path=path, what="missing"))
        except OSError as error:
            found.append(Drift(path=path, what=f"unreadable: {error.strerror or error}"))
        else:
            if actual != expected:
                found.append(Drift(path=path, what=_difference(actual, expected)))
    mixed = mixture(model, out / model.name, formats)
    if mixed:
        found.append(Drift(path=out / model.name, what=mixed))
    return found


def _holds(path: Path, data: bytes) -> bool:
    try:
        return read_input(path, len(data)) == data
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
