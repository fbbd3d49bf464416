"""What a drawing of a mechanism shows, in space: the chains of its tree, and the joints that close loops."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.draw.diagram.arm import Arm, ClosurePlace, JointPlace, Path, lengths_of, place_joints
from dh2sim.draw.frame_figure.scene import SAME, Segment, distinct
from dh2sim.draw.projection import ParallelView
from dh2sim.kinematics.loop_motion import actuated_joints, mechanism_configuration, named_configuration
from dh2sim.kinematics.tree import BASE, KinematicTree, build_tree, tree_frames
from dh2sim.robot.mechanism import ClosureType
from dh2sim.robot.row import JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.yaml_tree import Node, Report, compose
from dh2sim.typing import Array, read_only

_UNTURNED = 1e-6
"""Directions closer than this are parallel, or at right angles."""


def place_mechanism(spec: RobotSpec, q: ArrayLike | str) -> Arm:
    """Place the frames, joints and closures of a mechanism.

    Its joints are numbered as they are in a joint vector.

    Args:
        spec: The mechanism.
        q: Joint vector of all joints or of the driven ones, rad and m; or the name of a configuration.

    Raises:
        ConfigurationError: ``q`` is none.
        AssemblyError: The loops cannot be closed.
        SingularPositionError: On the way to ``q`` from the assembly is a dead or singular position.
    """
    vector = named_configuration(spec, q) if isinstance(q, str) else mechanism_configuration(spec, q)
    tree = build_tree(spec)
    poses = tree_frames(tree, vector)
    chains = {"": spec.rows, **{f"{name}/": branch.rows for name, branch in spec.branches.items()}}
    moving = [row.name for row in spec.moving_rows]
    driven = [moving[k] for k in actuated_joints(spec)] if spec.actuated is not None else []
    paths: list[Path] = []
    named: dict[str, Array] = {}
    bodies: list[JointPlace] = []
    for prefix, rows in chains.items():
        frames = {name: poses[name] for name in (f"{prefix}dh_{k}" for k in range(len(rows) + 1))}
        numbers = [1 + moving.index(row.name) if row.type.moves else 0 for row in rows]
        joints = place_joints(rows, list(frames.values()), numbers, driven)
        start = [frames[f"{prefix}dh_0"][:3, 3]]
        if prefix and tree.frame(f"{prefix}dh_0").body != BASE:
            start.insert(0, poses[spec.branches[prefix[:-1]].origin][:3, 3])
        paths.append(Path(start=tuple(start), joints=joints, end=() if prefix else (poses["tool0"][:3, 3],)))
        named |= frames
        bodies += joints
    everything = np.concatenate([path.points for path in paths])
    reach = float(np.linalg.norm(np.ptp(everything, axis=0))) or 1.0
    closures = tuple(
        ClosurePlace(name=each.name, type=each.type, T_base_a=poses[each.a], T_base_b=poses[each.b])
        for each in tree.closures
    )
    segments = [
        segment
        for (prefix, rows), path in zip(chains.items(), paths, strict=True)
        for segment in _lengths(spec, prefix[:-1], rows, path.joints, SAME * reach)
    ]
    grounds = [poses[f"{prefix}dh_0"][:3, 3] for prefix in chains if tree.frame(f"{prefix}dh_0").body == BASE]
    grounds += [poses[name][:3, 3] for each in tree.closures for name in (each.a, each.b) if _is_base(tree, name)]
    return Arm(
        spec=spec,
        frames=np.array(list(named.values())),
        T_base_tool=poses["tool0"],
        joints=tuple(bodies),
        segments=tuple(segments),
        reach=reach,
        paths=tuple(paths),
        grounds=tuple(distinct(grounds, SAME * reach)),
        names=tuple(named),
        closures=closures,
        plates=tuple(_plates(tree, bodies, poses, SAME * reach)),
    )


def _lengths(
    spec: RobotSpec, branch: str, rows: Sequence[Row], joints: Sequence[JointPlace], least: float
) -> Iterator[Segment]:
    """Yield the lengths of a chain that no joint changes, with the names of parameters that the file writes there.

    Without a name they are a and d of the coordinate that the row has in the joint vector; those of fixed rows, and
    of modified ones, whose a is of the joint before, are left out then.
    """
    source = spec.source_file
    tree = None if source is None else compose(source.text, Report(source.name))
    table = ("branches", branch, "joints") if branch else ("joints",)
    for k, (row, joint) in enumerate(zip(rows, joints, strict=True)):
        for segment in lengths_of([row], [joint], least):
            if segment.letter == "d" and row.type is JointType.PRISMATIC:
                continue
            length = float(np.linalg.norm(segment.end - segment.start))
            name = _parameter(spec, None if tree is None else tree.at(*table, k, segment.letter), length)
            if name or segment.index == joint.index > 0:
                yield replace(segment, name=name)


def _parameter(spec: RobotSpec, cell: Node | None, length: float) -> str:
    """Return the name of the parameter that a cell is, with either sign, or the empty text."""
    name = "" if cell is None else cell.text.strip().lstrip("-").strip()
    known = abs(spec.parameters.get(name, math.inf)) * spec.units.coordinate(1.0, turns=False)
    return name if math.isclose(known, length, rel_tol=1e-9) else ""


def plane_view(arm: Arm) -> ParallelView | None:
    """Return the view across the plane in which all of a mechanism moves; None where it moves in space."""
    turning = [joint.direction for joint in arm.joints if joint.type.moves and joint.type.turns]
    sliding = [joint.direction for joint in arm.joints if joint.type is JointType.PRISMATIC]
    turning += [each.T_base_a[:3, 2] for each in arm.closures if each.type is ClosureType.REVOLUTE]
    sliding += [each.T_base_a[:3, 2] for each in arm.closures if each.type is ClosureType.PRISMATIC]
    spatial = {ClosureType.SPHERICAL, ClosureType.UNIVERSAL, ClosureType.CYLINDRICAL}
    if not turning or any(each.type in spatial for each in arm.closures):
        return None
    x, y, z = (round(value, 9) + 0.0 for value in turning[0].tolist())
    towards = (
        turning[0] if (z, -y, x) > (0.0, 0.0, 0.0) else -turning[0]
    )  # from above, from the front, from the right
    if any(np.linalg.norm(np.cross(towards, other)) > _UNTURNED for other in turning):
        return None
    if any(abs(float(towards @ other)) > _UNTURNED for other in sliding):
        return None
    right = np.array([1.0, 0.0, 0.0]) if np.hypot(x, y) <= _UNTURNED else np.array([-towards[1], towards[0], 0.0])
    right /= np.linalg.norm(right)
    return ParallelView(right=read_only(right), up=read_only(np.cross(towards, right)))


def _is_base(tree: KinematicTree, frame: str) -> bool:
    return tree.frame(frame).body == BASE


def _plates(
    tree: KinematicTree, joints: list[JointPlace], poses: Mapping[str, Array], least: float
) -> Iterator[Array]:
    """Yield where each link that has three joints or more has them."""
    link = {BASE: BASE}
    for body, (joint, parent) in enumerate(zip(tree.joints, tree.parents, strict=True)):
        link[body] = body if joint.type.moves else link[parent]
    for body in range(len(tree.joints)):
        if link[body] != body:
            continue
        held = [joints[body].left]
        held += [
            joints[k].reached
            for k, parent in enumerate(tree.parents)
            if link[parent] == body and tree.joints[k].type.moves
        ]
        ends = [name for each in tree.closures for name in (each.a, each.b)]
        held += [poses[name][:3, 3] for name in (*ends, "tool0") if link[tree.frame(name).body] == body]
        places = distinct(held, least)
        if len(places) > 2:
            yield np.array(places)
