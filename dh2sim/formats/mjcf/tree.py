"""A compiled MJCF as a tree of bodies in plain numbers, which can be worked on without MuJoCo."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Final

from dh2sim.formats.arm import LinkTree
from dh2sim.kinematics.transforms import compose, identity
from dh2sim.messages import shown
from dh2sim.typing import Array, read_only

if TYPE_CHECKING:
    import mujoco

WORLD: Final = 0
"""Number of the world, the root of all bodies."""
DYNAMICS: Final = {"damping": "damping", "friction": "frictionloss", "armature": "armature"}
"""Attributes of an MJCF's joint for its dynamics, by the names of a robot file."""
_SNAP: Final = 4e-16
"""What rounding may leave where a component of a rotation is 0, 1 or -1."""


class Motion(StrEnum):
    """Kinds of joints, in the order of their numbers in MuJoCo."""

    FREE = "free"
    BALL = "ball"
    SLIDE = "slide"
    HINGE = "hinge"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MjcfJoint:
    """A joint of a body."""

    id: int
    name: str
    """Empty where it has none."""
    motion: Motion
    pos: Array
    """In the body, m, shape (3,)."""
    axis: Array
    """Unit vector in the body, shape (3,)."""
    ref: float
    """Coordinate in the pose that the file draws, rad or m."""
    body: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MjcfSite:
    """A site of a body."""

    id: int
    name: str
    body: int
    T_body_site: Array = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MjcfBody:
    """A body."""

    id: int
    name: str
    """Empty where it has none."""
    parent: int
    T_parent_body: Array = field(repr=False)
    """Pose in the parent as the file draws it, shape (4, 4)."""
    joints: tuple[MjcfJoint, ...]
    """Between the parent and the body, in the order in which they move it."""
    sites: tuple[MjcfSite, ...]
    mocap: bool
    """Whether it is moved from outside."""

    @property
    def label(self) -> str:
        """How messages call it."""
        return shown(self.name) if self.name else f"body {self.id} (without a name)"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MjcfTree:
    """All bodies, by number; a body comes after its parent."""

    bodies: tuple[MjcfBody, ...]
    links: LinkTree[int] = field(repr=False)
    """The same bodies, by number; free joints do not count."""

    def rigid(self, body: int) -> tuple[int, ...]:
        """Return a body and those below that are fixed to it, branch by branch."""
        found, waiting = [], [body]
        while waiting:
            found.append(waiting.pop())
            fixed = [child for child in self.links.children[found[-1]] if self.is_fixed(child)]
            waiting += reversed(fixed)
        return tuple(found)

    def is_fixed(self, body: int) -> bool:
        """Whether a body cannot move on its parent."""
        return not self.bodies[body].joints and not self.bodies[body].mocap

    def joints_of(self, bodies: Iterable[int]) -> list[MjcfJoint]:
        """Return the joints of some bodies."""
        return [joint for body in bodies for joint in self.bodies[body].joints]

    def drawn_pose(self, ancestor: int, body: int) -> Array:
        """Return the pose of a body in one above it, as the file draws it, shape (4, 4)."""
        T = identity()
        for step in self.links.way(ancestor, body) or ():
            T = compose(T, self.bodies[step].T_parent_body)
        return T


def read_tree(model: mujoco.MjModel) -> MjcfTree:
    """Return the bodies of a compiled model."""
    joints: list[list[MjcfJoint]] = [[] for _ in range(model.nbody)]
    for i in range(model.njnt):
        joint = _read_joint(model, i)
        joints[joint.body].append(joint)
    sites: list[list[MjcfSite]] = [[] for _ in range(model.nbody)]
    for i in range(model.nsite):
        body = int(model.site_bodyid[i])
        T = pose(model.site_pos[i], model.site_quat[i])
        sites[body].append(MjcfSite(id=i, name=model.site(i).name, body=body, T_body_site=T))
    bodies = tuple(
        MjcfBody(
            id=i,
            name=model.body(i).name,
            parent=int(model.body_parentid[i]),
            T_parent_body=pose(model.body_pos[i], model.body_quat[i]),
            joints=tuple(joints[i]),
            sites=tuple(sites[i]),
            mocap=int(model.body_mocapid[i]) >= 0,
        )
        for i in range(model.nbody)
    )
    children: dict[int, list[int]] = {body.id: [] for body in bodies}
    for child in bodies[1:]:
        children[child.parent].append(child.id)
    links = LinkTree(
        root=WORLD,
        noun="body",
        names={body.id: body.name for body in bodies},
        parents={body.id: body.parent for body in bodies[1:]},
        children=children,
        moving={body.id: sum(joint.motion is not Motion.FREE for joint in body.joints) for body in bodies},
        floating=frozenset(body.id for body in bodies if any(joint.motion is Motion.FREE for joint in body.joints)),
    )
    return MjcfTree(bodies=bodies, links=links)


def _read_joint(model: mujoco.MjModel, i: int) -> MjcfJoint:
    motion = tuple(Motion)[int(model.jnt_type[i])]
    scalar = motion in (Motion.HINGE, Motion.SLIDE)
    return MjcfJoint(
        id=i,
        name=model.joint(i).name,
        motion=motion,
        pos=_clean(model.jnt_pos[i]),
        axis=_clean(model.jnt_axis[i]),
        ref=float(model.qpos0[model.jnt_qposadr[i]]) + 0.0 if scalar else 0.0,
        body=int(model.jnt_bodyid[i]),
    )


def pose(position: Array, quaternion: Array) -> Array:
    """Return the transform of a position (m, shape (3,)) and a quaternion (w, x, y, z), shape (4, 4).

    The quaternion need not be of length 1: its products are divided by the square of its length, and so those of
    right angles come out exact. From zeros, which MuJoCo makes of numbers that are too large, comes NaN.
    """
    w, x, y, z = quaternion.tolist()
    s = w * w + x * x + y * y + z * z or math.nan
    rows = (
        ((w * w + x * x) - (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), (w * w + y * y) - (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), (w * w + z * z) - (x * x + y * y)),
    )
    T = [[*(_snapped(value / s) for value in row), p + 0.0] for row, p in zip(rows, position.tolist(), strict=True)]
    return read_only([*T, [0.0, 0.0, 0.0, 1.0]])


def _snapped(value: float) -> float:
    if abs(value) <= _SNAP:
        return 0.0
    return math.copysign(1.0, value) if abs(abs(value) - 1.0) <= _SNAP else value


def _clean(values: Array) -> Array:
    return read_only([value + 0.0 for value in values.tolist()])
