"""What ``dh2sim info`` prints of a mechanism: links, joints, closures, frames at home, mobility."""

from __future__ import annotations

import math
from typing import Any

from dh2sim.cli.output import print_wrapped, table_lines
from dh2sim.kinematics.loop_motion import actuated_joints
from dh2sim.kinematics.transforms import rpy_from_rotation
from dh2sim.kinematics.tree import BASE, tree_frames
from dh2sim.messages import printable
from dh2sim.mobility.robot_mechanism import find_mobility
from dh2sim.model.mechanism import MechanismModel


def mechanism_dict(model: MechanismModel) -> dict[str, Any]:
    """Return what is printed in SI units."""
    spec, tree = model.spec, model.tree
    driven = {model.moving_joints[k].name for k in actuated_joints(spec)}
    home = model.configurations()["home"]
    found = find_mobility(spec)
    return {
        "name": spec.name,
        "description": spec.description,
        "source": spec.source,
        "joints": [
            {
                "joint": joint.name,
                "type": joint.type.value,
                "parent": model.body_name(parent),
                "link": link.name,
                "driven": joint.name in driven,
                "assembly": float(model.q[column]) if column >= 0 else None,
                "position_limits": None if joint.position_range is None else list(joint.position_range),
            }
            for joint, link, parent, column in zip(
                model.joints, model.links, tree.parents, tree.coordinates, strict=True
            )
        ],
        "actuated": None if spec.actuated is None else list(spec.actuated),
        "closures": [
            {"name": each.name, "type": each.type.value, "between": [each.a, each.b]} for each in tree.closures
        ],
        "home": home.tolist(),
        "frames_at_home": {name: T.tolist() for name, T in tree_frames(tree, home).items() if not _is_link(name)},
        "size": model.size,
        "mass": model.mass,
        "mobility": found.to_dict(),
    }


def _is_link(name: str) -> bool:
    return name == "base_link" or name.rpartition("/")[2].startswith("link_")


def print_mechanism(model: MechanismModel) -> None:
    """Print a mechanism."""
    spec, tree = model.spec, model.tree
    print_wrapped(f"{spec.name}  {' '.join(spec.description.split())}".rstrip())
    if spec.source:
        print_wrapped(f"Source: {' '.join(spec.source.split())}")
    driven = {model.moving_joints[k].name for k in actuated_joints(spec)}
    lines = [["joint", "type", "on", "driven", "at assembly", "limits"]]
    for k, joint in enumerate(model.joints):
        parent, column = tree.parents[k], tree.coordinates[k]
        at = "" if column < 0 else _value(joint.type.turns, float(model.q[column]))
        limits = "" if column < 0 else "none"
        if column >= 0 and joint.position_range is not None:
            lower, upper = (_number(joint.type.turns, x) for x in joint.position_range)
            limits = f"{lower} … {upper}{'°' if joint.type.turns else ' m'}"
        on = model.base.name if parent == BASE else model.body_name(parent)
        mark = "" if column < 0 else "yes" if joint.name in driven else "no"
        lines.append([joint.name, joint.type.value, on, mark, at, limits])
    print()
    print(printable("\n".join(table_lines(lines, left=4))))
    if spec.actuated is None:
        print_wrapped("The file has no 'actuated': every joint counts as driven.")
    if tree.closures:
        print()
        rows = [["closure", "type", "between"]]
        rows += [[each.name, each.type.value, f"{each.a}, {each.b}"] for each in tree.closures]
        print(printable("\n".join(table_lines(rows, left=3))))
    print()
    frames = tree_frames(tree, model.configurations()["home"])
    rows = [["frame at home", "x, m", "y, m", "z, m", "roll, deg", "pitch, deg", "yaw, deg"]]
    for name, T in frames.items():
        if not _is_link(name):
            lengths = (f"{round(float(x), 4) + 0.0:.4f}" for x in T[:3, 3])
            angles = (f"{round(math.degrees(x), 3) + 0.0:.3f}" for x in rpy_from_rotation(T[:3, :3]))
            rows.append([name, *lengths, *angles])
    print(printable("\n".join(table_lines(rows, left=1))))
    print()
    print_wrapped(f"size {model.size:.4g} m, moving mass {model.mass:.4g} kg")
    for entry in (*model.estimates, *model.assumptions):
        print_wrapped(entry.sentence)
    print_wrapped(f"Mobility: {find_mobility(spec).verdict}")


def _number(turns: bool, value: float) -> str:
    return f"{math.degrees(value) + 0.0:.5g}" if turns else f"{value:.5g}"


def _value(turns: bool, value: float) -> str:
    rounded = round(math.degrees(value), 4) if turns else round(value, 6)
    return f"{rounded + 0.0:g}{'°' if turns else ' m'}"
