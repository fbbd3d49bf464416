from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.kinematics.forward import joint_poses
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.shapes import Shape, ShapeKind, ShapePart, between, placed, pose_with_z
from dh2sim.robot.row import Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.sample_robots import CONTINUOUS, MODIFIED, NAMES, ODD, PRISMATIC, REVOLUTE, STANDARD, in_limits, model
from tests.strategies import robot_specs


def assert_every_moving_link_is_a_body(built: RobotModel) -> None:
    for link in built.all_links:
        for shape in link.shapes:
            assert shape.radius > 0
            assert shape.length > 0
            R = shape.T_link_shape[:3, :3]
            np.testing.assert_allclose(R.T @ R, np.eye(3), rtol=0, atol=1e-15)
            assert np.linalg.det(R) == pytest.approx(1.0, abs=1e-14)
    for link, joint in zip(built.links, built.joints, strict=True):
        if joint.type.moves:
            assert link.shapes
            assert link.inertial is not None
        if link.inertial is not None:
            assert link.inertial.mass > 0


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_every_moving_link_has_a_shape_and_a_mass(name: str) -> None:
    assert_every_moving_link_is_a_body(model(name))


@settings(max_examples=min(60, settings().max_examples))
@given(robot_specs(must_move=False))
def test_every_moving_link_of_any_robot_has_a_shape_and_a_mass(spec: RobotSpec) -> None:
    assert_every_moving_link_is_a_body(build_model(spec))


@pytest.mark.parametrize("alpha", [1e-3, 1e-6, 1e-9, 1e-12])
def test_nearly_parallel_axes_make_no_far_away_elbow(alpha: float) -> None:
    rows = [
        Row(name=f"j{i}", type=REVOLUTE, convention=STANDARD, a=0.5, alpha=alpha, d=d)
        for i, d in enumerate((0.3, 574.0, -573.9))
    ]
    built = build_model(RobotSpec(name="calibrated", rows=tuple(rows)))
    assert_every_moving_link_is_a_body(built)
    farthest = max(np.abs(end).max() for link in built.all_links for s in link.shapes for end in s.ends)
    assert farthest < 600.0


@pytest.mark.parametrize("rounding", [0.0, 1.8e-17, 1e-200, 5e-324])
def test_rows_of_no_length_still_have_a_body_of_a_size_that_one_can_see(rounding: float) -> None:
    rows = [
        Row(name=f"j{i}", type=kind, convention=MODIFIED, a=rounding)
        for i, kind in enumerate((CONTINUOUS, PRISMATIC, REVOLUTE))
    ]
    built = build_model(RobotSpec(name="point", rows=tuple(rows)))
    assert_every_moving_link_is_a_body(built)
    assert min(shape.radius for link in built.all_links for shape in link.shapes) > 0.01
    assert built.mass > 0.1


def ends_in_base(T_base_link: Array, shape: Shape) -> tuple[Array, Array]:
    start, end = shape.ends
    return T_base_link[:3, :3] @ start + T_base_link[:3, 3], T_base_link[:3, :3] @ end + T_base_link[:3, 3]


def assert_slides_stay_together(built: RobotModel, q: Array) -> int:
    """Rods in their sleeves and carriages on their rails; returns how many joints were looked at."""
    seen = 0
    for poses in joint_poses(built.chain, q):
        T_base = [np.eye(4), *poses]
        for i, joint in enumerate(built.joints):
            if joint.type is not PRISMATIC:
                continue
            seen += 1
            parent, child = built.all_links[i], built.all_links[i + 1]
            guide, slider = parent.shapes[-1], child.shapes[0]
            low, high = ends_in_base(T_base[i], guide)
            axis = (high - low) / guide.length
            heights = []
            for end in ends_in_base(T_base[i + 1], slider):
                heights.append(float((end - low) @ axis))
                aside = float(np.linalg.norm(end - low - heights[-1] * axis))
                assert aside < 1e-12 * max(1.0, built.reach)
            bottom, top = sorted(heights)
            slack = 1e-12 * max(1.0, built.reach)
            if guide.part is ShapePart.JOINT:  # a sleeve: half of it is always filled by the rod
                assert min(top, guide.length) - max(bottom, 0.0) >= 0.5 * guide.length - slack
            else:  # a rail: the middle of the carriage is on it
                assert -slack <= 0.5 * (bottom + top) <= guide.length + slack
    return seen


