"""Mechanisms by points and axes, as textbooks draw them; none is a robot file."""

from __future__ import annotations

from math import asin, atan, cos, pi, sin, tan

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.mobility.mechanism import Mechanism, Pair, pair

X, Y, Z = np.eye(3)


def linkage(name: str, *joints: tuple[str, str, str, ArrayLike, tuple[ArrayLike, ...]]) -> Mechanism:
    """A mechanism of joints (type, link, next link, point, axes); the first link is the ground."""
    links: list[str] = []
    for _, a, b, _, _ in joints:
        links += [link for link in (a, b) if link not in links]
    made = [
        pair(f"J{k}", kind, (links.index(a), links.index(b)), point, *axes)
        for k, (kind, a, b, point, axes) in enumerate(joints, 1)
    ]
    return Mechanism(name=name, links=tuple(links), joints=tuple(made))


def loop(*joints: tuple[str, ArrayLike, ArrayLike]) -> Mechanism:
    """One closed loop of joints (type, point, axis), the first on the ground."""
    count = len(joints)
    links = [f"L{k}" for k in range(count)]
    return linkage(
        "loop",
        *(
            (kind, links[k], links[(k + 1) % count], point, () if kind == "spherical" else (axis,))
            for k, (kind, point, axis) in enumerate(joints)
        ),
    )


def planar_loop(*points: ArrayLike) -> Mechanism:
    """Revolute joints about z at points of the plane."""
    return loop(*(("revolute", (*np.asarray(point, dtype=float), 0.0), Z) for point in points))


def spherical_loop(*axes: ArrayLike) -> Mechanism:
    """Revolute joints whose axes meet."""
    return loop(*(("revolute", (0.3, -0.2, 0.5), axis) for axis in axes))


def cranks(*bars: tuple[ArrayLike, ArrayLike]) -> Mechanism:
    """A ground and a platform, joined by bars in the plane, each given by its two ends."""
    joints = []
    for k, (foot, head) in enumerate(bars, 1):
        joints.append(("revolute", "ground", f"crank {k}", (*np.asarray(foot, dtype=float), 0.0), (Z,)))
        joints.append(("revolute", f"crank {k}", "platform", (*np.asarray(head, dtype=float), 0.0), (Z,)))
    return linkage("cranks", *joints)


def bennett(a: float, alpha: float, b: float, theta: float) -> Mechanism:
    """Bennett's loop, with a sin(beta) = b sin(alpha); see Hunt, *Kinematic Geometry of Mechanisms*, chapter 11."""
    beta = asin(sin(alpha) * b / a)
    phi = 2 * atan(sin((beta + alpha) / 2) / sin((beta - alpha) / 2) / tan(theta / 2))
    T, joints = np.eye(4), []
    for length, twist, turn in ((a, alpha, theta), (b, beta, phi), (a, alpha, -theta), (b, beta, -phi)):
        T = T @ _turn_about_z(turn)
        joints.append(("revolute", T[:3, 3].copy(), T[:3, 2].copy()))
        T = T @ np.array(
            [[1, 0, 0, length], [0, cos(twist), -sin(twist), 0], [0, sin(twist), cos(twist), 0], [0, 0, 0, 1]]
        )
    assert np.allclose(T, np.eye(4), atol=1e-12)
    return loop(*joints)


def _turn_about_z(angle: float) -> np.ndarray:
    c, s = cos(angle), sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])


def sarrus() -> Mechanism:
    """Two planar legs in planes across each other guide a plate straight up."""
    return linkage(
        "sarrus",
        ("revolute", "ground", "A1", (1, 0, 0), (Y,)),
        ("revolute", "A1", "A2", (1.4, 0, 0.5), (Y,)),
        ("revolute", "A2", "plate", (1, 0, 1), (Y,)),
        ("revolute", "ground", "B1", (0, 1, 0), (X,)),
        ("revolute", "B1", "B2", (0, 1.4, 0.5), (X,)),
        ("revolute", "B2", "plate", (0, 1, 1), (X,)),
    )


def delta(rods: str) -> Mechanism:
    """Clavel's Delta; its rods end in spherical joints, or are the long sides of revolute parallelograms."""
    joints: list[tuple[str, str, str, ArrayLike, tuple[ArrayLike, ...]]] = []
    for k in range(3):
        turn = 2 * pi * k / 3
        out, along = np.array([cos(turn), sin(turn), 0]), np.array([-sin(turn), cos(turn), 0])
        elbow = 0.2 * out + 0.2 * (0.6 * out - 0.8 * Z)
        wrist = 0.05 * out - 0.5 * Z
        joints.append(("revolute", "base", f"arm {k}", 0.2 * out, (along,)))
        if rods == "spherical":
            for side in (-1, 1):
                rod = f"rod {k} {side:+}"
                joints.append(("spherical", f"arm {k}", rod, elbow + 0.03 * side * along, ()))
                joints.append(("spherical", rod, "plate", wrist + 0.03 * side * along, ()))
            continue
        across = np.cross(along, wrist - elbow)
        joints.append(("revolute", f"arm {k}", f"upper {k}", elbow, (along,)))
        for side in (-1, 1):
            rod = f"rod {k} {side:+}"
            joints.append(("revolute", f"upper {k}", rod, elbow + 0.03 * side * along, (across,)))
            joints.append(("revolute", rod, f"lower {k}", wrist + 0.03 * side * along, (across,)))
        joints.append(("revolute", f"lower {k}", "plate", wrist, (along,)))
    return linkage("delta", *joints)


def stewart(first: str = "universal", legs: int = 6) -> Mechanism:
    """Legs of variable length between a base and a plate; their lower joints are universal or spherical."""
    joints: list[tuple[str, str, str, ArrayLike, tuple[ArrayLike, ...]]] = []
    for k in range(legs):
        below, above = pi / 3 * k + (0.2 if k % 2 else -0.2), pi / 3 * k + (-0.3 if k % 2 else 0.3)
        foot = np.array([cos(below), sin(below), 0.0])
        head = np.array([0.6 * cos(above), 0.6 * sin(above), 1.0])
        leg = head - foot
        across = np.cross(leg, Z)
        axes: tuple[ArrayLike, ...] = (across, np.cross(leg, across)) if first == "universal" else ()
        joints.append((first, "base", f"cylinder {k}", foot, axes))
        joints.append(("prismatic", f"cylinder {k}", f"piston {k}", foot, (leg,)))
        joints.append(("spherical", f"piston {k}", "plate", head, ()))
    return linkage("stewart", *joints)


def random_loop(count: int, seed: int) -> Mechanism:
    """Revolute joints with axes anywhere."""
    random = np.random.default_rng(seed)
    return loop(*(("revolute", random.normal(size=3), random.normal(size=3)) for _ in range(count)))


def with_axis_turned(mechanism: Mechanism, joint: int, axis: ArrayLike) -> Mechanism:
    """The same assembly, with another direction of one joint's axis."""
    old = mechanism.joints[joint]
    new: Pair = pair(old.name, old.type, old.links, old.point, axis)
    joints = (*mechanism.joints[:joint], new, *mechanism.joints[joint + 1 :])
    return Mechanism(name=mechanism.name, links=mechanism.links, joints=joints)
