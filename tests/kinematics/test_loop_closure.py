"""Loops are closed, and their constraints are what finite differences say."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.errors import AssemblyError
from dh2sim.kinematics.loop_closure import (
    FREEDOMS,
    ClosureGap,
    assembly,
    close_loops,
    closure_gaps,
    constraint_jacobian,
)
from dh2sim.kinematics.tree import build_tree, tree_frames
from dh2sim.robot.catalog import builtin_mechanisms
from dh2sim.robot.mechanism import ClosureType
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.refusals import refusal
from tests.robot.test_mechanism_file import FOUR_BAR


def _loop(kind: str, *, closure: str = "[dh_3, side/dh_3]", assembly: str = "") -> RobotSpec:
    """Two odd chains of three joints and a slide, closed by a joint."""
    return parse_robot(
        f"""\
name: loop
convention: standard
base: {{xyz: [0.1, -0.2, 0.3], rpy: [0.2, -0.4, 1.1]}}
joints:
  - {{type: revolute, a: 0.3, alpha: 0.651, d: 0.1, theta: 0.2}}
  - {{type: prismatic, convention: modified, a: 0.2, alpha: -0.7, theta: 0.4, flip: true}}
  - {{type: revolute, a: 0.25, alpha: 0.4, d: 0.2, flip: true}}
branches:
  side:
    from: link_1
    pose: {{xyz: [0.3, 0.2, -0.1], rpy: [0.7, 0.3, -0.2]}}
    joints:
      - {{type: revolute, a: 0.4, alpha: -0.651}}
      - {{type: revolute, a: 0.2, alpha: 0.9, d: 0.1}}
      - {{type: revolute, convention: modified, a: 0.3, alpha: 0.3, d: -0.1}}
closures:
  - {{between: {closure}, type: {kind}}}
{assembly}
"""
    )


@pytest.mark.parametrize("kind", list(ClosureType))
def test_the_constraint_jacobian_is_the_derivative_of_the_frames(kind: ClosureType) -> None:
    """The oracle: b's velocity relative to a by finite differences, and what each joint forbids of it by its name."""
    tree = build_tree(_loop(kind))
    q = np.array([0.3, 0.2, -0.4, 0.9, -0.2, 0.6])
    step = 1e-6
    columns = []
    for k in range(tree.n):
        ahead, behind = (tree_frames(tree, q + sign * step * np.eye(tree.n)[k]) for sign in (1, -1))
        T = [np.linalg.inv(frames["dh_3"]) @ frames["side/dh_3"] for frames in (ahead, behind)]
        R = T[0][:3, :3] @ T[1][:3, :3].T
        spin = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
        columns.append(np.concatenate([T[0][:3, 3] - T[1][:3, 3], spin]) / (2 * step))
    twist = np.array(columns).T
    frames = tree_frames(tree, q)
    zb = (frames["dh_3"][:3, :3].T @ frames["side/dh_3"][:3, :3])[:, 2]
    cross = np.cross(zb, [0, 0, 1])
    forbidden = {
        "revolute": twist[:5],
        "spherical": twist[:3],
        "universal": np.vstack([twist[:3], cross / np.linalg.norm(cross) @ twist[3:]]),
        "cylindrical": twist[[0, 1, 3, 4]],
        "prismatic": twist[[0, 1, 3, 4, 5]],
        "fixed": twist,
    }[kind.value]
    J = constraint_jacobian(tree, q)
    assert len(J) == 6 - FREEDOMS[kind]
    assert np.abs(J - forbidden).max() < 1e-8


def _coincide(kind: str, a: Array, b: Array) -> float:
    """How far two frames are from what a joint between them lets them be."""
    offset = a[:3, :3].T @ (b[:3, 3] - a[:3, 3])
    z, zb = a[:3, 2], b[:3, 2]
    apart: dict[str, object] = {
        "revolute": [*offset, *(z - zb)],
        "spherical": offset,
        "universal": [*offset, z @ zb],
        "cylindrical": [*offset[:2], *(z - zb)],
        "prismatic": [*offset[:2], *(a[:3, :3] - b[:3, :3]).ravel()],
        "fixed": (a - b).ravel(),
    }
    return float(np.abs(np.array(apart[kind])).max())


@pytest.mark.parametrize("kind", ["spherical", "universal", "cylindrical"])
@given(q=st.lists(st.floats(-0.25, 0.25), min_size=5, max_size=5))
def test_loops_are_closed_from_nearby(kind: str, q: list[float]) -> None:
    """Chains with enough joints meet from wherever they start, if that is near a closed configuration."""
    spec = _loop(kind)
    tree = build_tree(spec)
    try:
        closed = close_loops(tree, [*q, 0.1])
    except AssemblyError:
        return
    frames = tree_frames(tree, closed)
    assert _coincide(kind, frames["dh_3"], frames["side/dh_3"]) < 4e-12
    assert max(max(gap.position, gap.rotation) for gap in closure_gaps(tree, closed)) <= 1e-12


@pytest.mark.parametrize("name", builtin_mechanisms())
def test_mechanisms_that_come_with_dh2sim_are_closed_to_1e_12(name: str) -> None:
    spec = load_robot(name)
    tree, q = assembly(spec)
    frames = tree_frames(tree, q)
    for closure in spec.closures:
        a, b = (frames[frame] for frame in closure.between)
        assert _coincide(closure.type.value, a, b) < 2e-12


def test_the_guess_picks_the_assembly_mode() -> None:
    for guess, sign in (("[70, -50, 100]", -1), ("[70, -130, -140]", 1)):
        text = FOUR_BAR.replace("[70, -50, 100]", guess)
        tree, q = assembly(parse_robot(text))
        frames = tree_frames(tree, q)
        B, C, D = (frames[name][:2, 3] for name in ("dh_1", "dh_2", "rocker/dh_0"))
        side = (C - B)[0] * (D - B)[1] - (C - B)[1] * (D - B)[0]
        assert math.copysign(1, side) == sign


def test_a_loop_that_cannot_be_closed_says_by_how_much() -> None:
    text = FOUR_BAR.replace("a: 1400", "a: 9000")
    message = refusal(AssemblyError, assembly, parse_robot(text, file="m.yaml"))
    found = "m.yaml:13:15: assembly.q: the loops cannot be closed: C stays open by "
    assert message.startswith(found)
    gap = float(message.removeprefix(found).split(" mm")[0])
    assert gap == pytest.approx(9000 - 2000 - 600 - 1800, abs=60)
    assert str(ClosureGap(name="C", position=0.03, rotation=3e-16)) == "C stays open by 30 mm and 0 deg"


def test_a_loop_without_assembly_is_closed_from_anywhere() -> None:
    text = "".join(line for line in FOUR_BAR.splitlines(keepends=True) if "assembly" not in line)
    tree, q = assembly(parse_robot(text))
    assert max(gap.position for gap in closure_gaps(tree, q)) <= 2e-12


def test_a_closed_configuration_outside_the_limits_is_refused() -> None:
    limits = {"a: 600}": "a: 600, limits: [69, 71]}", "a: 1800}": "a: 1800, limits: [-51, -49.5]}"}
    text = FOUR_BAR
    for old, new in limits.items():
        text = text.replace(old, new)
    message = refusal(AssemblyError, assembly, parse_robot(text, file="m.yaml"))
    assert message.startswith("m.yaml:13:15: assembly.q: where the loops are closed, joint_1 is at ")
    assert message.endswith("outside its limits of 69 to 71 deg")
