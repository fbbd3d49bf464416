"""Joints that loops make turn as one, against the motion itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dh2sim.formats.urdf.write import to_urdf
from dh2sim.kinematics.loop_closure import closure_gaps
from dh2sim.kinematics.loop_motion import mechanism_configuration
from dh2sim.kinematics.parallelograms import find_couplings
from dh2sim.model.mechanism import build_mechanism
from dh2sim.robot.read import load_robot, parse_robot

TEXT = Path("robots/mechanisms/parallel_four_bar.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize(("name", "count", "carried"), [("parallel_four_bar", 3, 2), ("delta", 9, 3)])
def test_coupled_joints_keep_their_relation_wherever_the_mechanism_moves(name: str, count: int, carried: int) -> None:
    spec = load_robot(name)
    found, start = find_couplings(spec), build_mechanism(spec).q
    assert (len(found.joints), len(found.closures)) == (count, carried)
    names = [row.name for row in spec.moving_rows]
    places = [names.index(joint) for joint in spec.actuated or ()]
    for driven in (0.1, -0.2):
        q = mechanism_configuration(spec, [start[k] + driven * (1 + 0.3 * i) for i, k in enumerate(places)])
        for k, (root, sign, offset) in found.joints.items():
            assert q[k] == pytest.approx(sign * q[root] + offset, abs=1e-9)


@pytest.mark.parametrize("name", ["four_bar", "bennett", "sarrus", "slider_crank", "stewart", "stretched_four_bar"])
def test_other_loops_couple_nothing(name: str) -> None:
    assert find_couplings(load_robot(name)) == ({}, ())


def _four_bar(second: str, assembly: str) -> str:
    """The parallelogram alone, with another second crank or assembled otherwise."""
    kept = [line for line in TEXT.splitlines() if "third_crank" not in line and not line.startswith("assembly")]
    text = "\n".join([*kept, f"assembly: {{q: [{assembly}]}}"])
    return text.replace("joints: [{type: continuous, a: crank}]}", f"joints: [{{type: continuous, a: {second}}}]}}")


def test_a_parallelogram_that_is_nearly_one_or_crossed_couples_nothing() -> None:
    assert find_couplings(parse_robot(_four_bar("crank", "60, -60, 60"))).closures == ("B",)
    assert find_couplings(parse_robot(_four_bar("crank + 1 / 100000", "60, -60, 60"))).closures == ()
    assert find_couplings(parse_robot(_four_bar("crank", "60, -110, -125"))).closures == ()


def test_the_urdf_says_what_mimics_what() -> None:
    urdf = to_urdf(build_mechanism(load_robot("parallel_four_bar")))
    assert '<mimic joint="joint_1" multiplier="-1.0" offset="0.0" />' in urdf
    assert urdf.count("<mimic ") == 3
    assert "<mimic" not in to_urdf(build_mechanism(load_robot("four_bar")))


def test_poses_that_follow_from_the_mimicking_joints_alone_close_the_loops() -> None:
    model = build_mechanism(load_robot("parallel_four_bar"))
    for angle in np.linspace(-3, 3, 7):
        q = np.zeros(model.tree.n)
        q[0] = angle
        for k, (root, sign, offset) in find_couplings(model.spec).joints.items():
            q[k] = sign * q[root] + offset
        assert max(gap.position for gap in closure_gaps(model.tree, q)) < 1e-12
