"""``dh2sim info``."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from dh2sim.cli.common import JsonOption, RobotArgument, StrictOption, build_any
from dh2sim.cli.output import WIDTH, json_text, print_wrapped, table_lines

if TYPE_CHECKING:
    from dh2sim.model.robot_model import JointModel, RobotModel
    from dh2sim.robot.row import Row
    from dh2sim.robot.spec import RobotSpec
    from dh2sim.robot.units import Units

T = TypeVar("T")

"""Columns of what is printed; a table of many or long columns may need more."""


def info(
    robot: RobotArgument,
    as_json: JsonOption = False,
    srdf: Annotated[
        bool, typer.Option("--srdf", help="Also print the pairs of links that do not collide, as in an SRDF.")
    ] = False,
    strict: StrictOption = False,
) -> None:
    """Print a robot's table as in a textbook, its frames at home, mass and reach, and what is estimated.

    For a mechanism: its joints, driven and passive, the closures of its loops, and its mobility.

    \b
    Examples:
      dh2sim info stanford
      dh2sim info my_arm.yaml --json
      dh2sim info my_arm.yaml --srdf
      dh2sim info my_arm.yaml --strict     # fail at likely slips
    """
    from dh2sim.model.robot_model import RobotModel

    [model] = build_any([robot], strict=strict)
    if not isinstance(model, RobotModel):
        from dh2sim.cli.info_mechanism import mechanism_dict, print_mechanism

        if srdf:
            raise typer.BadParameter(f"does not apply: {model.name} is a mechanism", param_hint="--srdf")
        if as_json:
            print(json_text(mechanism_dict(model)))
        else:
            print_mechanism(model)
        return
    if as_json:
        print(json_text(as_dict(model)))
    else:
        _print(model, srdf=srdf)


def as_dict(model: RobotModel) -> dict[str, Any]:
    """Return what ``info`` prints, and the pairs of links that do not collide, in SI units."""
    from dh2sim.kinematics.forward import forward_kinematics, frame_poses
    from dh2sim.model.slips import find_slips

    spec, chain = model.spec, model.chain
    frames = {f"dh_{i}": T.tolist() for i, T in enumerate(frame_poses(chain, model.home))}
    return {
        "name": spec.name,
        "group": _group(spec),
        "description": spec.description,
        "source": spec.source,
        "rows": [_row_dict(row, joint) for row, joint in zip(spec.rows, model.joints, strict=True)],
        "home": model.home.tolist(),
        "frames_at_home": {**frames, "tool0": forward_kinematics(chain, model.home).tolist()},
        "configurations": {name: q.tolist() for name, q in spec.configurations.items()},
        "reach": model.reach,
        "mass": model.mass,
        "payload": {
            "mass": 0.0 if model.payload is None else model.payload.mass,
            "assumed": spec.payload.mass is None,
        },
        "links": [
            {
                "name": link.name,
                "mass": 0.0 if link.inertial is None else link.inertial.mass,
                "estimated": list(link.estimated),
            }
            for link in model.moving_links
        ],
        "disabled_collisions": [
            {"link1": pair.link1, "link2": pair.link2, "reason": pair.reason.value} for pair in model.excluded
        ],
        "notes": [slip.to_json() for slip in find_slips(model)],
    }


def _group(spec: RobotSpec) -> str | None:
    """Return what kind of robot one is that comes with dh2sim."""
    from dh2sim.robot.catalog import builtin_group

    return None if spec.source_file is None else builtin_group(spec.name, spec.source_file.text)


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


def _print(model: RobotModel, *, srdf: bool) -> None:
    spec = model.spec
    description, source = (" ".join(text.split()) for text in (spec.description, spec.source))
    group = _group(spec)
    print_wrapped(f"{spec.name}  {description}{f' ({group})' if group else ''}".rstrip())
    if source:
        print_wrapped(f"Source: {source}")
    for lines in (*_dh_tables(model), _frame_table(model)):
        print()
        print("\n".join(lines))
    print()
    unit, reach = spec.units.length, f"{model.reach:.4g} m"
    if unit != "m":
        reach = f"{model.reach / spec.units.metres(1.0):.4g} {unit} ({reach})"
    payload = 0.0 if model.payload is None else model.payload.mass
    carries = f"{'assumed' if spec.payload.mass is None else 'nominal'} payload {payload:.3g} kg"
    for line in (f"reach at most {reach}, moving mass {model.mass:.4g} kg, {carries}", *_remarks(model)):
        print_wrapped(line)
    if srdf:
        print("Pairs of links that do not collide, as in an SRDF:")
        for pair in model.excluded:
            print(f'  <disable_collisions link1="{pair.link1}" link2="{pair.link2}" reason="{pair.reason.value}"/>')


def _dh_tables(model: RobotModel) -> list[list[str]]:
    """Return the table as in a textbook, its lengths in m and beside it in the robot file's unit.

    The limits are in its last column, or where that makes it wider than ``WIDTH`` in a table of their own.
    """
    from dh2sim.robot.textbook_table import Cell, plain_symbol, textbook_table

    spec = model.spec
    table = textbook_table(spec)
    extra = ("convention",) if table.mixed else ()
    unit, metres = spec.units.length.value, spec.units.metres(1.0)

    def doubled(items: Iterable[T], converted: Callable[[T], T]) -> list[T]:
        """Follow every length by the same in the file's unit, unless that is m."""
        pairs = zip(items, table.columns, strict=True)
        return [
            each for item, (*_, u) in pairs for each in ((item, converted(item)) if u == "m" != unit else (item,))
        ]

    def in_file_unit(cell: Cell) -> Cell:
        return cell if cell.value is None else replace(cell, value=cell.value / metres)

    columns = doubled(table.columns, lambda column: (*column[:2], unit))
    lines = [
        ["", "", "", *("" for _ in extra), *(f"{name} {index}" for name, index, _ in columns), ""],
        ["i", "joint", "type", *extra, *(column_unit for *_, column_unit in columns), "limits"],
    ]
    for i, (row, joint, cells) in enumerate(zip(spec.rows, model.joints, table.cells, strict=True), start=1):
        parameters = [cell.text(plain_symbol) for cell in doubled(cells, in_file_unit)]
        kind = (row.convention.value,) if table.mixed else ()
        lines.append([str(i), row.name, row.type.value, *kind, *parameters, _limits(joint, spec.units)])
    left = 3 + len(extra)
    whole = table_lines(lines, left=left, head=2)
    if max(map(len, whole)) <= WIDTH:
        return [[table.title, *whole]]
    return [
        [table.title, *table_lines([line[:-1] for line in lines], left=left, head=2)],
        ["Limits", *table_lines([[*line[:2], line[-1]] for line in lines[1:] if line[-1]], left=2)],
    ]


