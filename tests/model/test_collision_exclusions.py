from __future__ import annotations

import math
from itertools import pairwise
from types import MappingProxyType

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.model.build import build_model
from dh2sim.model.collision_exclusions import ExcludedPair, Reason, segment_distance
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.row import JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.model.samples import compiled
from tests.sample_robots import FIXED, MODIFIED, NAMES, REVOLUTE, STANDARD, model
from tests.strategies import robot_specs


def colliding(mj: mujoco.MjModel, q: Array) -> set[tuple[str, str]]:
    """Names of the links that touch at ``q``."""
    data = mujoco.MjData(mj)
    data.qpos[:] = q
    mujoco.mj_forward(mj, data)
    pairs = [[mj.body(mj.geom_bodyid[geom]).name for geom in contact.geom] for contact in data.contact]
    return {(min(pair), max(pair)) for pair in pairs}


def assert_nothing_collides(built: RobotModel) -> None:
    mj = compiled(built)
    assert colliding(mj, np.zeros(built.chain.n)) == set()
    assert colliding(mj, built.home) == set()


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_no_links_collide_at_zero_or_at_home(name: str) -> None:
    assert_nothing_collides(model(name))


@settings(max_examples=min(40, settings().max_examples))
@given(robot_specs(must_move=False))
def test_no_links_of_any_robot_collide_at_zero_or_at_home(spec: RobotSpec) -> None:
    assert_nothing_collides(build_model(spec))


def planar(count: int, **changes: object) -> RobotSpec:
    rows = [
        Row(name=f"j{i}", type=REVOLUTE, convention=STANDARD, a=0.5, d=0.3 if i == 0 else 0.0) for i in range(count)
    ]
    return RobotSpec(name="planar", rows=tuple(rows), **changes)  # type: ignore[arg-type]


def test_links_that_meet_where_an_arm_is_folded_collide() -> None:
    mj = compiled(build_model(planar(6)))
    folded = np.array([0.0, *[math.radians(130)] * 3, 0.0, 0.0])
    found = colliding(mj, folded)
    assert ("link_1", "link_4") in found
    assert not {("link_1", "link_2"), ("link_2", "link_3"), ("link_3", "link_4")} & found


def test_links_that_touch_at_home_do_not_collide() -> None:
    folded = read_only([0.0, *[math.radians(130)] * 3, 0.0, 0.0])
    built = build_model(planar(6, configurations=MappingProxyType({"home": folded})))
    assert ExcludedPair(link1="link_1", link2="link_4", reason=Reason.DEFAULT) in built.excluded
    assert colliding(compiled(built), folded) == set()


def test_neighbours_on_the_chain_do_not_collide_and_others_may() -> None:
    built = build_model(planar(4))
    names = ["base_link", "link_1", "link_2", "link_3", "link_4"]
    neighbours = {ExcludedPair(link1=a, link2=b, reason=Reason.ADJACENT) for a, b in pairwise(names)}
    assert set(built.excluded) == neighbours


def test_fixed_links_count_with_the_link_that_carries_them() -> None:
    kinds = [REVOLUTE, FIXED, FIXED, REVOLUTE, REVOLUTE]
    rows = [Row(name=f"j{i}", type=kind, convention=MODIFIED, a=0.5) for i, kind in enumerate(kinds)]
    built = build_model(RobotSpec(name="welded", rows=tuple(rows)))
    adjacent = {(p.link1, p.link2) for p in built.excluded if p.reason is Reason.ADJACENT}
    carried = ["link_1", "link_2", "link_3"]
    shown = {link.name for link in built.all_links if link.shapes}
    assert shown == {"base_link", "link_1", "link_2", "link_3", "link_4", "link_5"} - {
        link.name for link in built.links if not link.shapes
    }
    expected = {(a, b) for i, a in enumerate(carried) for b in carried[i + 1 :]}
    expected |= {("base_link", name) for name in carried} | {(name, "link_4") for name in carried}
    expected |= {("link_4", "link_5")}
    assert adjacent == {pair for pair in expected if set(pair) <= shown}


