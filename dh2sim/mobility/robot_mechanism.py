"""The mechanism of a robot file, as it is at its assembly: rows that are fixed and fixed closures make one link."""

from __future__ import annotations

from collections.abc import Sequence

from dh2sim.kinematics.loop_closure import assembly
from dh2sim.kinematics.tree import BASE, Closure, KinematicTree, body_poses, placed
from dh2sim.mobility.analysis import mobility_of
from dh2sim.mobility.mechanism import Mechanism, Pair, PairType, pair
from dh2sim.mobility.result import Mobility
from dh2sim.robot.mechanism import ClosureType
from dh2sim.robot.spec import SpecLike, spec_of
from dh2sim.typing import Array


def find_mobility(robot: SpecLike) -> Mobility:
    """Count the degrees of freedom of a robot or a mechanism, and find out what they are.

    Position limits and collisions are not looked at.

    Args:
        robot: A serial robot, or one with branches and closed loops.

    Returns:
        Gruebler's count; the instantaneous mobility, by the rank of the loops' constraints at the assembly; the
        finite one, by walking along them; and a verdict in words.

    Raises:
        AssemblyError: Loops cannot be closed.
    """
    return mobility_of(mechanism_of(robot))


def mechanism_of(robot: SpecLike) -> Mechanism:
    """Return the links and joints of a robot at its assembly; at ``home`` where it has no loops.

    Raises:
        AssemblyError: Loops cannot be closed.
    """
    spec = spec_of(robot)
    tree, q = assembly(spec)
    poses = body_poses(tree, q)
    rigid = _rigid_bodies(tree)
    bodies = sorted(set(rigid.values()))
    index = {body: bodies.index(link) for body, link in rigid.items()}
    joints = [
        pair(
            joint.name,
            PairType.REVOLUTE if joint.type.turns else PairType.PRISMATIC,
            (index[parent], index[body]),
            poses[body][:3, 3],
            poses[body][:3, 2],
        )
        for body, (joint, parent) in enumerate(zip(tree.joints, tree.parents, strict=True))
        if joint.type.moves
    ]
    joints += [
        _closing_pair(tree, closure, poses, index)
        for closure in tree.closures
        if closure.type is not ClosureType.FIXED
    ]
    names = _body_names(tree)
    limbs: dict[frozenset[int], str] = {}
    for branch in spec.branches:
        limbs[frozenset(index[body] for body, name in names.items() if name.startswith(f"{branch}/"))] = branch
    return Mechanism(
        name=spec.name,
        links=tuple(names[body] for body in bodies),
        joints=tuple(joints),
        actuated=spec.actuated,
        limb_names=limbs,
    )


def _rigid_bodies(tree: KinematicTree) -> dict[int, int]:
    """Return the first body of the link that each body belongs to."""
    first = {body: body for body in range(BASE, len(tree.joints))}
    fixed = [(tree.parents[body], body) for body, joint in enumerate(tree.joints) if not joint.type.moves]
    fixed += [
        (tree.frame(closure.a).body, tree.frame(closure.b).body)
        for closure in tree.closures
        if closure.type is ClosureType.FIXED
    ]
    for a, b in fixed:
        kept, gone = sorted((first[a], first[b]))
        first = {body: kept if link == gone else link for body, link in first.items()}
    return first


def _closing_pair(tree: KinematicTree, closure: Closure, poses: Sequence[Array], index: dict[int, int]) -> Pair:
    a, b = tree.frame(closure.a), tree.frame(closure.b)
    T_base_a, T_base_b = placed(poses, a), placed(poses, b)
    axes = [] if closure.type is ClosureType.SPHERICAL else [T_base_a[:3, 2]]
    if closure.type is ClosureType.UNIVERSAL:
        axes.append(T_base_b[:3, 2])
    return pair(closure.name, closure.type.value, (index[a.body], index[b.body]), T_base_a[:3, 3], *axes)


def _body_names(tree: KinematicTree) -> dict[int, str]:
    """Return the name of each body: base_link, link_1, rocker/link_1."""
    names = {BASE: "base_link"}
    for name, frame in tree.frames.items():
        if name.rpartition("/")[2].startswith("link_"):
            names[frame.body] = name
    return names
