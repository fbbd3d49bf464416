"""Robots from makers' calibration files: the calibrated table, and all else from the nominal robot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from dh2sim.errors import Dh2simError, MismatchError
from dh2sim.formats.calibration import JointOrigins, TableDeltas, moving_joints, read_calibration
from dh2sim.formats.serial_robot import SerialLink, SerialRobot
from dh2sim.importing.convert import EXACT_CONFIGURATIONS
from dh2sim.importing.convert import TOLERANCE as EXACT_TOLERANCE
from dh2sim.importing.result import Imported
from dh2sim.importing.serial import import_serial, robot_name
from dh2sim.importing.source_errors import MADE
from dh2sim.kinematics.arm_path import arm_path
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.compaction import compact_rows
from dh2sim.kinematics.conversion import convert_rows
from dh2sim.kinematics.forward import reference_joint_poses
from dh2sim.kinematics.frame_assignment.recover import SEED, Residual
from dh2sim.kinematics.frame_assignment.result import Tolerances
from dh2sim.kinematics.frame_assignment.rounding import simple_vector
from dh2sim.kinematics.sampling import random_configurations
from dh2sim.kinematics.table_oracle import table_tool_errors, table_tool_pose
from dh2sim.kinematics.transforms import (
    compose,
    identity,
    invert,
    move_point,
    pose_errors,
    pose_from_rpy,
    rotate_tensor,
    rpy_from_rotation,
)
from dh2sim.messages import listed
from dh2sim.robot.links import LinkSpec, MeshSpec, Pose, ToolSpec
from dh2sim.robot.read import parse_robot
from dh2sim.robot.row import Convention, Dynamics, Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, Units
from dh2sim.robot.write import robot_file_text
from dh2sim.typing import Array, read_only

_MOST_APART = 0.03
"""Of the reach: calibrations move tool0 by millimetres; that of another robot is farther away at coordinates zero."""
_ALIKE = 0.9
"""Cosine of what calibrated axes may differ from nominal ones at most."""


def import_calibration(
    data: bytes,
    *,
    file: str,
    nominal: RobotSpec | None,
    convention: Convention | None,
    tolerance: float,
    name: str | None,
    folder: Path | None,
    origin: str,
) -> Imported:
    """Make a robot file of a maker's calibration file.

    Joints keep the controller's coordinates. The table is compact: every frame is within reach of the arm. What the
    file does not say comes from the nominal robot: names, limits, dynamics, actuators, configurations, gravity, and
    what links and tool weigh and look like. Bodies stay where they are at coordinates zero, in base_link, and move
    with the calibrated joints.

    Args:
        data: The file's content.
        file: Its name, for messages and for the robot's name; '-' for standard input.
        nominal: The robot as its maker designed it.
        convention: Of the table; by default the nominal robot's, or else standard.
        tolerance: Greatest residual, rad, and m for a reach of up to 1 m, then of the reach.
        name: Of the robot.
        folder: Of the robot file, to which paths of meshes are relative.
        origin: What the numbers' source is called in the robot file.

    Raises:
        ImportedFileError: The file is wrong.
        MismatchError: The table that was made is not the file's kinematics to within the tolerance.
        Dh2simError: The nominal robot is missing, or another one.
    """
    read = read_calibration(data, file=file)
    if name is None:
        name = f"{nominal.name}_calibrated" if nominal is not None else robot_name(Path(file).stem)
    origin = origin or f"Calibration in {Path(file).name}"
    if isinstance(read, TableDeltas):
        if nominal is None:
            raise Dh2simError(
                f"{file}: this holds what is to be added to a nominal table; name the robot, as in nominal='ur5e'"
            )
        return _of_deltas(read, nominal, convention, file=file, name=robot_name(name), origin=origin, folder=folder)
    return _of_origins(
        read, nominal, convention, file=file, name=name, origin=origin, folder=folder, tolerance=tolerance
    )


# ---------------------------------------------------------------------------- deltas of a table


def _of_deltas(
    deltas: TableDeltas,
    nominal: RobotSpec,
    convention: Convention | None,
    *,
    file: str,
    name: str,
    origin: str,
    folder: Path | None,
) -> Imported:
    if any(row.convention is not Convention.STANDARD for row in nominal.rows):
        raise Dh2simError(f"{file}: these numbers belong to standard rows; those of {nominal.name} are others")
    _check_rows(nominal, len(deltas.theta), file)
    rows = tuple(
        replace(row, theta=row.theta + theta, a=row.a + a, d=row.d + d, alpha=row.alpha + alpha, link=LinkSpec())
        for row, theta, a, d, alpha in zip(nominal.rows, deltas.theta, deltas.a, deltas.d, deltas.alpha, strict=True)
    )
    plain = replace(nominal, name=name, rows=rows, parameters=MappingProxyType({}), source_file=None)
    conversion = compact_rows(plain)
    spec = conversion.spec
    if convention is Convention.MODIFIED:
        spec = convert_rows(spec, Convention.MODIFIED).spec
    notes = [*conversion.notes, _apart(spec, nominal, file)]
    if not deltas.linearised:
        notes.insert(0, "The controller does not call this robot calibrated: its calibration_status is not 2.")
    spec = replace(
        _with_bodies(spec, nominal),
        description=nominal.description,
        source=f"{origin}, added to the table of {nominal.name}.",
    )
    text, read = _written(spec, notes, nominal, folder)
    bound = np.full(len(rows), np.pi)
    q = random_configurations(-bound, bound, EXACT_CONFIGURATIONS, SEED)
    position, rotation = table_tool_errors(read, plain, q)
    if not max(position, rotation) <= EXACT_TOLERANCE:
        raise MismatchError(
            f"{file}: the compact table is off by {position:.1e} m and {rotation:.1e} rad; nothing was written"
        )
    residual = Residual(position=position, rotation=rotation, worst="the tip", configurations=EXACT_CONFIGURATIONS)
    return Imported(text=text, spec=read, notes=tuple(notes), residual=residual)


# ---------------------------------------------------------------------------- poses of joints


def _of_origins(
    origins: JointOrigins,
    nominal: RobotSpec | None,
    convention: Convention | None,
    *,
    file: str,
    name: str,
    origin: str,
    folder: Path | None,
    tolerance: float,
) -> Imported:
    count = moving_joints(origins, None if nominal is None else len(nominal.moving_rows))
    if nominal is not None:
        _check_rows(nominal, count, file)
    first = identity() if nominal is None else _pose(nominal.base.pose)
    chain = origins.chain(count, first)
    notes = [f"{joint} does not move: it leads to tool0." for joint in origins.names[count:]]
    rows: Sequence[Row | None] = [None] * count
    if nominal is None:
        notes.append("The file says nothing of limits and masses; those of a nominal robot can be taken over.")
    else:
        rows = nominal.rows
        joints = tuple(
            replace(joint, name=row.name, type=row.type)
            for joint, row in zip(chain.joints, nominal.rows, strict=True)
        )
        chain = replace(chain, joints=joints)
        chain = replace(chain, T_link_tip=_tip_with_tool(chain.T_link_tip, origins, nominal, first))
    robot = SerialRobot(
        name=name,
        description=origin,
        chain=chain,
        base=SerialLink(name="base_link"),
        links=tuple(SerialLink(name=f"link_{i}") for i in range(1, count + 1)),
        limits=tuple(Limits() if row is None else row.limits for row in rows),
        dynamics=tuple(Dynamics() if row is None else row.dynamics for row in rows),
        actuators=None if nominal is None else tuple(row.actuator for row in nominal.rows),
        notes=tuple(notes),
    )
    if nominal is not None:
        robot = replace(robot, gravity=nominal.gravity, configurations=nominal.configurations)
    own = Convention.STANDARD if nominal is None else nominal.convention
    wanted = convention or (Convention.MODIFIED if own is Convention.MODIFIED else Convention.STANDARD)
    identifier = f", {origins.identifier}" if origins.identifier else ""
    imported = import_serial(
        robot,
        convention=wanted,
        tolerance=tolerance,
        folder=folder,
        name=name,
        source=f"{origin}{identifier}.",
        description="" if nominal is None else nominal.description,
        calibrated=True,
    )
    if nominal is None:
        return imported
    made = [*imported.notes, _apart(imported.spec, nominal, file)]
    spec = _with_bodies(imported.spec, nominal)
    spec = replace(spec, source=f"{spec.source} All else is that of {nominal.name}.")
    text, read = _written(spec, made, nominal, folder)
    return replace(imported, text=text, spec=read, notes=tuple(made))


def _tip_with_tool(T_link_tip: Array, origins: JointOrigins, nominal: RobotSpec, T_base_first: Array) -> Array:
    """Return where tool0 is, behind the file's last frame: that may be the nominal DH frame n, or tool0 already."""
    T = T_base_first
    for pose in origins.poses:
        T = compose(T, _pose(pose))
    frame = _dh_frames(nominal)[-1]
    tool = _pose(nominal.tool.pose)
    scale = arm_path(build_chain(nominal)).reach or 1.0

    def apart(nominal_frame: Array) -> float:
        position, rotation = pose_errors(T[None], nominal_frame[None])
        return float(position[0]) / scale + float(rotation[0])

    return T_link_tip if apart(compose(frame, tool)) <= apart(frame) else compose(T_link_tip, tool)


