"""Tables as text, what is said of wrong ones, and the product of a table's matrices as textbooks print it."""

from __future__ import annotations

import math
import textwrap
from typing import TypedDict

import numpy as np

from dh2sim.errors import Dh2simError, ImportedFileError
from dh2sim.formats.table.read import TableImport, read_table
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import forward_kinematics
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.typing import Array


class Said(TypedDict, total=False):
    """What the user says of a table."""

    convention: Convention
    angle: AngleUnit
    length: LengthUnit


STANDARD: Said = {"convention": Convention.STANDARD}
MODIFIED: Said = {"convention": Convention.MODIFIED}


def imported(text: str, file: str = "t.md", **said: object) -> TableImport:
    return read_table(textwrap.dedent(text).encode(), file=file, name="r", **said)  # type: ignore[arg-type]


def complaints(text: str | bytes, file: str = "t.md", **said: object) -> list[str]:
    """Return every problem of a wrong table, as a user sees it."""
    data = text if isinstance(text, bytes) else textwrap.dedent(text).encode()
    try:
        read_table(data, file=file, name="r", **said)  # type: ignore[arg-type]
    except ImportedFileError as error:
        return str(error).split("\n")
    except Dh2simError as error:
        raise AssertionError(f"not about the file: {error}") from error
    return []


def numbers(spec: RobotSpec) -> list[tuple[float, float, float, float]]:
    """Return theta, d, a and alpha of every row, rad and m."""
    return [(row.theta, row.d, row.a, row.alpha) for row in spec.rows]


def types(spec: RobotSpec) -> str:
    """Return the first letter of every row's type."""
    return "".join(row.type.value[0] for row in spec.rows)


def standard(theta: float, d: float, a: float, alpha: float) -> Array:
    """A_i as Spong prints it."""
    s, c, sa, ca = math.sin(theta), math.cos(theta), math.sin(alpha), math.cos(alpha)
    return np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])


def modified(theta: float, d: float, a: float, alpha: float) -> Array:
    """A_i as Craig prints it; a and alpha of index i - 1."""
    s, c, sa, ca = math.sin(theta), math.cos(theta), math.sin(alpha), math.cos(alpha)
    return np.array([[c, -s, 0, a], [s * ca, c * ca, -sa, -d * sa], [s * sa, c * sa, ca, d * ca], [0, 0, 0, 1]])


def tool_poses(spec: RobotSpec, q: object) -> Array:
    """Return the poses of the tool that the robot has, shape (N, 4, 4)."""
    return forward_kinematics(build_chain(spec), np.asarray(q, dtype=np.float64))
