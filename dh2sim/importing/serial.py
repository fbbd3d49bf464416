"""Serial robots of any format to robot files: the table is recovered, all else carried over, the text compared."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from dh2sim.errors import MismatchError
from dh2sim.formats.serial_robot import SerialLink, SerialMesh, SerialRobot
from dh2sim.importing.mechanics import measure_mechanics
from dh2sim.importing.result import Imported
from dh2sim.importing.source_errors import MADE
from dh2sim.kinematics.frame_assignment.recover import (
    CONFIGURATIONS,
    Recovery,
    Residual,
    measure_residual,
    recover_table,
    within,
)
from dh2sim.kinematics.frame_assignment.result import Step, Tolerances
from dh2sim.kinematics.frame_assignment.rounding import simple_angles, simple_length, simple_turn, simple_vector
from dh2sim.kinematics.transforms import invert, pose_from_rpy, rotate_tensor, rpy_from_rotation
from dh2sim.messages import Notes, listed, shown
from dh2sim.model.mass import is_possible, made_possible, substantial
from dh2sim.robot.fields import LONGEST_NAME, is_reserved, name_problem
from dh2sim.robot.links import BaseSpec, LinkSpec, MeshSpec, Pose
from dh2sim.robot.magnitudes import (
    ANGLE,
    ARMATURE,
    DAMPING,
    EFFORT,
    FRICTION,
    INERTIA,
    LENGTH,
    MASS,
    POSITION_GAIN,
    SCALE,
    VELOCITY_GAIN,
    Magnitude,
)
from dh2sim.robot.read import parse_robot
from dh2sim.robot.row import ActuatorSpec, Convention, Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.write import robot_file_text
from dh2sim.typing import Array, read_only

_FALLBACK = "robot"


def robot_name(name: str) -> str:
    """Return a name that a robot file allows, as close to ``name`` as possible."""
    return _legal(name) or _FALLBACK


def joint_names(names: Sequence[str]) -> tuple[tuple[str, ...], list[str]]:
    """Return names that a robot file allows, all different, and a sentence for each that had to be changed.

    Args:
        names: The joints' names, base first; empty for a joint without a name.
    """
    taken = {name for name in names if _fits(name)}
    used: set[str] = set()
    changed, notes = [], []
    for i, name in enumerate(names, start=1):
        new = name
        if not _fits(name) or name in used:
            stem = _legal(name) or f"joint_{i}"
            new = next(n for n in (stem, *(f"{stem}_{k}" for k in range(2, len(names) + 3))) if n not in taken | used)
            if name:
                notes.append(f"Joint {shown(name)} is named {new} here, as a robot file does not allow its name.")
        used.add(new)
        changed.append(new)
    return tuple(changed), notes


def _fits(name: str) -> bool:
    return name_problem(name) is None and not is_reserved(name)


def _legal(name: str) -> str:
    """Return the name with forbidden characters replaced; empty if nothing is left."""
    cleaned = re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_-")
    if cleaned and not cleaned[0].isalpha():
        cleaned = f"n{cleaned}"
    cleaned = cleaned[: LONGEST_NAME - 8]
    return f"{cleaned}_" if is_reserved(cleaned) else cleaned


_STEP = math.radians(15.0)
_LOOKS_ROUNDED = 1e-5
"""rad: 1.5708, 3.1416 and 0.7854 are closer than that to a multiple of 15 degrees; calibrated angles seldom are."""


def simpler_with(spec: RobotSpec, tolerance: float) -> str | None:
    """Return a sentence on angles that the source seems to have rounded, or None.

    Args:
        spec: A table within the tolerance.
        tolerance: That it was made with.
    """
    gaps = {where: gap for where, angle in _angles(spec) if tolerance < (gap := _gap(angle)) <= _LOOKS_ROUNDED}
    if not gaps:
        return None
    where = max(gaps, key=gaps.__getitem__)
    wider = 10.0 ** math.ceil(math.log10(10.0 * gaps[where]))
    return (
        f"Angles look rounded in the source: {where} is {gaps[where]:.1e} rad off a multiple of 15 degrees. "
        f"A tolerance of {wider:.0e} makes such numbers simple, if a residual of that size is good enough."
    )


def _angles(spec: RobotSpec) -> Iterator[tuple[str, float]]:
    for row in spec.rows:
        yield f"theta of {row.name}", row.theta
        if row.convention is not Convention.HAYATI:  # whose twists are small on purpose
            yield f"alpha of {row.name}", row.alpha


def _gap(angle: float) -> float:
    return abs(angle - _STEP * round(angle / _STEP))


_DIGITS = range(6, 16)
"""That an inertia may be written with; those of most files have six at most."""
_ROUNDING = 1e-15
"""Of an inertia, relative to its trace: what turning it may change."""


def assemble(robot: SerialRobot, recovery: Recovery, *, name: str, joint_names: Sequence[str]) -> RobotSpec:
    """Return the robot with its table, limits, dynamics, actuators, masses and meshes.

    What the file gives in a link's own frame is given in DH frame i here.

    Args:
        robot: As read from its file.
        recovery: Its table.
        name: Of the robot; one that a robot file allows.
        joint_names: Of the joints, base first; names that a robot file allows.
    """
    tolerances = recovery.tolerances
    actuators = robot.actuators or [ActuatorSpec()] * len(robot.links)
    rows = [
        replace(
            row,
            name=joint_name,
            limits=_limits(limits, row, tolerances),
            dynamics=dynamics,
            actuator=actuator,
            link=link,
        )
        for row, joint_name, limits, dynamics, actuator, link in zip(
            recovery.spec.rows,
            joint_names,
            robot.limits,
            robot.dynamics,
            actuators,
            _links(robot, recovery),
            strict=True,
        )
    ]
    base = recovery.spec.base.pose
    T_dh0_base = invert(pose_from_rpy(base.xyz, base.rpy))
    return replace(
        recovery.spec,
        name=name,
        rows=tuple(rows),
        base=BaseSpec(pose=base, mesh=_mesh(robot.base.mesh, T_dh0_base, tolerances), color=robot.base.color),
        gravity=robot.gravity,
        configurations=robot.configurations,
    )


def _links(robot: SerialRobot, recovery: Recovery) -> list[LinkSpec]:
    return [
        _link(link, invert(T_link_dh), recovery.tolerances)
        for link, T_link_dh in zip(robot.links, recovery.T_link_dh, strict=True)
    ]


def _without_invented_masses(robot: SerialRobot) -> tuple[SerialRobot, list[str]]:
    """Let links weigh nothing of which the file gives no mass, and return a sentence on them.

    So simulators read the file: several joints on one body, or a link to hang two joints on. Where nothing behind a
    joint has mass its motion would be undetermined; links at the end are estimated, as all are in a file without
    masses.
    """
    given = [i for i, link in enumerate(robot.links) if link.mass is not None]
    last = given[-1] if given else -1
    massless = any(link.mass is None for link in robot.links[: max(last, 0)])
    links = [
        replace(link, mass=0.0) if i < last and link.mass is None else link for i, link in enumerate(robot.links)
    ]
    notes = ["Links without a mass weigh nothing, where something behind them has mass."] if massless else []
    if given and (end := [shown(link.name) for link in links[last + 1 :]]):
        notes.append(f"The masses of the last links are estimated, as nothing behind them has any: {listed(end)}.")
    return replace(robot, links=tuple(links)), notes


def _without_absurd_numbers(robot: SerialRobot) -> tuple[SerialRobot, list[str]]:
    """Leave out limits, dynamics, gains and masses beyond what a robot may have, and return a sentence on each kind.

    Files write 1e16 or 1e-300 where they mean that there is no limit.
    """
    notes = Notes()

    def fits(value: float | None, size: Magnitude, what: str, name: str, least: float = 0.0) -> bool:
        if value is None or value == 0.0 or least <= abs(value) <= size.most:
            return True
        notes.group(f"Left out, as a robot cannot have such {what}: that of {{}}.", name, f"{value:g}")
        return False

    def kept(value: float | None, size: Magnitude, what: str, name: str) -> float | None:
        return value if fits(value, size, what, name, size.least) else None

    limits, dynamics, links = [], [], []
    for joint, given, moved, link in zip(robot.chain.joints, robot.limits, robot.dynamics, robot.links, strict=True):
        size, name = ANGLE if joint.type.turns else LENGTH, joint.name
        ends = given.position if all(fits(q, size, "a limit", name) for q in given.position or ()) else None
        velocity = kept(given.velocity, size, "a limit of velocity", name)
        limits.append(Limits(position=ends, velocity=velocity, effort=kept(given.effort, EFFORT, "an effort", name)))
        sizes = {"damping": DAMPING, "friction": FRICTION, "armature": ARMATURE}
        values = {what: kept(getattr(moved, what), size, f"a {what}", name) for what, size in sizes.items()}
        dynamics.append(replace(moved, **{what: value or 0.0 for what, value in values.items()}))
        if kept(link.mass, MASS, "a mass", link.name) is None:
            link = replace(link, mass=None, com=None, inertia=None)
        largest = None if link.inertia is None else float(np.abs(link.inertia).max())
        if not fits(largest, INERTIA, "an inertia", link.name):
            link = replace(link, inertia=None)
        if link.mesh is not None and kept(link.mesh.scale, SCALE, "a scale of a mesh", link.name) is None:
            link = replace(link, mesh=None)
        links.append(link)
    drives = robot.actuators and tuple(
        replace(
            drive,
            kp=kept(drive.kp, POSITION_GAIN, "a gain", joint.name),
            kv=kept(drive.kv, VELOCITY_GAIN, "a gain", joint.name),
        )
        for joint, drive in zip(robot.chain.joints, robot.actuators, strict=True)
    )
    changed = replace(robot, limits=tuple(limits), dynamics=tuple(dynamics), links=tuple(links), actuators=drives)
    return changed, list(notes.sentences())


def _limits(limits: Limits, row: Row, tolerances: Tolerances) -> Limits:
    """Return limits that are as simple as the table: a file's 2.9670597 rad may mean 170 degrees."""
    simple = simple_turn if row.type.turns else simple_length
    if limits.velocity is not None:
        limits = replace(limits, velocity=simple(limits.velocity, tolerances) or limits.velocity)
    if limits.position is None:
        return limits
    lower, upper = (simple(value, tolerances) for value in limits.position)
    return replace(limits, position=(lower, upper)) if lower < upper else limits


