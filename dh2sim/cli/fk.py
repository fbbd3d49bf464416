"""``dh2sim fk`` and ``dh2sim jacobian``: what the kinematics of a robot is at one configuration."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dh2sim.cli.common import JsonOption, RobotArgument, load_one
from dh2sim.cli.joint_vector import (
    DegreesOption,
    JointVector,
    QArgument,
    RadiansOption,
    format_numbers,
    read_joint_vector,
    warn_open_loops,
)
from dh2sim.cli.output import json_text, terminal_width
from dh2sim.errors import ConfigurationError, Dh2simError

if TYPE_CHECKING:
    from dh2sim.kinematics.chain import KinematicChain
    from dh2sim.robot.spec import RobotSpec
    from dh2sim.typing import Array

FRAMES = "tool0, base_link, dh_0 … dh_n or link_1 … link_n."
VELOCITIES = ("vx", "vy", "vz", "wx", "wy", "wz")


def fk(
    robot: RobotArgument,
    q: QArgument = None,
    frame: Annotated[
        str | None, typer.Option(metavar="FRAME", help=f"{FRAMES} [default: tool0]", show_default=False)
    ] = None,
    source: Annotated[
        str | None,
        typer.Option("--from", metavar="FRAME", help="Frame that the pose is given in. [default: base_link]"),
    ] = None,
    target: Annotated[str | None, typer.Option("--to", metavar="FRAME", help="The same as --frame.")] = None,
    every: Annotated[bool, typer.Option("--all", help="Print A_i of every row and T_0_i of every DH frame.")] = False,
    degrees: DegreesOption = False,
    radians: RadiansOption = False,
    as_json: JsonOption = False,
) -> None:
    """Print the pose of a frame: as matrix, as position with roll, pitch, yaw, and as quaternion.

    Without Q the robot is at its configuration 'home', or at zero moved inside the limits if its file has none.

    \b
    Examples:
      dh2sim fk stanford 17 -40 0.5 63 34 -23
      dh2sim fk stanford --radians 0.3, -0.7, 0.5, 1.1, 0.6, -0.4
      dh2sim fk stanford home --frame dh_3 --json
      dh2sim fk stanford home --from dh_2 --to dh_4
      dh2sim fk stanford home --all
    """
    import numpy as np

    from dh2sim.kinematics.chain import build_chain
    from dh2sim.kinematics.forward import frame_pose
    from dh2sim.kinematics.transforms import invert

    if frame is not None and target is not None:
        raise typer.BadParameter("mean the same; give one of them", param_hint="--frame, --to")
    if every and (frame or target or source):
        raise typer.BadParameter("prints every row; leave the other option out", param_hint="--all")
    spec = load_one(robot)
    vector = read_joint_vector(spec, q, degrees=degrees, radians=radians)
    if spec.is_mechanism:
        if every:
            raise Dh2simError(f"{spec.name}: --all prints the rows of serial robots; use --frame")
        pose_of = _mechanism_pose(spec, vector)
    else:
        chain = build_chain(spec)

        def pose_of(frame: str) -> Array:
            return frame_pose(chain, frame, vector.q)

    if every:
        _print_rows(spec, chain, vector, as_json=as_json)
        return
    name = target or frame or "tool0"
    with np.errstate(all="ignore"):
        pose = pose_of(name)
        if source is not None:
            pose = invert(pose_of(source)) @ pose
    _require_finite(spec, pose, f"the pose of {name}")
    if as_json:
        origin = {} if source is None else {"from": source}
        _print_json({"robot": spec.name, **origin, "frame": name, "q": list(vector.q), "pose": pose.tolist()})
        return
    print(f"{spec.name}: pose of {name} in {source or 'base_link'}")
    _print_q(vector)
    _print_pose(pose, vector)


def _mechanism_pose(spec: RobotSpec, vector: JointVector) -> Callable[[str], Array]:
    """Return what gives the pose of a frame of a mechanism; a warning is printed where its loops are not closed."""
    from dh2sim.kinematics.tree import build_tree, tree_frames

    tree = build_tree(spec)
    warn_open_loops(tree, vector)
    frames = tree_frames(tree, vector.q)

    def pose_of(frame: str) -> Array:
        tree.frame(frame)
        return frames[frame]

    return pose_of


def _print_pose(pose: Array, vector: JointVector) -> None:
    from dh2sim.kinematics.transforms import quaternion_from_rotation, rpy_from_rotation

    unit = vector.units.angle.value
    angles = [angle / vector.units.radians(1.0) for angle in rpy_from_rotation(pose[:3, :3])]
    _print_matrix(pose)
    print(f"position    {format_numbers(pose[:3, 3])} m")
    print(f"rpy         {format_numbers(angles)} {unit}")
    print(f"quaternion  {format_numbers(quaternion_from_rotation(pose[:3, :3]))}  (w, x, y, z)")


def _print_rows(spec: RobotSpec, chain: KinematicChain, vector: JointVector, *, as_json: bool) -> None:
    """Print the transform A_i of every row, and its DH frame in frame 0."""
    import numpy as np

    from dh2sim.kinematics.forward import frame_poses
    from dh2sim.kinematics.table_oracle import row_matrix
    from dh2sim.kinematics.transforms import invert

    coordinates = iter(vector.q)
    with np.errstate(all="ignore"):
        rows = [row_matrix(row, np.array(next(coordinates) if row.type.moves else 0.0)) for row in spec.rows]
        frames = invert(chain.T_base_link_dh0) @ frame_poses(chain, vector.q)[1:]
    _require_finite(spec, frames, "a frame")
    if as_json:
        poses = {"A": [A.tolist() for A in rows], "T_0": frames.tolist()}
        ends = {"T_base_link_0": chain.T_base_link_dh0.tolist(), "T_n_tool0": chain.T_dhn_tool0.tolist()}
        _print_json({"robot": spec.name, "q": list(vector.q), **poses, **ends})
        return
    print(f"{spec.name}: transform of every row, and every DH frame in frame 0")
    _print_q(vector)
    identity = np.eye(4)
    if not np.array_equal(chain.T_base_link_dh0, identity):
        print("T_base_link_0")
        _print_matrix(chain.T_base_link_dh0)
    for i, (row, A, T) in enumerate(zip(spec.rows, rows, frames, strict=True), start=1):
        print(f"A_{i}  ({row.name})")
        _print_matrix(A)
        print(f"T_0_{i}")
        _print_matrix(T)
    if not np.array_equal(chain.T_dhn_tool0, identity):
        print(f"T_{len(rows)}_tool0")
        _print_matrix(chain.T_dhn_tool0)


def jacobian(
    robot: RobotArgument,
    q: QArgument = None,
    frame: Annotated[str, typer.Option(metavar="FRAME", help=FRAMES)] = "tool0",
    degrees: DegreesOption = False,
    radians: RadiansOption = False,
    as_json: JsonOption = False,
) -> None:
    """Print the Jacobian of a frame in base_link, and how close it is to singular.

    Its rows are the velocity of the frame's origin and the angular velocity of the frame, its columns the joints.
    At a singular configuration the joint motions that do not move the frame and the velocities that the frame
    cannot have are printed. A robot with more than six joints has self-motions everywhere. For a mechanism the
    columns are its driven joints, and the passive ones follow.

    \b
    Examples:
      dh2sim jacobian stanford home
      dh2sim jacobian stanford 17 -40 0.5 63 0 -23      # singular
      dh2sim jacobian ssrms home --frame dh_4 --json
    """
    import numpy as np

    from dh2sim.kinematics.chain import build_chain
    from dh2sim.kinematics.forward import geometric_jacobian
    from dh2sim.kinematics.loop_motion import actuated_joints, mechanism_jacobian
    from dh2sim.kinematics.singularity import lost_directions, manipulability, rank, singular_values, still_motions

    spec = load_one(robot)
    vector = read_joint_vector(spec, q, degrees=degrees, radians=radians)
    with np.errstate(all="ignore"):
        if spec.is_mechanism:
            J = mechanism_jacobian(spec, vector.q, frame)
            moving = spec.moving_rows
            columns = replace(vector, rows=tuple(moving[k] for k in sorted(actuated_joints(spec))))
        else:
            J, columns = geometric_jacobian(build_chain(spec), vector.q, frame=frame), vector
    _require_finite(spec, J, f"the Jacobian of {frame}")
    values = singular_values(J)
    still, lost = still_motions(J), lost_directions(J)
    if as_json:
        _print_json(
            {
                "robot": spec.name,
                "frame": frame,
                "q": list(vector.q),
                "joints": [row.name for row in columns.rows],
                "jacobian": J.tolist(),
                "singular_values": values.tolist(),
                "manipulability": float(manipulability(J)),
                "rank": rank(J),
                "still_motions": still.tolist(),
                "lost_directions": lost.tolist(),
            }
        )
        return
    names = [row.name for row in columns.rows]
    print(f"{spec.name}: Jacobian of {frame} in base_link")
    _print_q(vector)
    _print_jacobian(J, columns)
    _print_items("singular values  ", [f"{value:.6g}" for value in values] or ["none"])
    print(f"manipulability   {float(manipulability(J)):.6g}  (product of the singular values)")
    most = min(J.shape)
    singular = rank(J) < most
    print(f"rank             {rank(J)} of {most}{': singular' if singular else ''}")
    if len(still):
        title = f"joint motions that leave {frame} still" if singular else "self-motions"
        print(f"{title}, {_rates(columns)}:")
        for motion in still:
            _print_items("  ", re.split(" (?=[-+] )", _combination(motion, names)))
    if singular:
        print(f"velocities that {frame} cannot have, m/s and rad/s:")
        for direction in lost:
            print(f"  {_combination(direction, VELOCITIES)}")


def _print_jacobian(J: Array, vector: JointVector) -> None:
    """Print a Jacobian with its rows, columns and units named."""
    names = [row.name for row in vector.rows]
    per = [f"per {'rad' if row.type.turns else 'm'}/s" for row in vector.rows]
    lines = [("", *names), ("", *per)]
    for i, (name, row) in enumerate(zip(VELOCITIES, J, strict=True)):
        label = f"{name}, {'m' if i < 3 else 'rad'}/s"
        lines.append((label, *(f"{round(float(value), 6) + 0.0:.6f}" for value in row)))
    widths = [max(len(line[k]) for line in lines) for k in range(len(names) + 1)]
    for number, columns in enumerate(_fitting(widths)):
        if number:
            print()
        for line in lines:
            text = "".join(f"  {line[k]:>{widths[k]}}" for k in columns)
            print(f"  {line[0]:{widths[0]}}{text}".rstrip())


def _fitting(widths: Sequence[int]) -> list[range]:
    """Return the columns of a table, but the first, in groups that fit beside that on the terminal."""
    room, groups, start, used = terminal_width() or math.inf, [], 1, 0
    for k, width in enumerate(widths[1:], start=1):
        used += 2 + width
        if used + 2 + widths[0] > room and k > start:
            groups.append(range(start, k))
            start, used = k, 2 + width
    return [*groups, range(start, len(widths))]


def _rates(vector: JointVector) -> str:
    units = dict.fromkeys("rad/s" if row.type.turns else "m/s" for row in vector.rows)
    return " and ".join(units)


def _combination(values: Any, names: Any) -> str:
    """Return ``1 joint_4 - 0.5 joint_6`` for a vector."""
    text = ""
    for value, name in zip(values.tolist(), names, strict=True):
        if value:
            sign = ("-" if value < 0 else "") if not text else (" - " if value < 0 else " + ")
            text += f"{sign}{abs(value):.4g} {name}"
    return text


def _print_q(vector: JointVector) -> None:
    _print_items("q           ", re.split("(?<=,) ", str(vector)))


def _print_items(label: str, items: Sequence[str]) -> None:
    """Print a label and items; where a terminal is too narrow for them, lines end between items."""
    width, line = terminal_width() or math.inf, label + items[0]
    for item in items[1:]:
        if len(line) + 1 + len(item) > width:
            print(line)
            line = " " * len(label) + item
        else:
            line += f" {item}"
    print(line.rstrip())


def _print_matrix(T: Array) -> None:
    for row in T:
        print(f"  {format_numbers(row, 14)}")


def _print_json(content: dict[str, Any]) -> None:
    print(json_text(content, indent=None))


def _require_finite(spec: RobotSpec, values: Array, what: str) -> None:
    if not bool(abs(values).max(initial=0.0) < math.inf):
        raise ConfigurationError(f"{spec.name}: {what} is too large for a floating-point number")