def test_links_without_shapes_are_in_no_pair() -> None:
    rows = (
        Row(name="mount", type=JointType.FIXED, convention=MODIFIED),
        Row(name="turn", type=REVOLUTE, convention=MODIFIED),
    )
    built = build_model(RobotSpec(name="mounted", rows=rows))
    assert built.links[0].shapes == ()
    assert all("link_1" not in (pair.link1, pair.link2) for pair in built.excluded)


def point_distance(p: Array, a: Array, b: Array) -> float:
    t = min(max(float((p - a) @ (b - a) / ((b - a) @ (b - a))), 0.0), 1.0)
    return float(np.linalg.norm(p - a - t * (b - a)))


def exact_distance(a: Array, b: Array, c: Array, d: Array) -> float:
    """The least of: an end of one to the other, and the common normal where its feet are inside both."""
    found = [
        point_distance(a, c, d),
        point_distance(b, c, d),
        point_distance(c, a, b),
        point_distance(d, a, b),
    ]
    directions = np.stack([b - a, c - d], axis=1)
    if np.linalg.matrix_rank(directions, tol=1e-9) == 2:
        (s, t), *_ = np.linalg.lstsq(directions, c - a, rcond=None)
        if 0 <= s <= 1 and 0 <= t <= 1:
            found.append(float(np.linalg.norm(a + s * (b - a) - c - t * (d - c))))
    return min(found)


def test_the_distance_of_segments_equals_brute_force() -> None:
    rng = np.random.default_rng(3)
    for k in range(60):
        a, b = rng.uniform(-1, 1, (2, 3))
        starts, ends = rng.uniform(-1, 1, (2, 40, 3))
        if k % 3 == 1:  # parallel, also on one line
            shift = rng.uniform(-1, 1, (40, 3)) if k % 2 else rng.uniform(-3, 3, (40, 1)) * (b - a)
            starts, ends = a + shift, a + shift + rng.uniform(-2, 2, (40, 1)) * (b - a)
        elif k % 3 == 2:  # nearly parallel
            starts = a + rng.uniform(-1, 1, (40, 3))
            ends = starts + (b - a) + 10.0 ** -rng.uniform(3, 9) * ends
        expected = [exact_distance(a, b, c, d) for c, d in zip(starts, ends, strict=True)]
        np.testing.assert_allclose(segment_distance(a, b, starts, ends), expected, rtol=0, atol=5e-6)


def test_segments_that_cross_or_share_a_point_have_no_distance() -> None:
    a, b = np.array([0.0, 0, 0]), np.array([1.0, 0, 0])
    starts = np.array([[0.5, -1, 0], [1, 0, 0], [0.2, 0, 0], [0.5, 0, 0]])
    ends = np.array([[0.5, 1, 0], [2, 3, 0], [0.7, 0, 0], [9, 0, 0]])
    np.testing.assert_allclose(segment_distance(a, b, starts, ends), 0.0, rtol=0, atol=1e-15)


@pytest.mark.parametrize("length", [0.0, 1e-200, 1e-162, 1e-120])
def test_segments_that_are_as_good_as_points_have_their_distance(length: float) -> None:
    point, end = np.array([0.5, 1.0, 0.0]), np.array([0.5 + length, 1.0, length])
    starts, ends = np.array([[0.0, 0.0, 0.0], [2.0, 1.0, 0.0]]), np.array([[1.0, 0.0, 0.0], [2.0, 1.0, length]])
    np.testing.assert_allclose(segment_distance(point, end, starts, ends), [1.0, 1.5], rtol=1e-15)
    np.testing.assert_allclose(segment_distance(starts[0], ends[0], point[None], end[None]), 1.0, rtol=1e-15)