def slide(flip: bool, position: tuple[float, float] | None, first: bool = False) -> RobotSpec:
    moved = Row(
        name="slide",
        type=PRISMATIC,
        convention=STANDARD,
        a=0.2,
        alpha=0.5,
        d=0.1,
        theta=0.4,
        flip=flip,
        limits=Limits(position=position),
    )
    turned = Row(name="turn", type=REVOLUTE, convention=STANDARD, a=0.15, alpha=ODD, d=0.3)
    return RobotSpec(name="slider", rows=(moved, turned) if first else (turned, moved))


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("position", [(0.0, 0.6), (-0.5, -0.2), (0.7, 0.9), (-0.3, 0.3), None])
@pytest.mark.parametrize("first", [False, True])
def test_a_slide_stays_guided_over_its_whole_travel(
    flip: bool, position: tuple[float, float] | None, first: bool
) -> None:
    built = build_model(slide(flip, position, first))
    joint = next(joint for joint in built.joints if joint.type is PRISMATIC)
    travel = np.linspace(*joint.travel, 41)
    q = np.stack([travel, np.full(41, 0.7)] if first else [np.full(41, 0.7), travel], axis=1)
    assert assert_slides_stay_together(built, q) == 41
    guide = built.all_links[0 if first else 1].shapes[-1]
    assert guide.part is (ShapePart.LINK if first else ShapePart.JOINT)  # a rail on the base, else a sleeve


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_every_slide_of_the_robots_stays_guided(name: str) -> None:
    built = model(name)
    slides = sum(joint.type is PRISMATIC for joint in built.joints)
    assert assert_slides_stay_together(built, in_limits(built, 50, seed=1)) == 50 * slides


@settings(max_examples=min(60, settings().max_examples))
@given(robot_specs(max_rows=6))
def test_every_slide_of_any_robot_stays_guided(spec: RobotSpec) -> None:
    built = build_model(spec)
    assert_slides_stay_together(built, in_limits(built, 5, seed=2))


def test_a_shape_between_two_points_ends_at_them() -> None:
    start, end = (0.1, -0.2, 0.3), (-0.5, 0.4, 0.35)
    shape = between(ShapeKind.CAPSULE, ShapePart.LINK, 0.05, start, end)
    np.testing.assert_allclose(shape.ends, (start, end), rtol=0, atol=1e-16)
    T = pose_from_rpy([0.4, 0.5, -0.6], [0.7, -0.8, 0.9])
    np.testing.assert_allclose(
        placed(shape, T).ends, [T[:3, :3] @ p + T[:3, 3] for p in (start, end)], rtol=0, atol=2e-16
    )


def test_a_shape_along_z_needs_no_rotation() -> None:
    shape = between(ShapeKind.CYLINDER, ShapePart.JOINT, 0.1, (0.0, 0.0, -0.2), (0.0, 0.0, 0.6))
    np.testing.assert_array_equal(shape.T_link_shape, pose_from_rpy([0, 0, 0.5 * (0.6 - 0.2)], [0, 0, 0]))


def test_poses_along_the_axes_are_exact() -> None:
    for z in np.vstack([np.eye(3), -np.eye(3)]):
        T = pose_with_z([0.0, 0.0, 0.0], z.tolist())
        np.testing.assert_array_equal(T[:3, 2], z)
        assert set(np.abs(T[:3, :3]).ravel()) == {0.0, 1.0}
        assert np.linalg.det(T) == 1.0