# ---------------------------------------------------------------------------- what the nominal robot gives


def _check_rows(nominal: RobotSpec, count: int, file: str) -> None:
    fixed = [row.name for row in nominal.rows if not row.type.turns]
    if fixed:
        raise Dh2simError(
            f"{file}: the joints of a calibration turn; of {nominal.name} these do not: {listed(fixed)}"
        )
    if len(nominal.rows) != count:
        raise Dh2simError(f"{file}: this is of {count} joints, but {nominal.name} has {len(nominal.rows)}")


def _apart(spec: RobotSpec, nominal: RobotSpec, file: str) -> str:
    """Return a sentence on how far the calibrated robot is from the nominal one at coordinates zero.

    Raises:
        Dh2simError: So far that it is another robot.
    """
    zero = np.zeros(len(spec.rows))
    position, rotation = (
        float(error[0])
        for error in pose_errors(table_tool_pose(spec, zero)[None], table_tool_pose(nominal, zero)[None])
    )
    reach = arm_path(build_chain(nominal)).reach
    turned = [
        row.name
        for row, axis, nominal_axis in zip(spec.rows, _axes(spec), _axes(nominal), strict=True)
        if float(axis @ nominal_axis) < _ALIKE
    ]
    if position > _MOST_APART * reach or turned:
        what = f"axes of {listed(turned)} point elsewhere" if turned else f"tool0 is {position:.3g} m away"
        raise Dh2simError(
            f"{file}: this is the calibration of another robot than {nominal.name}: at coordinates zero {what}"
        )
    return (
        f"At coordinates zero tool0 is {1000 * position:.3g} mm and {math.degrees(rotation):.2g} degrees from the "
        f"nominal {nominal.name}'s."
    )


