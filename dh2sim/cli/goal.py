"""The pose that the options of ``dh2sim ik`` ask for."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from dh2sim.errors import ConfigurationError, Dh2simError
from dh2sim.messages import Loc, did_you_mean, listed, shown

if TYPE_CHECKING:
    from dh2sim.robot.spec import RobotSpec
    from dh2sim.robot.yaml_tree import Node, Report
    from dh2sim.typing import Array

STDIN: Final = "-"
_RIGID: Final = 1e-3
"""By which entries of R Rᵀ may differ from those of the identity: single precision and typed numbers are accepted."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PoseFile:
    """What a pose file holds."""

    T: Array
    """Pose in base_link, shape (4, 4)."""
    frame: str | None
    """Frame that it is the pose of; None where the file does not say."""


def read_pose_file(path: str) -> PoseFile:
    """Read a pose: a 4x4 matrix, alone or under ``pose`` or ``target``, as ``fk --json`` and ``ik --json`` print it.

    Args:
        path: A JSON file, or '-' for standard input.

    Raises:
        Dh2simError: It cannot be read, or holds no pose; the text says everything that is wrong, and where.
    """
    from dh2sim.input_files import read_input
    from dh2sim.robot.yaml_tree import MAX_BYTES, Report, compose, decode

    name = "<stdin>" if path == STDIN else path
    try:
        if path == STDIN:
            data = sys.stdin.buffer.read(MAX_BYTES + 1)
        else:
            data = read_input(Path(path), MAX_BYTES)
    except OSError as error:
        raise Dh2simError(f"{path}: cannot be read: {error.strerror or error}") from None
    report = Report(name)
    # JSON is YAML, but for tabs; this parser knows places
    text = decode(data, report).replace("\t", " ")
    root = compose(text, report, needs="a pose has four rows of four numbers")
    frame, loc, matrix = _content(root, report)
    T = _matrix(matrix, loc, report) if matrix is not None else None
    if T is None or report.problems:
        raise report.error()
    return PoseFile(T=T, frame=frame)


def _content(root: Node, report: Report) -> tuple[str | None, Loc, Node | None]:
    """Return a file's frame, and where its matrix is."""
    if not isinstance(root.value, dict):
        return None, (), root
    entries = root.value
    keys = [key for key in ("pose", "target") if key in entries]
    if len(keys) != 1:
        found = "both" if keys else f"found {listed(entries)}"
        report.add(root.line, root.column, (), f"expected a 4x4 matrix, alone or under 'pose' or 'target'; {found}")
        return None, (), None
    source, frame = (entries[key].value if key in entries else None for key in ("from", "frame"))
    if source is not None and source.value != "base_link":
        message = f"the pose must be given in base_link, found {shown(source.value)}"
        report.add(source.line, source.column, ("from",), message)
    if frame is not None and not isinstance(frame.value, str):
        report.add(frame.line, frame.column, ("frame",), f"expected the name of a frame, found {shown(frame.value)}")
    name = frame.value if frame is not None and isinstance(frame.value, str) else None
    return name, (keys[0],), entries[keys[0]].value


def _matrix(node: Node, loc: Loc, report: Report) -> Array | None:
    """Return the pose that a node holds; None where something is wrong, which is noted."""
    import numpy as np

    rows = _items(node, loc, "rows", report)
    if rows is None:
        return None
    cells = [_items(row, (*loc, i), "numbers", report) for i, row in enumerate(rows)]
    values = [
        [_number(cell, (*loc, i, j), report) for j, cell in enumerate(row)]
        for i, row in enumerate(cells)
        if row is not None
    ]
    if report.problems or None in cells:
        return None
    T = np.array(values, dtype=np.float64)
    problem = pose_problem(T)
    if problem:
        report.add(node.line, node.column, loc, problem)
        return None
    return T


def _items(node: Node, loc: Loc, what: str, report: Report) -> list[Node] | None:
    value = node.value
    if isinstance(value, list) and len(value) == 4:
        return value
    found = f"{len(value)} {what}" if isinstance(value, list) else shown(value)
    report.add(node.line, node.column, loc, f"expected 4 {what}, found {found}")
    return None


def _number(node: Node, loc: Loc, report: Report) -> float:
    value = node.value
    right = isinstance(value, int | float) and not isinstance(value, bool)
    if right and math.isfinite(number := float(value)):  # type: ignore[arg-type]
        return number
    text = node.text or shown(value)
    report.add(node.line, node.column, loc, f"expected a finite number, found {text}")
    return math.nan


def pose_problem(T: Array) -> str:
    """Return why a matrix of finite numbers, shape (4, 4), is not a pose; empty if it is one."""
    import numpy as np

    if np.abs(T[3] - [0.0, 0.0, 0.0, 1.0]).max() > _RIGID:
        return f"the last row of a pose is 0, 0, 0, 1, found {', '.join(f'{x:g}' for x in T[3])}"
    R = T[:3, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        off = np.abs(R @ R.T - np.eye(3)).max()
        if not off <= _RIGID:
            return f"the upper left 3x3 part is not a rotation: R Rᵀ differs from the identity by {off:.3g}"
        if np.linalg.det(R) < 0.0:
            return "the upper left 3x3 part is a reflection, not a rotation: its determinant is -1"
    return ""


def pose_of(xyz: Sequence[float], rpy: Sequence[float] | None, quaternion: Sequence[float] | None) -> Array:
    """Return the pose of a position, m, and an orientation: angles, rad, or a quaternion of any length but zero."""
    import numpy as np

    from dh2sim.kinematics.transforms import pose_from_rpy

    T = np.array(pose_from_rpy(xyz, rpy or (0.0, 0.0, 0.0)))
    if quaternion is not None:
        largest = max(map(abs, quaternion))
        w, x, y, z = (part / largest for part in quaternion)
        norm = w * w + x * x + y * y + z * z
        K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        T[:3, :3] = np.eye(3) + 2.0 / norm * (w * K + K @ K)
    return T


def numbers(words: Sequence[str]) -> tuple[list[float], list[str]]:
    """Return the values of words, which may be expressions, and what is wrong with others."""
    from dh2sim.robot.expressions import ExpressionError, evaluate

    values, problems = [], []
    for word in words:
        try:
            values.append(evaluate(word.strip().strip(","), {}))
        except ExpressionError as error:
            problems.append(str(error))
    return values, problems


def joints_before(spec: RobotSpec, frame: str) -> RobotSpec:
    """Return the robot up to a frame, which becomes its tool0.

    Raises:
        ConfigurationError: The frame is not tool0, nor a DH frame that joints move.
    """
    from dataclasses import replace
    from types import MappingProxyType

    from dh2sim.robot.links import ToolSpec

    if frame == "tool0":
        return spec
    names = ["tool0", *(f"dh_{i}" for i in range(1, len(spec.rows) + 1))]
    if frame not in names:
        hint = did_you_mean(frame, names)
        raise ConfigurationError(f"must be one of {listed(names)}, got {shown(frame)}.{hint}".rstrip("."))
    rows = spec.rows[: int(frame.removeprefix("dh_"))]
    if not any(row.type.moves for row in rows):
        raise ConfigurationError(f"is {frame}, which no joint moves")
    count = sum(row.type.moves for row in rows)
    kept = {name: q[:count] for name, q in spec.configurations.items()}
    return replace(spec, rows=rows, tool=ToolSpec(), configurations=MappingProxyType(kept))