def _link(link: SerialLink, T_dh_link: Array, tolerances: Tolerances) -> LinkSpec:
    com, inertia = None, None
    if link.com is not None:
        com = simple_vector(T_dh_link[:3, :3] @ link.com + T_dh_link[:3, 3], tolerances)
    if link.inertia is not None:
        inertia = _rounded(rotate_tensor(T_dh_link, link.inertia), tolerances)
    return LinkSpec(
        mass=link.mass, com=com, inertia=inertia, color=link.color, mesh=_mesh(link.mesh, T_dh_link, tolerances)
    )


def _rounded(tensor: Array, tolerances: Tolerances) -> Array:
    """Return an inertia with as few digits as the tolerance allows, relative to the largest moment."""
    for share in (max(tolerances.angle, _ROUNDING), _ROUNDING):
        allowed = share * float(np.trace(tensor))
        rounded = read_only([[_fewest_digits(value, allowed) for value in row] for row in tensor.tolist()])
        if is_possible(rounded):  # that of a flat body may not be once it is rounded
            return rounded
    return tensor if is_possible(tensor) else made_possible(substantial(tensor))  # turning it has passed the limit


def _fewest_digits(value: float, allowed: float) -> float:
    candidates = (float(f"{value:.{digits}g}") for digits in _DIGITS)
    return next((number for number in (0.0, *candidates) if abs(number - value) <= allowed), value)