def _axes(spec: RobotSpec) -> list[Array]:
    """Directions of positive turns at coordinates zero, in base_link."""
    chain = build_chain(spec)
    poses = reference_joint_poses(chain, np.zeros(chain.n))
    return [joint.sign * T[:3, 2] for joint, T in zip(chain.joints, poses, strict=True)]


def _dh_frames(spec: RobotSpec) -> list[Array]:
    """Poses of DH frames 0 … n in base_link at coordinates zero."""
    chain = build_chain(spec)
    poses = reference_joint_poses(chain, np.zeros(chain.n))
    return [
        chain.T_base_link_dh0,
        *(compose(T, joint.T_joint_dh) for joint, T in zip(chain.joints, poses, strict=True)),
    ]


def _pose(pose: Pose) -> Array:
    return pose_from_rpy(pose.xyz, pose.rpy)


def _with_bodies(spec: RobotSpec, nominal: RobotSpec) -> RobotSpec:
    """Return a calibrated robot with the links, the base and the tool of the nominal one, where those have them."""
    moved = [
        compose(invert(frame), nominal_frame)
        for frame, nominal_frame in zip(_dh_frames(spec), _dh_frames(nominal), strict=True)
    ]
    rows = tuple(
        replace(row, link=_moved_link(given.link, T))
        for row, given, T in zip(spec.rows, nominal.rows, moved[1:], strict=True)
    )
    last, tool = moved[-1], nominal.tool
    shape = None if tool.shape is None else replace(tool.shape, pose=_moved_pose(tool.shape.pose, last))
    return replace(
        spec,
        rows=rows,
        base=replace(spec.base, color=nominal.base.color, mesh=_moved_mesh(nominal.base.mesh, moved[0])),
        tool=ToolSpec(
            xyz=spec.tool.xyz,
            rpy=spec.tool.rpy,
            mass=tool.mass,
            com=_moved_point(tool.com, last),
            inertia=None if tool.inertia is None else rotate_tensor(last, tool.inertia),
            color=tool.color,
            shape=shape,
            mesh=_moved_mesh(tool.mesh, last),
        ),
        payload=replace(nominal.payload, com=_moved_point(nominal.payload.com, last)),
    )


def _moved_link(link: LinkSpec, T: Array) -> LinkSpec:
    return replace(
        link,
        com=_moved_point(link.com, T),
        inertia=None if link.inertia is None else rotate_tensor(T, link.inertia),
        mesh=_moved_mesh(link.mesh, T),
    )


def _moved_point(point: Array | None, T: Array) -> Array | None:
    if point is None:
        return None
    return simple_vector(read_only(move_point(T, point)), Tolerances(angle=1e-9, length=1e-9, reach=1.0))


def _moved_pose(pose: Pose, T: Array) -> Pose:
    moved = compose(T, _pose(pose))
    return Pose(xyz=read_only(moved[:3, 3]), rpy=rpy_from_rotation(moved))


def _moved_mesh(mesh: MeshSpec | None, T: Array) -> MeshSpec | None:
    return None if mesh is None else replace(mesh, pose=_moved_pose(mesh.pose, T))


def _written(spec: RobotSpec, notes: Sequence[str], nominal: RobotSpec, folder: Path | None) -> tuple[str, RobotSpec]:
    """Return the robot file's text, in the nominal robot's units, and the robot read back from it."""
    units = nominal.units if nominal.source_file is not None else Units(angle=AngleUnit.DEG)
    header = [f"Note: {note}" for note in notes]
    text = robot_file_text(spec, header=header, folder=folder, angle=units.angle, length=units.length)
    return text, parse_robot(text, file=MADE, directory=folder)
