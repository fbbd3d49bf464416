"""The calibrated robot as a robot file: the author's own text with other numbers, where that can be."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np

from dh2sim.calibrate.result import Calibration
from dh2sim.errors import Dh2simError
from dh2sim.robot.edit import can_be_edited, with_cells
from dh2sim.robot.links import Pose
from dh2sim.robot.number_text import UnitWriter
from dh2sim.robot.read import parse_robot
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, Units
from dh2sim.robot.write import robot_file_text
from dh2sim.robot.yaml_text import comment_lines
from dh2sim.robot.yaml_tree import Node, Report, compose
from dh2sim.typing import Array

_NUMBERS: Final = ("a", "alpha", "beta", "d", "theta")
_KEYS: Final = ("convention", *_NUMBERS)


def calibrated_text(calibration: Calibration, *, header: Sequence[str], folder: Path | None) -> str:
    """Return the text of the calibrated robot's file.

    Where only numbers change, and rows become Hayati's, comments, parameters and the order of keys are those of the
    file that the robot was read from; else a new text is written below the comments that it began with.

    Args:
        calibration: Of the robot.
        header: Lines of comments to begin with.
        folder: Where the file will stand: paths of meshes are relative to it.
    """
    robot, original = calibration.robot, calibration.original
    source = original.source_file
    units = original.units if source is not None else Units(angle=AngleUnit.DEG)
    new = robot_file_text(
        robot,
        header=[*header, *_first_comments("" if source is None else source.text)],
        folder=folder,
        angle=units.angle,
        length=units.length,
    )
    if source is None:
        return new
    meshes = [robot.base.mesh, robot.tool.mesh, *(row.link.mesh for row in robot.rows)]
    if any(mesh is not None for mesh in meshes):
        return new  # whose paths are relative to where the file will stand
    try:
        edited = "".join(f"{line}\n" for line in comment_lines(header)) + _edited(source.text, robot, original)
        same = _plain(parse_robot(edited)) == _plain(robot)
    except (Dh2simError, KeyError, ValueError):
        return new
    return edited if same else new


def _plain(spec: RobotSpec) -> str:
    return robot_file_text(spec, angle=AngleUnit.RAD)


def _first_comments(text: str) -> Iterator[str]:
    for line in text.splitlines():
        if not line.startswith("#"):
            return
        yield line.removeprefix("#").removeprefix(" ")


def _edited(text: str, robot: RobotSpec, original: RobotSpec) -> str:
    """Return a robot file's text with the numbers of another robot.

    Raises:
        ValueError: More than numbers is different.
    """
    if not can_be_edited(text):
        raise ValueError("the file has anchors")
    writer = UnitWriter(units=original.units)
    cells: _Cells = {}
    for index, (new, old) in enumerate(zip(robot.rows, original.rows, strict=True)):
        if new.convention is not old.convention:
            if new.convention is not Convention.HAYATI:
                raise ValueError("a row has another convention")
            cells[index, "convention"] = new.convention.value
        for key in _NUMBERS:
            value = getattr(new, key)
            if value != getattr(old, key):
                cells[index, key] = writer.length(value) if key in ("a", "d") else writer.angle(value)
    # a later edit must not move what an earlier one found: cells last
    text = _with_points(text, robot, original, writer)
    text = _with_pose(text, "base", robot.base.pose, original.base.pose, writer)
    text = _with_pose(text, "tool", robot.tool.pose, original.tool.pose, writer)
    text = with_cells(text, {cell: value for cell, value in cells.items() if _is_written(text, cell)})
    return _with_new_cells(text, cells)


_Cells: TypeAlias = dict[tuple[int, str], str]


def _is_written(text: str, cell: tuple[int, str]) -> bool:
    return compose(text, Report("")).at("joints", *cell) is not None


def _with_new_cells(text: str, cells: _Cells) -> str:
    """Write numbers into rows that say nothing of them, behind the row's type."""
    root = compose(text, Report(""))
    for index in sorted({row for row, _ in cells}, reverse=True):
        row, kind = root.at("joints", index), root.entry("joints", index, "type")
        if row is None or kind is None:
            raise ValueError("a row has no type")
        between = ", " if row.flow else f"\n{' ' * (row.column - 1)}"
        new = [f"{key}: {cells[index, key]}" for key in _KEYS if (index, key) in cells and row.at(key) is None]
        at = kind.value.end
        text = text[:at] + "".join(f"{between}{each}" for each in new) + text[at:]
    return text


def _with_points(text: str, robot: RobotSpec, original: RobotSpec, writer: UnitWriter) -> str:
    """Exchange centres of mass of links whose frames have moved along their axes."""
    places: list[tuple[Node, float]] = []
    root = compose(text, Report(""))
    for index, (new, old) in enumerate(zip(robot.rows, original.rows, strict=True)):
        if new.link.com is None or old.link.com is None or np.array_equal(new.link.com, old.link.com):
            continue
        for axis in np.flatnonzero(new.link.com != old.link.com).tolist():
            node = root.at("joints", index, "link", "com", axis)
            if node is None:
                raise ValueError("a centre of mass is not written as a list")
            places.append((node, float(new.link.com[axis])))
    for node, value in sorted(places, key=lambda place: -place[0].start):
        text = text[: node.start] + writer.length(value) + text[node.end :]
    return text


def _with_pose(text: str, key: str, new: Pose, old: Pose, writer: UnitWriter) -> str:
    """Exchange the numbers of base or tool, or write them before the joints where there are none."""
    for part, write in (("xyz", writer.length), ("rpy", writer.angle)):
        wanted: Array = getattr(new, part)
        if np.array_equal(wanted, getattr(old, part)):
            continue
        numbers = [write(value) for value in wanted.tolist()]
        root = compose(text, Report(""))
        node = root.at(key, part)
        xyz = root.at(key, "xyz")
        if node is not None and isinstance(node.value, list):
            for each, number in reversed(list(zip(node.value, numbers, strict=True))):
                text = text[: each.start] + number + text[each.end :]
            continue
        if node is not None:
            raise ValueError(f"{part} of {key} is not written as a list")
        line = f"{part}: [{', '.join(numbers)}]"
        whole = root.at(key)
        if whole is None:
            entry = root.entry("joints")
            if entry is None or root.flow:
                raise ValueError("no line of its own for joints")
            text = text[: entry.start] + f"{key}: {{{line}}}\n" + text[entry.start :]
        elif part == "rpy" and xyz is not None and isinstance(xyz.value, list) and xyz.flow:
            end = text.index("]", xyz.value[-1].end) + 1
            between = ", " if whole.flow else f"\n{' ' * (whole.column - 1)}"
            text = text[:end] + between + line + text[end:]
        elif whole.flow:
            start = text.index("{", whole.start) + 1
            rest = ", " if re.match(r"\s*\}", text[start:]) is None else ""
            text = text[:start] + line + rest + text[start:]
        else:
            text = text[: whole.start] + f"{line}\n{' ' * (whole.column - 1)}" + text[whole.start :]
    return text