def _mesh(mesh: SerialMesh | None, T_dh_link: Array, tolerances: Tolerances) -> MeshSpec | None:
    if mesh is None or mesh.path is None:
        return None
    T = T_dh_link @ mesh.T_link_mesh
    pose = Pose(xyz=simple_vector(T[:3, 3], tolerances), rpy=simple_angles(rpy_from_rotation(T[:3, :3]), tolerances))
    return MeshSpec(file=mesh.path, scale=mesh.scale, pose=pose)


def import_serial(
    robot: SerialRobot,
    *,
    convention: Convention,
    tolerance: float,
    folder: Path | None,
    name: str | None = None,
    header: Sequence[str] = (),
    source: str = "",
    description: str = "",
    calibrated: bool = False,
) -> Imported:
    """Make a robot file of a serial robot, and compare it with the robot's own kinematics.

    What is compared is the text, read back: all joint axes and the tip at 1000 random configurations.

    Args:
        robot: As read from its file.
        convention: Of the table.
        tolerance: Greatest residual, rad, and m for a reach of up to 1 m, then of the reach.
        folder: Of the robot file, to which paths of meshes are relative.
        name: Of the robot, instead of the file's.
        header: Comment lines for the top of the file.
        source: Origin of the numbers; by default the robot's description.
        description: What the robot is.
        calibrated: Whether numbers near simple ones were measured, and are meant as they are.

    Raises:
        MismatchError: The residual is above the tolerance.
        RobotError: The robot cannot be written as a robot file.
    """
    names, renamed = joint_names([joint.name for joint in robot.chain.joints])
    own_name = robot_name(robot.name if name is None else name)
    joints = tuple(replace(joint, name=own) for joint, own in zip(robot.chain.joints, names, strict=True))
    robot, absurd = _without_absurd_numbers(replace(robot, chain=replace(robot.chain, joints=joints)))
    robot, weighed = _without_invented_masses(robot)
    recovery = recover_table(robot.chain, convention=convention, tolerance=tolerance, name=own_name)
    spec = assemble(robot, recovery, name=own_name, joint_names=names)
    hint = None if calibrated else simpler_with(spec, tolerance)
    notes = (
        *robot.notes,
        *absurd,
        *weighed,
        *_base_mass(robot),
        *renamed,
        *_tilted(recovery),
        *([hint] if hint else []),
    )
    comments = [*header, *(f"Note: {note}" for note in notes)]
    origin = source or robot.description
    spec = replace(spec, description=description, source=origin)
    residual = _measure(robot, _read_back(spec, comments, folder), recovery)
    if not within(residual, tolerance, recovery.reach):
        raise MismatchError(
            f"{robot.description}: the table is off by {residual_text(residual)} at {residual.worst}; allowed is "
            f"{tolerance!r}. Nothing was written. A greater tolerance may be good enough"
        )
    spec = replace(spec, source=f"{origin}{'' if origin.endswith('.') else '.'} {residual_sentence(residual)}")
    text = robot_file_text(spec, header=comments, folder=folder)
    made = _read(text, folder)
    return Imported(
        text=text,
        spec=made,
        notes=notes,
        residual=residual,
        mechanics=None if robot.mechanics is None else measure_mechanics(made, robot.mechanics),
        chain=robot.chain,
        assignment=recovery.assignment,
    )


