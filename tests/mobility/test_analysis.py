"""What moves is known from books; the analysis is given points and axes alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from dh2sim.mobility.analysis import mobility_of
from dh2sim.mobility.mechanism import Mechanism
from dh2sim.mobility.result import Mobility
from tests.mobility.linkages import (
    X,
    Y,
    Z,
    bennett,
    cranks,
    delta,
    linkage,
    loop,
    planar_loop,
    random_loop,
    sarrus,
    spherical_loop,
    stewart,
    with_axis_turned,
)

FOUR_BAR = planar_loop((0, 0), (0.3, 0.8), (1.5, 1.1), (2, 0))
FIVE_BAR = planar_loop((0, 0), (-0.3, 0.8), (0.5, 1.6), (1.4, 0.7), (1, 0))
SLIDER_CRANK = loop(
    ("revolute", (0, 0, 0), Z),
    ("revolute", (0.3, 0.4, 0), Z),
    ("revolute", (1.5, 0, 0), Z),
    ("prismatic", (1.5, 0, 0), X),
)
THREE_CRANKS = cranks(((0, 0), (0.5, 1)), ((1, 0), (1.5, 1)), ((2, 0), (2.5, 1)))
UNEQUAL_CRANK = cranks(((0, 0), (0.5, 1)), ((1, 0), (1.5, 1.2)), ((2, 0), (2.4, 1)))
STRETCHED = planar_loop((0, 0), (1, 0), (2.2, 0), (3.7, 0))
FOLDED = planar_loop((0, 0), (1, 0), (3, 0), (2, 0))
SPHERICAL = spherical_loop((1, 0, 0), (0, 1, 0), (0.2, 0.1, 1), (0.9, 0.3, 0.4))
RSSR = loop(
    ("revolute", (0, 0, 0), Z),
    ("spherical", (0.3, 0.1, 0), Z),
    ("spherical", (1, 0.2, 0.8), Z),
    ("revolute", (1.2, 0, 0), Y),
)


def numbers(mechanism: Mechanism) -> tuple[int, int, int, int]:
    """Lambda, the count, the instantaneous and the finite mobility."""
    found = mobility_of(mechanism)
    return found.count.dimension, found.gruebler, found.instantaneous, found.finite


@pytest.mark.parametrize(
    ("mechanism", "expected"),
    [
        pytest.param(FOUR_BAR, (3, 1, 1, 1), id="four-bar"),
        pytest.param(SLIDER_CRANK, (3, 1, 1, 1), id="slider-crank"),
        pytest.param(FIVE_BAR, (3, 2, 2, 2), id="five-bar"),
        pytest.param(THREE_CRANKS, (3, 0, 1, 1), id="parallel four-bar with a third crank"),
        pytest.param(UNEQUAL_CRANK, (3, 0, 0, 0), id="unequal third crank"),
        pytest.param(STRETCHED, (3, 1, 2, 0), id="stretched four-bar"),
        pytest.param(FOLDED, (3, 1, 2, 1), id="folded parallelogram"),
        pytest.param(SPHERICAL, (3, 1, 1, 1), id="spherical four-bar"),
        pytest.param(bennett(1.0, 0.9, 0.7, 1.1), (6, -2, 1, 1), id="Bennett"),
        pytest.param(sarrus(), (6, 0, 1, 1), id="Sarrus"),
        pytest.param(random_loop(4, 1), (6, -2, 0, 0), id="random 4R"),
        pytest.param(random_loop(6, 1), (6, 0, 0, 0), id="random 6R"),
        pytest.param(random_loop(7, 1), (6, 1, 1, 1), id="random 7R"),
        pytest.param(delta("spherical"), (6, 9, 9, 9), id="Delta with ball joints"),
        pytest.param(delta("revolute"), (6, -9, 3, 3), id="Delta with parallelograms"),
        pytest.param(stewart(), (6, 6, 6, 6), id="Stewart 6-UPS"),
        pytest.param(stewart("spherical"), (6, 12, 12, 12), id="Stewart 6-SPS"),
        pytest.param(RSSR, (6, 2, 2, 2), id="RSSR"),
    ],
)
def test_mobility_is_the_one_in_books(mechanism: Mechanism, expected: tuple[int, int, int, int]) -> None:
    assert numbers(mechanism) == expected
    count = mobility_of(mechanism).count
    assert count.gruebler == count.constraints_form


def test_open_chains_have_the_freedoms_of_their_joints() -> None:
    arm = linkage(
        "arm", *(("revolute", f"L{i}", f"L{i + 1}", (0.1 * i, 0, i), (X if i % 2 else Z,)) for i in range(6))
    )
    cross = linkage("cross", ("revolute", "a", "cross", (0, 0, 0), (X,)), ("revolute", "cross", "b", (0, 0, 0), (Y,)))
    tree = linkage(
        "tree",
        ("revolute", "ground", "trunk", (0, 0, 0), (Z,)),
        ("spherical", "trunk", "left", (1, 0, 0), ()),
        ("cylindrical", "trunk", "right", (-1, 0, 0), (X,)),
    )
    assert numbers(arm) == (6, 6, 6, 6)
    assert numbers(cross) == (3, 2, 2, 2)
    assert numbers(tree) == (6, 6, 6, 6)
    assert mobility_of(tree).verdict == "Counted 6, moves 6: there is no loop, and every joint is free."


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_neither_size_nor_place_matters(scale: float) -> None:
    shift = np.array([300.0, -200.0]) * scale
    folded = planar_loop(*(scale * np.array(point) + shift for point in ((0, 0), (1, 0), (3, 0), (2, 0))))
    moving = planar_loop(*(scale * np.array(point) + shift for point in ((0, 0), (0.3, 0.8), (1.5, 1.1), (2, 0))))
    assert numbers(folded) == (3, 1, 2, 1)
    assert numbers(moving) == (3, 1, 1, 1)


# ---------------------------------------------------------------------------- which constraints, which freedoms


def test_each_of_three_equal_cranks_is_redundant() -> None:
    found = mobility_of(THREE_CRANKS)
    assert found.verdict == (
        "Counted 0, moves 1: crank 3 is redundant, as is any one of crank 1, crank 2 in its place."
    )


def test_bennett_has_three_constraints_too_many() -> None:
    found = mobility_of(bennett(1.0, 0.9, 0.7, 1.1))
    assert [(each.constraints, each.redundant) for each in found.redundant_joints] == [(5, 3)] * 4
    assert found.verdict.startswith("Counted -2, moves 1: 3 constraints are redundant with these dimensions")


def test_parallelograms_of_a_delta_are_counted_as_planar() -> None:
    count = mobility_of(delta("revolute")).count
    assert sorted(count.loop_dimensions) == [3, 3, 3, 6, 6]
    assert count.by_loop == 0


def test_a_planar_loop_on_a_spatial_arm_is_counted_with_its_own_lambda() -> None:
    palletizer = linkage(
        "palletizer",
        ("revolute", "ground", "column", (0, 0, 0), (Z,)),
        ("revolute", "column", "arm", (0, 0, 1), (Y,)),
        ("revolute", "column", "crank", (-0.3, 0, 1), (Y,)),
        ("revolute", "crank", "rod", (-0.2, 0, 1.4), (Y,)),
        ("revolute", "arm", "forearm", (0.2, 0, 1.8), (Y,)),
        ("revolute", "rod", "forearm", (-0.1, 0, 1.9), (Y,)),
    )
    found = mobility_of(palletizer)
    assert found.count.loop_dimensions == (3,)
    assert found.finite == found.count.by_loop == 3
    assert found.verdict == (
        f"Counted {found.gruebler}, moves 3: with lambda 3, each loop its own, it is counted 3, which is right."
    )


@pytest.mark.parametrize(
    ("mechanism", "idle"),
    [
        (RSSR, [["L2"]]),
        (stewart("spherical"), [[f"cylinder {k}", f"piston {k}"] for k in range(6)]),
        (stewart(), []),
        (delta("spherical"), [[f"rod {k} {side:+}"] for k in range(3) for side in (-1, 1)]),
        (FOUR_BAR, []),
        (planar_loop((0, 0), (1, 0.5), (0.5, 1.5), (-1, 1), (0, 0)), []),
    ],
    ids=["RSSR", "6-SPS", "6-UPS", "Delta", "four-bar", "five-bar with both motors on one axis"],
)
def test_rods_between_ball_joints_spin_idly(mechanism: Mechanism, idle: list[list[str]]) -> None:
    found = mobility_of(mechanism).to_dict()["idle"]
    assert sorted(each["links"] for each in found) == sorted(idle)


def test_shaky_and_branching_assemblies_are_called_so() -> None:
    assert mobility_of(STRETCHED).verdict == (
        "Counted 1, moves 0: with these dimensions it can be assembled in this position only. Instantaneous 2: "
        "2 independent velocities violate no constraint to first order, but none goes on: it is shaky."
    )
    assert mobility_of(FOLDED).verdict.endswith("for branches of motion meet here (bifurcation).")
    assert mobility_of(FOLDED).walk is not None


def test_a_shaky_part_does_not_hide_that_the_rest_moves() -> None:
    """A stretched four-bar beside one that moves: three velocities everywhere, one motion."""
    corners = {
        "A": ((0, 0, 0), (1, 0, 0), (2.2, 0, 0), (3.7, 0, 0)),
        "B": ((0, 2, 0), (0.3, 2.8, 0), (1.5, 3.1, 0), (2, 2, 0)),
    }
    joints = []
    for name, points in corners.items():
        links = ["ground", f"{name} crank", f"{name} coupler", f"{name} rocker", "ground"]
        joints += [("revolute", links[k], links[k + 1], point, (Z,)) for k, point in enumerate(points)]
    found = mobility_of(linkage("both", *joints))
    assert (found.gruebler, found.instantaneous, found.finite) == (2, 3, 1)
    assert "shaky throughout" in found.verdict


def test_rounded_dimensions_are_suspected() -> None:
    exact = bennett(1.0, 0.9, 0.7, 1.1)
    axis = exact.joints[2].screws[0, :3] + np.array([0, 3e-6, 0])
    found = mobility_of(with_axis_turned(exact, 2, axis))
    assert found.finite == 0
    assert "Are some of them rounded?" in found.verdict


# ---------------------------------------------------------------------------- driven joints


def driven(mechanism: Mechanism, *joints: str) -> Mobility:
    return mobility_of(
        Mechanism(name=mechanism.name, links=mechanism.links, joints=mechanism.joints, actuated=joints)
    )


def test_driven_joints_are_compared_with_the_freedoms() -> None:
    assert driven(FOUR_BAR, "J1").verdict == "Counted 1, moves 1: the count is right."
    assert driven(FIVE_BAR, "J1").verdict.endswith("J1 is actuated, but 2 freedoms are to be driven: 1 too few.")
    assert driven(FOUR_BAR, "J1", "J4").verdict.endswith(
        "J1, J4 are actuated, but 1 freedom is to be driven: 1 too many."
    )
    assert driven(FOUR_BAR).verdict.endswith("Nothing is actuated, but 1 freedom is to be driven: 1 too few.")
    assert driven(RSSR, "J1").actuation.free == 0  # type: ignore[union-attr]


def test_a_slider_at_its_dead_centre_holds_nothing() -> None:
    dead = loop(
        ("revolute", (0, 0, 0), Z),
        ("revolute", (0.5, 0, 0), Z),
        ("revolute", (1.5, 0, 0), Z),
        ("prismatic", (1.5, 0, 0), X),
    )
    assert driven(dead, "J1").verdict == "Counted 1, moves 1: the count is right."
    assert driven(dead, "J4").verdict == (
        "Counted 1, moves 1: the count is right. Held here, J4 does not hold the mechanism: 1 velocity is left while "
        "it is locked."
    )


# ---------------------------------------------------------------------------- any mechanism of a kind

POINT = st.tuples(*(st.floats(-2, 2).map(lambda x: round(x, 3)) for _ in range(2)))
AXIS = st.tuples(*(st.floats(-1, 1).map(lambda x: round(x, 3)) for _ in range(3)))


def _area(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    return abs(float(np.linalg.det([b - a, c - a])))


@settings(max_examples=max(25, settings().max_examples // 5))
@given(st.lists(POINT, min_size=4, max_size=4, unique=True))
def test_every_four_bar_that_is_not_in_a_line_moves_with_one_freedom(points: list[tuple[float, float]]) -> None:
    corners = np.array(points)
    assume(min(_area(*corners[[i, j, k]]) for i, j, k in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))) > 0.01)
    assert numbers(planar_loop(*points)) == (3, 1, 1, 1)


@settings(max_examples=max(10, settings().max_examples // 5))
@given(st.integers(5, 8), st.integers(0, 10_000))
def test_planar_and_spherical_loops_have_three_freedoms_less_than_joints(count: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    assert numbers(planar_loop(*random.normal(size=(count, 2)))) == (3, count - 3, count - 3, count - 3)
    assert numbers(spherical_loop(*random.normal(size=(count, 3)))) == (3, count - 3, count - 3, count - 3)


@settings(max_examples=max(10, settings().max_examples // 5))
@given(st.integers(4, 9), st.integers(0, 10_000))
def test_spatial_loops_have_six_freedoms_less_than_joints(count: int, seed: int) -> None:
    expected = max(0, count - 6)
    assert numbers(random_loop(count, seed)) == (6, count - 6, expected, expected)


@settings(max_examples=max(10, settings().max_examples // 5))
@given(st.floats(0.3, 1.2), st.floats(0.4, 0.95), st.floats(0.4, 2.0), st.floats(0.05, 0.5), st.integers(0, 3))
def test_bennett_moves_with_its_ratio_and_is_rigid_without(
    alpha: float, ratio: float, theta: float, turned: float, joint: int
) -> None:
    exact = bennett(1.0, alpha, ratio, theta)
    assert numbers(exact) == (6, -2, 1, 1)
    axis = exact.joints[joint].screws[0, :3]
    across = np.cross(axis, exact.joints[joint - 1].screws[0, :3])
    violated = with_axis_turned(
        exact, joint, np.cos(turned) * axis + np.sin(turned) * across / np.linalg.norm(across)
    )
    assert mobility_of(violated).finite == 0


@settings(max_examples=max(8, settings().max_examples // 5))
@given(st.floats(0.5, 3), st.floats(0.5, 3), st.floats(0.3, 2.8))
def test_folded_parallelograms_branch_and_others_do_not(ground: float, crank: float, angle: float) -> None:
    assume(abs(ground - crank) > 0.05)
    folded = planar_loop((0, 0), (crank, 0), (ground + crank, 0), (ground, 0))
    tip = crank * np.array([np.cos(angle), np.sin(angle)])
    upright = planar_loop((0, 0), tip, tip + np.array([ground, 0]), (ground, 0))
    assert numbers(folded) == (3, 1, 2, 1)
    assert numbers(upright) == (3, 1, 1, 1)
