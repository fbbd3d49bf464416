"""Mass matrix and gravity forces of an arm, composed from nothing but the inertials and joints of a URDF.

Neither the reader's merging of links nor any frame of a table has a part in this, so that what was imported can be
compared with it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dh2sim.formats.serial_robot import Mechanics
from dh2sim.formats.urdf.tree import read_numbers, read_pose
from dh2sim.formats.xml_read import Element, XmlReport
from dh2sim.kinematics.rotations import rotations_about
from dh2sim.kinematics.transforms import identity
from dh2sim.typing import Array

UP = (0.0, 0.0, -9.81)
"""m/s²: gravity in the root of a URDF."""
MAX_ENTRIES = 500_000
"""Pairs of joint and link that are computed at once, over all configurations."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Link:
    """A link below an arm, with the joint that carries it."""

    parent: str
    name: str
    T_parent_joint: Array
    axis: Array
    joint: int | None
    """Number of the joint on the arm; None for one that stays as it is."""
    turns: bool
    mass: float
    com: Array
    inertia: Array
    """About the centre of mass, along the link's axes."""


def urdf_mechanics(robot: Element, arm: Sequence[str], *, gravity: Sequence[float] = UP) -> Mechanics:
    """Return the mass matrices and gravity forces of an arm as functions of its coordinates.

    Args:
        robot: Root element of the URDF, which was read without errors.
        arm: Names of the arm's joints; what other joints carry is left out, and fixed links count as they are.
        gravity: m/s² in the root.
    """
    links = list(_links(robot, list(arm)))
    chunk = max(1, MAX_ENTRIES // max(1, len(arm) * len(links)))

    def terms(q: Array) -> tuple[Array, Array]:
        parts = [_terms(links, q[k : k + chunk], np.array(gravity)) for k in range(0, len(q), chunk)]
        return np.concatenate([mass for mass, _ in parts]), np.concatenate([load for _, load in parts])

    return terms


def _terms(links: Sequence[_Link], q: Array, gravity: Array) -> tuple[Array, Array]:
    """Return the sums over all links: of the inertias that joints move, and of the weights that they carry."""
    count, n = q.shape
    axes, origins, turns = np.zeros((n, count, 3)), np.zeros((n, count, 3)), np.zeros((n, 1, 1), dtype=bool)
    linear, angular = np.zeros((count, n, len(links), 3)), np.zeros((count, n, len(links), 3))
    tensors = np.zeros((count, len(links), 3, 3))
    root = np.broadcast_to(identity(), (count, 4, 4))
    poses: dict[str, tuple[Array, tuple[int, ...]]] = {}
    for k, link in enumerate(links):
        T_parent, moving = poses.get(link.parent, (root, ()))
        T = T_parent @ link.T_parent_joint
        if (j := link.joint) is not None:
            axes[j], origins[j], turns[j] = T[:, :3, :3] @ link.axis, T[:, :3, 3], link.turns
            moving = (*moving, j)
            T = T @ _moved(link, q[:, j])
        poses[link.name] = (T, moving)
        if link.mass <= 0.0 or not moving:
            continue
        own, R = list(moving), T[:, :3, :3]
        com = T[:, :3, 3] + R @ link.com
        axis, turn = axes[own], turns[own]
        linear[:, own, k] = np.where(turn, np.cross(axis, com - origins[own]), axis).swapaxes(0, 1)
        angular[:, own, k] = np.where(turn, axis, 0.0).swapaxes(0, 1)
        tensors[:, k] = R @ link.inertia @ R.swapaxes(1, 2)
    momentum = linear * np.array([[link.mass] for link in links])
    turned = np.einsum("klab,knlb->knla", tensors, angular)
    whole = (count, n, -1)
    mass = momentum.reshape(whole) @ linear.reshape(whole).swapaxes(1, 2)
    mass += turned.reshape(whole) @ angular.reshape(whole).swapaxes(1, 2)
    return mass, -(momentum.sum(axis=2) @ gravity)


def _moved(link: _Link, values: Array) -> Array:
    """Return the motions of a joint by some coordinates, shape (N, 4, 4)."""
    T = np.zeros((len(values), 4, 4)) + np.eye(4)
    if not link.turns:
        T[:, :3, 3] = values[:, None] * link.axis
        return T
    T[:, :3, :3] = rotations_about(link.axis, values)
    return T


def _links(robot: Element, arm: list[str]) -> list[_Link]:
    """Return the links from the root down, without what joints carry that move and are not on the arm."""
    elements = {link.attributes["name"]: link for link in robot.all("link")}
    below: dict[str, list[tuple[str, Element]]] = {}
    children = set()
    for joint in robot.all("joint"):
        above, child = joint.first("parent"), joint.first("child")
        if above is not None and child is not None:
            name = child.attributes["link"]
            below.setdefault(above.attributes["link"], []).append((name, joint))
            children.add(name)
    found: list[_Link] = []
    waiting = [(name, False) for name in elements if name not in children]
    while waiting:
        parent, on_arm = waiting.pop()
        for name, joint in below.get(parent, []):
            moves = joint.attributes.get("name") in arm
            if on_arm and not moves and joint.attributes.get("type") != "fixed":
                continue
            found.append(_link(parent, elements[name], joint, arm))
            waiting.append((name, on_arm or moves))
    return found


def _link(parent: str, element: Element, joint: Element, arm: list[str]) -> _Link:
    unread = XmlReport("")
    name = joint.attributes.get("name", "")
    axis_element = joint.first("axis")
    axis = (1.0, 0.0, 0.0)
    if axis_element is not None:
        axis = read_numbers(axis_element, "xyz", "", unread, count=3, default=axis)  # type: ignore[assignment]
    length = math.hypot(*axis)
    mass, com, inertia = _inertial(element)
    return _Link(
        parent=parent,
        name=element.attributes["name"],
        T_parent_joint=read_pose(joint, "", unread),
        axis=np.array(axis) / (length or 1.0),
        joint=arm.index(name) if name in arm else None,
        turns=joint.attributes.get("type") != "prismatic",
        mass=mass,
        com=com,
        inertia=inertia,
    )


def _inertial(link: Element) -> tuple[float, Array, Array]:
    """Return mass, centre of mass and tensor along the link's axes; zeros for a link without."""
    nothing = 0.0, np.zeros(3), np.zeros((3, 3))
    inertial = link.first("inertial")
    mass = None if inertial is None else inertial.first("mass")
    if inertial is None or mass is None:
        return nothing
    unread = XmlReport("")
    [value] = read_numbers(mass, "value", "", unread, count=1, default=(0.0,))
    tensor = inertial.first("inertia")

    def moment(key: str) -> float:
        return 0.0 if tensor is None else read_numbers(tensor, key, "", unread, count=1, default=(0.0,))[0]

    T = read_pose(inertial, "", unread)
    I = np.array([[moment(f"i{min(a, b)}{max(a, b)}") for b in "xyz"] for a in "xyz"])  # noqa: E741
    if not math.isfinite(value) or not np.isfinite(I).all():
        return nothing
    return value, T[:3, 3], T[:3, :3] @ I @ T[:3, :3].T
