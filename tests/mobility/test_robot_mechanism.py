"""The mechanisms that come with dh2sim, and robot files of others, against what is known of them."""

from __future__ import annotations

import math
import time
from pathlib import Path

import numpy as np
import pytest

from dh2sim import Robot, find_mobility, parse_robot
from dh2sim.kinematics.loop_closure import assembly, constraint_jacobian
from dh2sim.kinematics.loop_motion import mechanism_pose
from dh2sim.mobility.result import Mobility
from dh2sim.robot.catalog import builtin_mechanisms, builtin_path, builtin_robots
from dh2sim.robot.read import load_robot
from tests.program import dh2sim

KNOWN = {
    "bennett": (4, 4, 6, -2, 1, 1),
    "delta": (17, 21, 6, -9, 3, 3),
    "five_bar": (5, 5, 3, 2, 2, 2),
    "four_bar": (4, 4, 3, 1, 1, 1),
    "parallel_four_bar": (5, 6, 3, 0, 1, 1),
    "sarrus": (6, 6, 6, 0, 1, 1),
    "seven_link_arm": (7, 6, 6, 6, 6, 6),
    "slider_crank": (4, 4, 3, 1, 1, 1),
    "spherical_four_bar": (4, 4, 3, 1, 1, 1),
    "stewart": (22, 26, 6, 6, 6, 6),
    "stretched_four_bar": (4, 4, 3, 1, 2, 0),
    "universal_joint": (3, 2, 3, 2, 2, 2),
}
"""Links, joints, lambda, count, instantaneous and finite mobility."""
HEAD = "name: m\nconvention: standard\nunits: {angle: deg}\n"


def of(text: str) -> Mobility:
    return find_mobility(parse_robot(HEAD + text))


def test_every_shipped_mechanism_is_known() -> None:
    assert set(KNOWN) == set(builtin_mechanisms())


@pytest.mark.parametrize("name", sorted(KNOWN))
def test_shipped_mechanisms_have_the_mobility_of_books(name: str) -> None:
    robot = Robot.load(name)
    started = time.process_time()
    found = robot.mobility()
    assert time.process_time() - started < 2.0
    numbers = found.to_dict()
    keys = ("links", "joints", "lambda", "gruebler", "instantaneous", "finite")
    assert tuple(numbers[key] for key in keys) == KNOWN[name]
    assert numbers["constraints_form"] == numbers["gruebler"]
    assert sum(numbers["freedoms"]) == found.mechanism.freedoms


@pytest.mark.parametrize("name", sorted(KNOWN))
def test_instantaneous_mobility_is_that_of_the_closures_constraints(name: str) -> None:
    """The Jacobian of the closures is made from their frames, without screws and without closing joints."""
    spec = load_robot(name)
    if not spec.closures:
        return
    tree, q = assembly(spec)
    rank = np.linalg.matrix_rank(constraint_jacobian(tree, q), tol=1e-8)
    assert find_mobility(spec).instantaneous == tree.n - rank


def test_mechanisms_say_where_their_numbers_come_from() -> None:
    for name in KNOWN:
        path = builtin_path(name)
        assert path is not None
        spec = load_robot(path)
        assert spec.name == name
        assert "nvented" in spec.source


@pytest.mark.parametrize("name", builtin_robots()[::4])
def test_a_serial_robot_has_the_freedoms_of_its_joints(name: str) -> None:
    spec = load_robot(name)
    found = find_mobility(spec)
    assert found.finite == found.instantaneous == found.gruebler == len(spec.moving_rows)


# ---------------------------------------------------------------------------- mechanisms of others


def test_fixed_rows_and_fixed_closures_make_one_link() -> None:
    found = of(
        """
joints: [{type: revolute, a: 1}, {type: fixed, a: 0.5}, {type: revolute, a: 1}, {type: revolute, a: 1}]
closures: [{between: [dh_4, base_link], type: fixed}]
assembly: {q: [0, 117, 107]}
"""
    )
    assert found.mechanism.links == ("base_link", "link_1", "link_3")
    assert (found.gruebler, found.finite) == (0, 0)
    assert found.verdict == "Counted 0, moves 0: it is rigid, as counted."


def test_scotch_yoke_moves_with_one() -> None:
    found = of(
        """
joints: [{type: continuous, a: 0.5}]
branches:
  yoke:
    from: base_link
    pose: {rpy: [0, 90, 0]}
    joints:
      - {type: prismatic, alpha: -90}
      - {type: prismatic, theta: -90, alpha: 90}
closures: [{between: [dh_1, yoke/dh_2], type: revolute}]
assembly: {q: [50, 0.3, 0.3]}
"""
    )
    assert (found.gruebler, found.instantaneous, found.finite) == (1, 1, 1)


def test_watt_six_bar_moves_with_one() -> None:
    found = of(
        """
joints: [{type: revolute, a: 0.6}, {type: revolute, a: 1.8}, {type: revolute, a: 1.5}]
branches:
  rocker: {from: base_link, pose: {xyz: [2, 0, 0]}, joints: [{type: revolute, a: 1.4}]}
  link: {from: rocker/dh_1, pose: {xyz: [0.5, 0.6, 0]}, joints: [{type: revolute, a: 1.6}]}
closures:
  - {name: C, between: [dh_2, rocker/dh_1], type: revolute}
  - {name: E, between: [dh_3, link/dh_1], type: revolute}
actuated: [joint_1]
assembly: {q: [70, -50, 60, 110, -60]}
"""
    )
    assert (found.count.links, found.count.joints) == (6, 7)
    assert (found.gruebler, found.instantaneous, found.finite) == (1, 1, 1)