def _limits(joint: JointModel, units: Units) -> str:
    """Return the position limits, a length in the file's unit and in m; in parentheses where they are assumed."""
    from dh2sim.robot.textbook_table import short

    kind = joint.type
    if not kind.moves:
        return ""
    if joint.position_range is None:
        return "none"
    lower, upper = joint.position_range
    if kind.turns:
        text = f"{short(math.degrees(lower))} … {short(math.degrees(upper))}°"
    else:
        text = f"{short(lower)} … {short(upper)} m"
        if units.length != "m":
            scale = units.metres(1.0)
            text = f"{short(lower / scale)} … {short(upper / scale)} {units.length} = {text}"
    return f"({text})" if "position" in joint.assumed else text


def _frame_table(model: RobotModel) -> list[str]:
    from dh2sim.kinematics.forward import forward_kinematics, frame_poses
    from dh2sim.kinematics.transforms import rpy_from_rotation

    if "home" in model.spec.configurations:
        home = "home"
    else:
        home = "zero moved inside the limits" if any(model.home) else "zero"
    unit, scale = model.spec.units.length.value, model.spec.units.metres(1.0)
    scales = {"m": 1.0} if unit == "m" else {"m": 1.0, unit: scale}
    lines = [
        ["", *("x", "y", "z") * len(scales), "roll", "pitch", "yaw"],
        ["frame", *(unit for unit in scales for _ in range(3)), "deg", "deg", "deg"],
    ]
    poses = [(f"dh_{i}", T) for i, T in enumerate(frame_poses(model.chain, model.home))]
    for name, T in [*poses, ("tool0", forward_kinematics(model.chain, model.home))]:
        # four places of a metre, and as fine in smaller units
        places = {unit: max(0, 4 + round(math.log10(scale))) for unit, scale in scales.items()}
        lengths = (f"{round(x / scales[u], places[u]) + 0.0:.{places[u]}f}" for u in scales for x in T[:3, 3])
        angles = (math.degrees(angle) for angle in rpy_from_rotation(T[:3, :3]))
        lines.append([name, *lengths, *(f"{round(x, 3) + 0.0:.3f}" for x in angles)])
    return [f"Frames in base_link at {home}", *table_lines(lines, left=1, head=2)]


def _remarks(model: RobotModel) -> list[str]:
    lines = [entry.sentence for entry in (*model.estimates, *model.assumptions)]
    if any("position" in joint.assumed for joint in model.moving_joints):
        lines.append("Limits in parentheses are assumed.")
    return lines
