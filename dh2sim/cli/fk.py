"""``dh2sim fk``."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Annotated

import typer

from dh2sim.cli.common import load_all
from dh2sim.errors import ConfigurationError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from dh2sim.robot.spec import RobotSpec


def fk(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="Robot file, or name of a robot that comes with dh2sim.")
    ],
    q: Annotated[
        list[str] | None,
        typer.Argument(metavar="Q", help="Joint coordinates in m and rad; expressions such as -pi/2 are allowed."),
    ] = None,
    frame: Annotated[str, typer.Option(help="tool0, base_link, dh_0 … dh_n or link_1 … link_n.")] = "tool0",
    degrees: Annotated[
        bool, typer.Option("--degrees", help="Angles in degrees, in what is read and printed.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON alone: the pose in m.")] = False,
) -> None:
    """Print the pose of a frame in base_link: as matrix, as position with rpy, and as quaternion.

    Without Q the robot is at its configuration 'home', or at zero if it has none; the name of another configuration
    may stand for Q.

    \b
    Examples:
      dh2sim fk stanford 0.3 -0.7 0.5 1.1 0.6 -0.4
      dh2sim fk stanford --degrees 45 60 0.2 45 0 -60
      dh2sim fk stanford home --frame dh_3 --json
    """
    import numpy as np

    from dh2sim.kinematics.chain import build_chain
    from dh2sim.kinematics.forward import frame_pose
    from dh2sim.kinematics.transforms import quaternion_from_rotation, rpy_from_rotation

    [spec] = load_all([robot])
    with np.errstate(all="ignore"):
        pose = frame_pose(build_chain(spec), frame, _joint_vector(spec, q or [], degrees=degrees))
    if not bool(abs(pose).max() < math.inf):
        raise ConfigurationError(f"{spec.name}: the pose of {frame} is too far away for a number to tell")
    if as_json:
        print(json.dumps({"robot": spec.name, "frame": frame, "pose": pose.tolist()}))
        return
    unit = 180 / math.pi if degrees else 1.0
    print(f"{spec.name}: pose of {frame} in base_link")
    for row in pose:
        print("  " + " ".join(f"{_rounded(value):14.9f}" for value in row))
    print("position    " + _numbers(pose[:3, 3]) + " m")
    angles = [float(angle) * unit for angle in rpy_from_rotation(pose[:3, :3])]
    print("rpy         " + _numbers(angles) + (" deg" if degrees else " rad"))
    print("quaternion  " + _numbers(quaternion_from_rotation(pose[:3, :3])) + "  (w, x, y, z)")


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{_rounded(value):.9f}" for value in values)


def _rounded(value: float) -> float:
    """To what is printed, so that there is no -0.000000000."""
    return round(float(value), 9) + 0.0


def _joint_vector(spec: RobotSpec, texts: list[str], *, degrees: bool) -> list[float]:
    from dh2sim.messages import shown
    from dh2sim.robot.expressions import ExpressionError, evaluate

    if not texts:
        return [float(x) for x in spec.configurations.get("home", [0.0] * len(spec.moving_rows))]
    if len(texts) == 1 and texts[0] in spec.configurations:
        return [float(x) for x in spec.configurations[texts[0]]]
    for text in texts:
        if text.startswith("--"):
            raise ConfigurationError(f"fk has no option {shown(text)}. Options: --frame, --degrees, --json, --help")
    moving = spec.moving_rows
    if len(texts) != len(moving):
        raise ConfigurationError(_wrong_count(spec, texts, degrees=degrees))
    values = []
    for row, text in zip(moving, texts, strict=True):
        try:
            value = evaluate(text, {})
        except ExpressionError as error:
            raise ConfigurationError(f"{row.name}: {error}") from None
        values.append(math.radians(value) if degrees and row.type.turns else value)
    return values


def _wrong_count(spec: RobotSpec, texts: list[str], *, degrees: bool) -> str:
    from dh2sim.messages import did_you_mean, listed, shown

    moving = spec.moving_rows
    names = ", ".join(f"{row.name} ({'m' if not row.type.turns else 'deg' if degrees else 'rad'})" for row in moving)
    count = "1 joint coordinate" if len(moving) == 1 else f"{len(moving) or 'no'} joint coordinates"
    told = f"{spec.name} has {count}, got {len(texts)}" + (f": {names}" if names else "")
    if len(texts) > 1 or not texts[0].isidentifier():
        return told
    hint = did_you_mean(texts[0], spec.configurations)
    return f"{spec.name} has no configuration {shown(texts[0])}.{hint} Configurations: {listed(spec.configurations)}"