def test_the_coupler_of_an_rssr_spins_idly() -> None:
    found = of(
        """
joints:
  - {type: continuous, a: 0.3}
  - {type: revolute, alpha: 90}
  - {type: revolute, alpha: -90, theta: 90}
  - {type: revolute, a: 1.2}
branches: {rocker: {from: base_link, pose: {xyz: [1, 0.2, 0], rpy: [90, 0, 20]}, joints: [{type: revolute, a: 0.7}]}}
closures: [{name: S, between: [dh_4, rocker/dh_1], type: spherical}]
actuated: [joint_1]
assembly: {q: [30, 10, 20, 10, 60]}
"""
    )
    assert (found.gruebler, found.instantaneous, found.finite) == (2, 2, 2)
    assert len(found.idle) == 1
    assert found.verdict == (
        "Counted 2, moves 2: the count is right. 1 is idle: link_4 spins and nothing else moves; 1 is left."
    )


def test_an_assembly_that_cannot_be_closed_is_refused_with_its_place(tmp_path: Path) -> None:
    file = tmp_path / "long.yaml"
    text = Path(builtin_path("four_bar") or "").read_text(encoding="utf-8")
    file.write_text(text.replace("ground: 2,", "ground: 9,"), encoding="utf-8")
    result = dh2sim("mobility", file)
    assert result.status == 2
    assert result.err.startswith(f"{file}:20:15: assembly.q: the loops cannot be closed: C stays open by")


def test_schatzs_linkage_turns_inside_out() -> None:
    """P. Schatz's six-bar (1942): three equal lengths, right angles, sqrt(3) times as much on the ground."""
    text = """parameters: {a: 0.5, R: 0.4}
joints:
  - {type: revolute, d: R, alpha: 90}
  - {type: revolute, a: a, alpha: 90}
  - {type: revolute, a: a, alpha: 90}
  - {type: revolute, a: a, alpha: 90}
  - {type: revolute, alpha: 90}
branches:
  ground: {from: base_link, pose: {xyz: [-sqrt(3) * a, 0, 0]}, joints: [{type: fixed, d: R}]}
closures:
  - {name: loop, between: [dh_5, ground/dh_1], type: revolute}
actuated: [joint_1]
assembly: {q: [20, 60, 120, 120, 60]}
"""
    found = of(text)
    assert (found.gruebler, found.instantaneous, found.finite) == (0, 1, 1)
    rigid = of(text.replace("d: R}]", "d: -R}]").replace("actuated: [joint_1]\n", ""))
    assert (rigid.gruebler, rigid.finite) == (0, 0), "the offsets on both sides of the ground must be equal"


def test_goldbergs_linkage_is_two_of_bennetts() -> None:
    """M. Goldberg (1943): Bennett loops (a, b) and (b, c) share a link of length b, which is taken out."""
    angles = {"a": 40.0, "b": 70.0, "c": 25.0}
    a, b, c = (math.sin(math.radians(angle)) for angle in angles.values())
    text = f"""joints:
  - {{type: revolute, a: {b!r}, alpha: 70}}
  - {{type: revolute, a: {a + c!r}, alpha: 65}}
  - {{type: revolute, a: {b!r}, alpha: 70}}
  - {{type: revolute, a: {c!r}, alpha: 25}}
  - {{type: fixed, a: {a!r}, alpha: 40}}
closures: [{{name: loop, between: [dh_5, base_link], type: revolute}}]
assembly: {{q: [120, -60, 120, -60]}}
"""
    found = of(text)
    assert (found.gruebler, found.instantaneous, found.finite) == (-1, 1, 1)


def test_peaucelliers_linkage_draws_a_straight_line() -> None:
    text = """name: peaucellier
convention: standard
units: {angle: deg}
tool: {xyz: [0, 0, 0]}
joints:
  - {type: revolute, a: 3}
  - {type: revolute, a: 1}
branches:
  bar: {from: dh_1, joints: [{type: revolute, a: 1}]}
  arm: {from: base_link, joints: [{type: revolute, a: 3}, {type: revolute, a: 1}]}
  bar_2: {from: arm/dh_1, joints: [{type: revolute, a: 1}]}
  crank: {from: base_link, pose: {xyz: [1.2, 0, 0]}, joints: [{type: revolute, a: 1.2}]}
closures:
  - {name: near, between: [dh_2, arm/dh_2], type: revolute}
  - {name: far, between: [bar/dh_1, bar_2/dh_1], type: revolute}
  - {name: P, between: [dh_2, crank/dh_1], type: revolute}
actuated: [crank_joint_1]
assembly: {q: [15, -160, -60, -15, 160, 60, 20]}
"""
    found = find_mobility(parse_robot(text))
    assert (found.gruebler, found.instantaneous, found.finite) == (1, 1, 1)
    line = [
        mechanism_pose(parse_robot(text), [math.radians(angle)], "bar/dh_1")[0, 3] for angle in (-40, -10, 20, 50)
    ]
    assert np.allclose(line, (3**2 - 1**2) / (2 * 1.2), rtol=0, atol=1e-11), (
        "inversion of a circle through its centre"
    )


def test_a_robot_of_fixed_rows_has_no_freedoms(tmp_path: Path) -> None:
    robot = tmp_path / "still.yaml"
    robot.write_text("name: still\nconvention: standard\njoints:\n  - {type: fixed, a: 0.5, alpha: 0.3}\n")
    found = find_mobility(load_robot(robot))
    assert (found.count.by_loop, found.rank.mobility, found.finite) == (0, 0, 0)
    run = dh2sim("mobility", robot)
    assert (run.status, run.err) == (0, "")
