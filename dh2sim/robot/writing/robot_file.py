"""RobotSpecs to robot files: the text that reads back as the same robot."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from dh2sim.robot.spec import ActuatorSpec, RobotSpec
from dh2sim.robot.units import AngleUnit, LengthUnit, Units
from dh2sim.robot.writing.layout import Tree, entry_lines, table_lines
from dh2sim.robot.writing.numbers import UnitWriter, numbers
from dh2sim.robot.writing.parts import PartWriter, actuator
from dh2sim.robot.writing.text import comment_lines, text_lines, word

_GRAVITY = [0.0, 0.0, -9.81]


def robot_file_text(
    spec: RobotSpec,
    *,
    header: Sequence[str] = (),
    folder: Path | None = None,
    angle: AngleUnit = AngleUnit.DEG,
    length: LengthUnit = LengthUnit.M,
) -> str:
    """Return the text of a robot file that ``parse_robot`` reads as the same robot.

    Numbers read back as the same doubles in rad and m. In other units some have no text that does; those come back
    an ulp off, and stay the same from then on. Parameters are not written: the numbers that they gave stand in
    their places. In description and source, characters that YAML cannot hold become U+FFFD. What a robot file
    does not allow (such as a kp of a velocity actuator) is written as it is, for the reader to complain of.

    Args:
        spec: The robot.
        header: Lines of comments to begin with, any text.
        folder: Where the file will stand: paths of meshes are relative to it; by default they are absolute.
        angle: Unit of the file's angles.
        length: Unit of the file's lengths.

    Raises:
        ModelError: A number is too large for the unit, or a mesh file has a name that YAML cannot hold.
    """
    parts = PartWriter(UnitWriter(units=Units(angle=angle, length=length)), folder)
    shared = _shared_actuator(spec)
    lines = [*comment_lines(header), f"name: {word(spec.name)}"]
    for key, text in {"description": spec.description, "source": spec.source}.items():
        lines += text_lines(key, text) if text else []
    lines += [f"convention: {spec.convention}", f"units: {{angle: {angle}, length: {length}}}"]
    before: dict[str, Tree] = {"base": parts.base(spec.base), "tool": parts.pose(spec.tool)}
    if spec.gravity.tolist() != _GRAVITY:
        before["gravity"] = numbers(spec.gravity.tolist())
    lines += [line for key, tree in before.items() if tree for line in entry_lines(key, tree)]
    lines += ["joints:", *table_lines(parts.rows(spec, shared))]
    configurations = parts.configurations(spec.configurations, spec.moving_rows)
    if configurations:
        lines.append("configurations:")
        lines += [line for name, vector in configurations.items() for line in entry_lines(name, vector, 2)]
    if actuator(shared) != actuator(ActuatorSpec()):
        lines += entry_lines("actuators", actuator(shared))
    return "\n".join([*lines, ""])


def _shared_actuator(spec: RobotSpec) -> ActuatorSpec:
    """Return the actuator of all moving rows where it is one and the same, else the default."""
    first, *others = [row.actuator for row in spec.moving_rows] or [ActuatorSpec()]
    return first if all(actuator(other) == actuator(first) for other in others) else ActuatorSpec()
