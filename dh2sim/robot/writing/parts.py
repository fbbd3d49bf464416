"""The parts of a robot file, from what a RobotSpec holds; what is left out is what a reader fills in."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from dh2sim.errors import ModelError
from dh2sim.robot.document import NOT_PRINTABLE
from dh2sim.robot.rows import default_name
from dh2sim.robot.spec import (
    ActuatorSpec,
    BaseSpec,
    Convention,
    Dynamics,
    JointType,
    Limits,
    LinkSpec,
    MeshSpec,
    Pose,
    RobotSpec,
    Row,
)
from dh2sim.robot.writing.layout import Tree, inline
from dh2sim.robot.writing.numbers import UnitWriter, number, numbers
from dh2sim.robot.writing.text import word
from dh2sim.typing import Array


class PartWriter:
    """Knows the units of one file, and its folder."""

    def __init__(self, units: UnitWriter, folder: Path | None) -> None:
        """``folder`` is where paths in the file start; without it they are absolute."""
        self._units = units
        self._folder = folder

    def pose(self, pose: Pose) -> dict[str, Tree]:
        """Return a pose; empty for the identity."""
        tree: dict[str, Tree] = {}
        if pose.xyz.any():
            tree["xyz"] = self._units.lengths(pose.xyz.tolist())
        if pose.rpy.any():
            tree["rpy"] = self._units.angles(pose.rpy.tolist())
        return tree

    def base(self, base: BaseSpec) -> dict[str, Tree]:
        """Return what is known of the base link."""
        return {**self.pose(base.pose), **self._look(base.color, base.mesh)}

    def rows(self, spec: RobotSpec, shared: ActuatorSpec) -> list[dict[str, Tree]]:
        """Return the table; names are left out where all are the default ones."""
        named = any(row.name != default_name(index) for index, row in enumerate(spec.rows))
        return [self._row(row, spec.convention, shared, named=named) for row in spec.rows]

    def configurations(self, configurations: Mapping[str, Array], moving: Sequence[Row]) -> dict[str, Tree]:
        """Return the named joint vectors."""
        return {
            word(name): [
                self._units.coordinate(value, turns=row.type.turns)
                for value, row in zip(vector.tolist(), moving, strict=True)
            ]
            for name, vector in configurations.items()
        }

    def _row(self, row: Row, convention: Convention, shared: ActuatorSpec, *, named: bool) -> dict[str, Tree]:
        tree: dict[str, Tree] = {"name": word(row.name)} if named else {}
        tree |= {"type": row.type.value, **self._numbers(row)}
        if row.convention is not convention:
            tree["convention"] = row.convention.value
        if row.flip:
            tree["flip"] = "true"
        own = row.type.moves and actuator(row.actuator) != actuator(shared)
        parts: dict[str, Tree] = {
            "limits": self._limits(row.limits, turns=row.type.turns),
            "dynamics": _dynamics(row.dynamics),
            "link": self._link(row.link),
            "actuator": actuator(row.actuator) if own else {},
        }
        return tree | {key: part for key, part in parts.items() if part}

    def _numbers(self, row: Row) -> dict[str, Tree]:
        """Return the numbers of the table, zeros too, so that it can be read as one."""
        tree: dict[str, Tree] = {"a": self._units.length(row.a), "alpha": self._units.angle(row.alpha)}
        hayati = row.convention is Convention.HAYATI
        if row.beta or hayati:
            tree["beta"] = self._units.angle(row.beta)
        if row.d or not hayati or row.type is JointType.PRISMATIC:  # other Hayati rows have none
            tree["d"] = self._units.length(row.d)
        return {**tree, "theta": self._units.angle(row.theta)}

    def _limits(self, limits: Limits, *, turns: bool) -> str:
        tree: dict[str, Tree] = {}
        if limits.position is not None:
            tree["position"] = [self._units.coordinate(value, turns=turns) for value in limits.position]
        if limits.velocity is not None:
            tree["velocity"] = self._units.coordinate(limits.velocity, turns=turns)
        if limits.effort is not None:
            tree["effort"] = number(limits.effort)
        return _line(tree)

    def _link(self, link: LinkSpec) -> dict[str, Tree]:
        tree: dict[str, Tree] = {}
        if link.mass is not None:
            tree["mass"] = number(link.mass)
        if link.com is not None:
            tree["com"] = self._units.lengths(link.com.tolist())
        if link.inertia is not None:
            tree["inertia"] = _inertia(link.inertia)
        if link.density is not None:
            tree["density"] = number(link.density)
        if link.radius is not None:
            tree["radius"] = self._units.length(link.radius)
        return {**tree, **self._look(link.color, link.mesh)}

    def _look(self, color: Sequence[float] | None, mesh: MeshSpec | None) -> dict[str, Tree]:
        tree: dict[str, Tree] = {}
        if color is not None:
            tree["color"] = numbers(color[:3] if color[3] == 1 else color)
        if mesh is not None:
            scale: dict[str, Tree] = {} if mesh.scale == 1 else {"scale": number(mesh.scale)}
            tree["mesh"] = {"file": word(self._path(mesh.file)), **scale, **self.pose(mesh.pose)}
        return tree

    def _path(self, file: Path) -> str:
        """Return a path as the file names it; relative to its folder, where they are on one drive."""
        path = Path(os.path.abspath(file))
        if self._folder is not None:
            # links resolved on both sides: the system goes up from where a link leads, not from where it stands
            path = path.parent.resolve() / path.name
            with contextlib.suppress(ValueError):
                path = Path(os.path.relpath(path, self._folder.resolve()))
        if NOT_PRINTABLE.search(str(path)):
            raise ModelError(f"a robot file cannot name the mesh file {str(path)!r}; rename it")
        return path.as_posix()


def actuator(actuator: ActuatorSpec) -> dict[str, Tree]:
    """Return an actuator, with its type."""
    tree: dict[str, Tree] = {"type": actuator.type.value}
    if actuator.kp is not None:
        tree["kp"] = number(actuator.kp)
    if actuator.kv is not None:
        tree["kv"] = number(actuator.kv)
    return tree


def _dynamics(dynamics: Dynamics) -> str:
    values = {"damping": dynamics.damping, "friction": dynamics.friction, "armature": dynamics.armature}
    return _line({key: number(value) for key, value in values.items() if value})


def _inertia(matrix: Array) -> str:
    (ixx, ixy, ixz), (_, iyy, iyz), (_, _, izz) = matrix.tolist()
    products = {"ixy": ixy, "ixz": ixz, "iyz": iyz}
    moments = {"ixx": ixx, "iyy": iyy, "izz": izz}
    return _line({key: number(value) for key, value in {**moments, **products}.items() if value or key in moments})


def _line(tree: dict[str, Tree]) -> str:
    """Return a mapping that is easier to read on one line, however long; nothing where it is empty."""
    return inline(tree) if tree else ""