def residual_text(residual: Residual) -> str:
    """Return a residual as ``3e-16 m and 5e-16 rad``."""
    return f"{residual.position:.1e} m and {residual.rotation:.1e} rad"


def residual_sentence(residual: Residual) -> str:
    """Return the sentence on a residual in the robot file's source."""
    return (
        f"Made by dh2sim; at {residual.configurations} random configurations all joint axes and the tip differ from "
        f"the source's by at most {residual_text(residual)}."
    )


def _measure(robot: SerialRobot, spec: RobotSpec, recovery: Recovery) -> Residual:
    return measure_residual(spec, robot.chain, CONFIGURATIONS, recovery.reach or 1.0)


def _read_back(spec: RobotSpec, comments: Sequence[str], folder: Path | None) -> RobotSpec:
    return _read(robot_file_text(spec, header=comments, folder=folder), folder)


def _read(text: str, folder: Path | None) -> RobotSpec:
    return parse_robot(text, file=MADE, directory=folder)


def _base_mass(robot: SerialRobot) -> list[str]:
    if robot.base.mass is None:
        return []
    return [f"The mass of the base {shown(robot.base.name)}, {robot.base.mass:.4g} kg, has no place in a robot file."]


def _tilted(recovery: Recovery) -> list[str]:
    """Return a sentence for every pair of nearly parallel axes."""
    links = recovery.assignment.links[1:]
    return [
        _tilt(step, recovery) for step, part in zip(recovery.assignment.steps, links, strict=False) if part.hayati
    ]


def _tilt(step: Step, recovery: Recovery) -> str:
    where = (
        "noise would decide where their common normal points"
        if step.normal_at is None
        else f"their common normal is {step.normal_at:.4g} m away, and the reach is {recovery.reach:.3g} m"
    )
    return (
        f"The axes of {step.joint} and {step.next_joint} are nearly parallel, {_angle(step)} apart: {where}. "
        f"So the row of {step.joint} is Hayati's: a, alpha and beta, no d."
    )


def _angle(step: Step) -> str:
    angle = math.pi - step.angle if step.antiparallel else step.angle
    return f"{angle:.2e} rad"
