"""``dh2sim info``."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dh2sim.cli.common import build_all, make_console, print_whole

if TYPE_CHECKING:
    from dh2sim.model.robot_model import JointModel, RobotModel
    from dh2sim.robot.spec import Row

_TITLES = {"standard": "standard", "modified": "modified", "hayati": "Hayati"}


def info(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="Robot file, or name of a robot that comes with dh2sim.")
    ],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON alone, in m, rad, kg.")] = False,
) -> None:
    """Print a robot's table as in a textbook, its frames at home, mass and reach, and what is estimated.

    \b
    Examples:
      dh2sim info stanford
      dh2sim info my_arm.yaml --json
    """
    [model] = build_all([robot])
    if as_json:
        print(json.dumps(as_dict(model), indent=2))
    else:
        _print(model)


def as_dict(model: RobotModel) -> dict[str, Any]:
    """Return all that ``info`` tells, in SI units."""
    from dh2sim.kinematics.forward import forward_kinematics, frame_poses

    spec, chain = model.spec, model.chain
    frames = {f"dh_{i}": T.tolist() for i, T in enumerate(frame_poses(chain, model.home))}
    return {
        "name": spec.name,
        "description": spec.description,
        "source": spec.source,
        "rows": [_row_dict(row, joint) for row, joint in zip(spec.rows, model.joints, strict=True)],
        "home": model.home.tolist(),
        "frames_at_home": {**frames, "tool0": forward_kinematics(chain, model.home).tolist()},
        "configurations": {name: q.tolist() for name, q in spec.configurations.items()},
        "reach": model.reach,
        "mass": model.mass,
        "links": [
            {
                "name": link.name,
                "mass": 0.0 if link.inertial is None else link.inertial.mass,
                "estimated": list(link.estimated),
            }
            for link in model.links
        ],
        "disabled_collisions": [
            {"link1": pair.link1, "link2": pair.link2, "reason": pair.reason.value} for pair in model.excluded
        ],
    }


def _row_dict(row: Row, joint: JointModel) -> dict[str, Any]:
    return {
        "joint": row.name,
        "type": row.type.value,
        "convention": row.convention.value,
        "a": row.a,
        "alpha": row.alpha,
        "d": row.d,
        "theta": row.theta,
        "beta": row.beta,
        "flip": row.flip,
        "limits": None
        if not row.type.moves
        else {
            "position": None if joint.position_range is None else list(joint.position_range),
            "velocity": joint.velocity,
            "effort": joint.effort,
            "assumed": list(joint.assumed),
        },
    }


def _print(model: RobotModel) -> None:
    from rich.text import Text

    console = make_console()
    spec = model.spec
    description = " ".join(spec.description.split())
    console.print(Text.assemble((spec.name, "bold"), f"  {description}" if description else ""))
    if spec.source:
        console.print(Text(f"Source: {' '.join(spec.source.split())}", "dim"))
    for table in (_dh_table(model), _frame_table(model)):
        print_whole(table)
    console.print(f"reach at most {model.reach:.4g} m, moving mass {model.mass:.4g} kg")
    for line in _remarks(model):
        console.print(Text(line))


def _dh_table(model: RobotModel) -> Any:
    from rich import box
    from rich.table import Table

    spec = model.spec
    conventions = {row.convention for row in spec.rows}
    mixed = len(conventions) > 1
    modified = not mixed and spec.rows[0].convention.value == "modified"
    a, alpha = ("a i-1", "alpha i-1") if modified else ("a i", "alpha i")
    twice = any(row.convention.value == "hayati" for row in spec.rows)
    title = "mixed conventions" if mixed else f"{_TITLES[spec.rows[0].convention.value]} convention"
    table = Table(box=box.SIMPLE_HEAD, title=f"DH table, {title}", title_justify="left", pad_edge=False)
    for column in ("i", "joint", "type", *(("convention",) if mixed else ())):
        table.add_column(column, no_wrap=True)
    beta = ("beta i\ndeg",) if twice else ()
    for column in (f"{a}\nm", f"{alpha}\ndeg", *beta, "d i\nm", "theta i\ndeg", "limits"):
        table.add_column(column, justify="right", no_wrap=True)
    for i, (row, joint) in enumerate(zip(spec.rows, model.joints, strict=True), start=1):
        table.add_row(
            str(i),
            row.name,
            row.type.value,
            *((row.convention.value,) if mixed else ()),
            _short(row.a),
            _short(math.degrees(row.alpha)),
            *((_beta(row),) if twice else ()),
            _offset(i, row),
            _variable(f"θ{i}", math.degrees(row.theta), row) if row.type.turns else _short(math.degrees(row.theta)),
            _limits(row, joint),
        )
    return table


def _beta(row: Row) -> str:
    return _short(math.degrees(row.beta)) if row.convention.value == "hayati" else ""


def _offset(i: int, row: Row) -> str:
    if row.type.value == "prismatic":
        return _variable(f"d{i}", row.d, row)
    # nearly parallel axes have no joint offset
    return "" if row.convention.value == "hayati" and row.d == 0.0 else _short(row.d)


def _variable(name: str, offset: float, row: Row) -> str:
    """The joint variable, starred, with its offset and direction: θ2* + 90, 90 - θ2*."""
    if row.flip:
        return f"{_short(offset)} - {name}*" if offset else f"-{name}*"
    if not offset:
        return f"{name}*"
    return f"{name}* {'+' if offset > 0 else '-'} {_short(abs(offset))}"


def _limits(row: Row, joint: JointModel) -> str:
    if not row.type.moves:
        return ""
    if joint.position_range is None:
        return "none"
    unit, scale = ("°", 180 / math.pi) if row.type.turns else (" m", 1.0)
    lower, upper = joint.position_range
    text = f"{_short(lower * scale)} … {_short(upper * scale)}{unit}"
    return f"({text})" if "position" in joint.assumed else text


def _frame_table(model: RobotModel) -> Any:
    from rich import box
    from rich.table import Table

    from dh2sim.kinematics.forward import forward_kinematics, frame_poses
    from dh2sim.kinematics.transforms import rpy_from_rotation

    if "home" in model.spec.configurations:
        home = "home"
    else:
        home = "zero moved inside the limits" if any(model.home) else "zero"
    table = Table(box=box.SIMPLE_HEAD, title=f"Frames in base_link at {home}", title_justify="left", pad_edge=False)
    table.add_column("frame")
    for column in ("x\nm", "y\nm", "z\nm", "roll\ndeg", "pitch\ndeg", "yaw\ndeg"):
        table.add_column(column, justify="right", no_wrap=True)
    poses = [(f"dh_{i}", T) for i, T in enumerate(frame_poses(model.chain, model.home))]
    for name, T in [*poses, ("tool0", forward_kinematics(model.chain, model.home))]:
        angles = [math.degrees(angle) for angle in rpy_from_rotation(T[:3, :3])]
        table.add_row(name, *(f"{x + 0.0:.4f}" for x in T[:3, 3]), *(f"{round(x, 3) + 0.0:.3f}" for x in angles))
    return table


def _remarks(model: RobotModel) -> list[str]:
    lines = [entry.sentence for entry in (*model.estimates, *model.assumptions)]
    if any("position" in joint.assumed for joint in model.moving_joints):
        lines.append("Limits in parentheses are assumed.")
    if model.excluded:
        lines.append("Pairs of links that do not collide, as in an SRDF:")
        lines += [
            f'  <disable_collisions link1="{pair.link1}" link2="{pair.link2}" reason="{pair.reason.value}"/>'
            for pair in model.excluded
        ]
    return lines


def _short(value: float) -> str:
    """To what a person reads: no trailing zeros, no -0, no rounding noise of degrees."""
    return f"{round(value, 10) + 0.0:.6g}"
