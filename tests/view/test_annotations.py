from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.table_oracle import table_frame_poses
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit
from dh2sim.typing import Array
from dh2sim.view.scene.annotations import COLORS, Quantity, row_annotations
from dh2sim.view.scene.items import Arrow, Item, Label, Placed, Polyline, Scene, Triad, Vector, vector
from tests.sample_robots import HAYATI, MODIFIED, ODD_ROBOT, STANDARD, robot, row
from tests.strategies import robots_with_joint_vectors
from tests.view.test_solids import matrix, pose_in_scene

SIZE = 0.2
PRODUCTS = {
    STANDARD: ("theta", "d", "a", "alpha"),
    MODIFIED: ("a", "alpha", "theta", "d"),
    HAYATI: ("theta", "d", "a", "alpha", "beta"),
}
ACROSS = {"alpha": (2, 0), "beta": (2, 1), "theta": (0, 2)}
"""The axis that an arc starts from, and the one that it goes about."""


def explained(spec: RobotSpec, number: int, q: object, **options: Any) -> Scene:
    """The drawing of a row, with all points in base_link, by the last parts of the names."""
    scene = row_annotations(spec, build_chain(spec), number, np.asarray(q), SIZE, **options)
    assert all(name.startswith("/row/") for name in scene)
    return {
        f"/row/{name.split('/')[-1]}": in_base_link(item, pose_in_scene(scene, name))
        for name, item in scene.items()
        if type(item) is not Placed
    }


def in_base_link(item: Item, T: Array) -> Item:
    """An item that is where it is by its points, in a frame with a pose in base_link."""

    def moved(point: Vector) -> Vector:
        return vector(T[:3, :3] @ point + T[:3, 3])

    at_base: dict[str, Any] = {"position": (0.0, 0.0, 0.0), "orientation": (1.0, 0.0, 0.0, 0.0)}
    match item:
        case Polyline():
            return replace(item, points=tuple(map(moved, item.points)), **at_base)
        case Arrow():
            return replace(item, start=moved(item.start), end=moved(item.end), **at_base)
        case _:
            return item


def label(scene: Scene, name: str) -> str:
    item = scene[f"/row/{name}_label"]
    assert isinstance(item, Label)
    return item.text


def turned_by(points: Array, centre: Array, axis: Array) -> float:
    """The angle that an arc goes through about an axis, rad; full turns count."""
    arms = points - centre
    cross = np.cross(arms[:-1], arms[1:]) @ axis
    return float(np.sum(np.arctan2(cross, np.sum(arms[:-1] * arms[1:], axis=1))))


def rotated(R: Array, axis: Array, angle: float) -> Array:
    """Rodrigues' formula."""
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.asarray((np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K) @ R)


def along(scene: Scene, order: tuple[str, ...], T: Array) -> Array:
    """Go from a frame along what is drawn, and return where that leads to."""
    origin, R = T[:3, 3].copy(), T[:3, :3].copy()
    for name in order:
        item: Item | None = scene.get(f"/row/{name}")
        if isinstance(item, Arrow):
            np.testing.assert_allclose(item.start, origin, rtol=0, atol=1e-8)
            way = np.subtract(item.end, item.start)
            axis = R[:, 0 if name == "a" else 2]
            np.testing.assert_allclose(np.cross(way, axis), 0.0, rtol=0, atol=1e-8)
            origin = origin + way
        elif isinstance(item, Polyline):
            points = np.array(item.points)
            start, about = (R[:, k] for k in ACROSS[name])
            radius = np.linalg.norm(points[0] - origin)
            np.testing.assert_allclose((points[0] - origin) / radius, start, rtol=0, atol=1e-7)
            np.testing.assert_allclose(np.linalg.norm(points - origin, axis=1), radius, rtol=1e-7)
            np.testing.assert_allclose((points - origin) @ about, 0.0, rtol=0, atol=1e-8)
            R = rotated(R, about, turned_by(points, origin, about))
        else:
            assert item is None
    result = np.eye(4)
    result[:3, 3], result[:3, :3] = origin, R
    return result


@given(robots_with_joint_vectors(max_rows=5), st.data())
def test_the_arrows_and_arcs_lead_from_each_frame_of_the_table_to_the_next(
    drawn: tuple[RobotSpec, Array], data: st.DataObject
) -> None:
    spec, vectors = drawn
    q = vectors[0]
    frames = table_frame_poses(spec, q)
    number = data.draw(st.integers(0, len(spec.rows) - 1))
    scene = explained(spec, number, q)
    reached = along(scene, PRODUCTS[spec.rows[number].convention], frames[number])
    np.testing.assert_allclose(reached, frames[number + 1], rtol=0, atol=1e-7)


@pytest.mark.parametrize("convention", [STANDARD, MODIFIED, HAYATI])
@pytest.mark.parametrize("joint_type", ["revolute", "prismatic", "fixed"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_every_quantity_of_a_row_is_drawn_also_where_it_is_negative(
    convention: Convention, joint_type: str, sign: float
) -> None:
    has_d = convention is not HAYATI or joint_type == "prismatic"
    numbers = {"a": 0.3 * sign, "alpha": 1.1 * sign, "d": 0.2 * sign if has_d else 0.0, "theta": 2.5 * sign}
    beta = 0.4 * sign if convention is HAYATI else 0.0
    moved = row("one", joint_type, convention, **numbers, beta=beta, flip=joint_type != "fixed")
    spec = RobotSpec(name="r", rows=(row("zero", d=0.1, alpha=0.3), moved))
    q = [0.2] if joint_type == "fixed" else [0.2, -0.4]
    scene, frames = explained(spec, 1, q), table_frame_poses(spec, q)
    assert {f"/row/{name}" for name in PRODUCTS[convention] if name != "d" or has_d} < set(scene)
    np.testing.assert_allclose(along(scene, PRODUCTS[convention], frames[1]), frames[2], rtol=0, atol=1e-12)


def test_an_angle_of_several_turns_is_drawn_as_one_turn_and_the_rest() -> None:
    spec = RobotSpec(name="r", rows=(row("one", "continuous", a=0.1),))
    for q in (2 * math.pi + 1.0, -6 * math.pi - 1.0, 1e6):
        scene, frames = explained(spec, 0, [q]), table_frame_poses(spec, [q])
        arc = scene["/row/theta"]
        assert isinstance(arc, Polyline)
        assert len(arc.points) < 300
        drawn = turned_by(np.array(arc.points), np.zeros(3), np.array([0.0, 0.0, 1.0]))
        assert 2 * math.pi <= math.copysign(drawn, drawn * q) < 4 * math.pi
        np.testing.assert_allclose(along(scene, PRODUCTS[STANDARD], frames[0]), frames[1], rtol=0, atol=1e-9)


def test_labels_carry_name_index_value_and_a_star_where_the_joint_moves() -> None:
    scene = explained(robot("puma560_standard"), 1, np.radians([10.0, 35.0, 20.0, 0.0, 0.0, 0.0]))
    texts = {name: label(scene, name) for name in ("theta", "d", "a", "alpha", "axis_before", "axis_after")}
    assert texts == {
        "theta": "θ₂* = 35.0°",
        "d": "d₂ = 0",
        "a": "a₂ = 0.4318 m",
        "alpha": "α₂ = 0",
        "axis_before": "z₁",
        "axis_after": "z₂",
    }
    assert "/row/alpha" not in scene


def test_a_modified_row_carries_a_and_alpha_of_the_index_before() -> None:
    scene = explained(ODD_ROBOT, 1, [0.0, 0.12, 0.0, 0.0, 0.0])
    texts = [label(scene, name) for name in ("a", "alpha", "theta", "d")]
    assert texts == ["a₁ = -0.2 m", "α₁ = -63.0254°", "θ₂ = -40.107°", "d₂* = -0.070 m"]


def test_a_hayati_row_tells_beta_and_rows_have_more_than_one_figure() -> None:
    rows = [row(f"j{i}", d=0.1) for i in range(11)]
    spec = RobotSpec(name="r", rows=(*rows, row("last", convention=HAYATI, a=0.5, beta=math.radians(2.5))))
    scene = explained(spec, 11, np.zeros(12))
    texts = [label(scene, name) for name in ("theta", "d", "a", "alpha", "beta", "axis_before", "axis_after")]
    assert texts == ["θ₁₂* = 0.0°", "d₁₂ = 0", "a₁₂ = 0.5 m", "α₁₂ = 0", "β₁₂ = 2.5°", "z₁₁", "z₁₂"]


def test_angles_can_be_shown_in_radians() -> None:
    scene = explained(ODD_ROBOT, 0, [0.5, 0.0, 0.0, 0.0, 0.0], angle=AngleUnit.RAD)
    assert (label(scene, "theta"), label(scene, "alpha")) == ("θ₁* = -0.200 rad", "α₁ = 0.651008 rad")


def test_a_tiny_coordinate_has_no_minus_sign_and_rounding_is_shown_as_zero() -> None:
    spec = RobotSpec(name="r", rows=(row("one", a=0.3 * math.cos(math.pi / 2), d=1e-6),))
    scene = explained(spec, 0, [-1e-5])
    assert [label(scene, name) for name in ("theta", "d", "a")] == ["θ₁* = 0.0°", "d₁ = 1e-06 m", "a₁ = 0"]
    assert "/row/a" not in scene


@given(robots_with_joint_vectors(max_rows=5), st.data())
def test_every_quantity_and_both_axes_have_a_label_beside_them(
    drawn: tuple[RobotSpec, Array], data: st.DataObject
) -> None:
    spec, vectors = drawn
    number = data.draw(st.integers(0, len(spec.rows) - 1))
    scene = explained(spec, number, vectors[0])
    labels = {name: np.array(item.position) for name, item in scene.items() if isinstance(item, Label)}
    assert len(labels) == len(PRODUCTS[spec.rows[number].convention]) + 2
    for name in PRODUCTS[spec.rows[number].convention]:
        item = scene.get(f"/row/{name}")
        if isinstance(item, Arrow):
            middle = 0.5 * np.add(item.start, item.end)
            assert np.linalg.norm(labels[f"/row/{name}_label"] - middle) < 0.5 * SIZE
        elif isinstance(item, Polyline):
            points = np.array(item.points)
            assert np.linalg.norm(points - labels[f"/row/{name}_label"], axis=1).min() < 0.5 * SIZE
    for name in ("axis_before", "axis_after"):
        line = scene[f"/row/{name}"]
        assert isinstance(line, Polyline)
        assert np.linalg.norm(labels[f"/row/{name}_label"] - np.array(line.points[1])) < 0.5 * SIZE


def test_the_axes_are_those_of_the_two_frames_and_pass_through_both_ends_of_the_offset() -> None:
    spec, q = robot("puma560_standard"), np.radians([10.0, 35.0, 20.0, 40.0, 50.0, 60.0])
    frames = table_frame_poses(spec, q)
    for number in range(6):
        scene = explained(spec, number, q)
        for name, T in (("axis_before", frames[number]), ("axis_after", frames[number + 1])):
            line = scene[f"/row/{name}"]
            assert isinstance(line, Polyline)
            ends = np.array(line.points) - T[:3, 3]
            np.testing.assert_allclose(np.cross(ends, T[:3, 2]), 0.0, rtol=0, atol=1e-12)
            heights = ends @ T[:3, 2]
            assert heights[0] < min(0.0, spec.rows[number].d if name == "axis_before" else 0.0)
            assert heights[1] > max(0.0, spec.rows[number].d if name == "axis_before" else 0.0)


@given(robots_with_joint_vectors(max_rows=4))
def test_the_normal_crosses_both_axes_at_a_right_angle(drawn: tuple[RobotSpec, Array]) -> None:
    spec, vectors = drawn
    frames = table_frame_poses(spec, vectors[0])
    for number, entry in enumerate(spec.rows):
        if entry.beta != 0.0:
            continue
        line = explained(spec, number, vectors[0])["/row/normal"]
        assert isinstance(line, Polyline)
        start, end = np.array(line.points)
        way = (end - start) / np.linalg.norm(end - start)
        for T in frames[number : number + 2]:
            assert abs(way @ T[:3, 2]) < 1e-9
            across = np.cross(way, T[:3, 2])
            assert abs((T[:3, 3] - start) @ across) < 1e-8  # the lines meet


def test_colours_belong_to_quantities_and_are_all_different() -> None:
    assert set(COLORS) == set(Quantity)
    assert len(set(COLORS.values())) == len(Quantity)
    spec = RobotSpec(name="r", rows=(row("j", convention=HAYATI, a=0.3, alpha=1.0, theta=0.4, beta=0.1),))
    scene = explained(spec, 0, [0.0])
    for quantity in (Quantity.A, Quantity.ALPHA, Quantity.THETA, Quantity.BETA):
        own = [item for name, item in scene.items() if name.split("/")[-1].split("_")[0] == quantity.value]
        assert len(own) == (2 if quantity is Quantity.A else 5)
        for item in own:
            assert isinstance(item, Arrow | Polyline | Label)
            assert item.color == COLORS[quantity]


def test_the_tip_of_an_arc_points_the_way_it_goes() -> None:
    for theta in (1.0, -1.0, 0.05, -3.0):
        scene = explained(RobotSpec(name="r", rows=(row("j", theta=theta),)), 0, [0.0])
        arc, tip = scene["/row/theta"], scene["/row/theta_tip"]
        assert isinstance(arc, Polyline)
        assert isinstance(tip, Polyline)
        first, point, second = (np.array(corner) for corner in tip.points)
        np.testing.assert_allclose(point, arc.points[-1], rtol=0, atol=1e-15)
        onwards = point - 0.5 * (first + second)
        assert np.cross(point, onwards)[2] * theta > 0


def test_all_lies_below_row_and_everything_is_finite() -> None:
    spec = robot("stanford")
    for number in range(len(spec.rows)):
        for name, item in explained(spec, number, np.zeros(6)).items():
            assert name.startswith("/row/")
            assert np.isfinite(item.position).all()
            assert np.isfinite(item.orientation).all()


def test_while_a_joint_moves_only_poses_and_labels_of_another_row_change() -> None:
    spec = robot("puma560_standard")
    chain, q = build_chain(spec), np.radians([10.0, 35.0, 20.0, 40.0, 50.0, 60.0])
    for moved, number in ((0, 3), (5, 3), (3, 2)):
        other = q.copy()
        other[moved] += 0.5
        before, after = (row_annotations(spec, chain, number, angles, SIZE) for angles in (q, other))
        assert before.keys() == after.keys()
        assert (before == after) is (moved > number)
        for name, item in after.items():
            old = before[name]
            assert replace(item, position=old.position, orientation=old.orientation) == old, name
        unlabelled = {name for name, item in after.items() if item != before[name] and not isinstance(item, Label)}
        assert unlabelled == ({"/row/0"} if moved < number else set())


def test_while_its_own_joint_moves_what_is_fixed_to_either_frame_stays() -> None:
    spec = robot("puma560_standard")
    chain, q = build_chain(spec), np.radians([10.0, 35.0, 20.0, 40.0, 50.0, 60.0])
    before, after = (row_annotations(spec, chain, 1, q + step, SIZE) for step in ([0.0] * 6, [0, 0.5, 0, 0, 0, 0]))
    changed = {name for name, item in after.items() if item != before[name] and not isinstance(item, Label)}
    assert changed == {"/row/0/1", *(f"/row/0/theta{end}" for end in ("", "_tip", "_to"))}


@given(robots_with_joint_vectors(max_rows=4), st.data())
def test_an_animated_row_leads_the_frame_along_the_product_step_by_step(
    drawn: tuple[RobotSpec, Array], data: st.DataObject
) -> None:
    spec, vectors = drawn
    q = vectors[0]
    number = data.draw(st.integers(0, len(spec.rows) - 1))
    product, frames = PRODUCTS[spec.rows[number].convention], table_frame_poses(spec, q)
    done = data.draw(st.floats(0.0, float(len(product))))
    scene = explained(spec, number, q, done=done)
    begun = product[: math.ceil(done)]
    labels = {name.removeprefix("/row/").removesuffix("_label") for name in scene if name.endswith("_label")}
    assert labels == {*begun, "axis_before", "axis_after"}
    frame = scene["/row/moving_frame"]
    assert isinstance(frame, Triad)
    scale = 1.0 + np.abs(frames).max()
    np.testing.assert_allclose(matrix(frame), along(scene, begun, frames[number]), rtol=0, atol=1e-7 * scale)
    for ends, T in ((0.0, frames[number]), (float(len(product)), frames[number + 1])):
        at_end = explained(spec, number, q, done=ends)["/row/moving_frame"]
        np.testing.assert_allclose(matrix(at_end), T, rtol=0, atol=1e-7 * scale)


def test_half_of_a_step_is_half_of_its_number_and_its_label_shows_the_whole() -> None:
    spec = robot("puma560_standard")
    scene = explained(spec, 1, np.radians([10.0, 36.0, 20.0, 0.0, 0.0, 0.0]), done=0.5)
    arc, origin = scene["/row/theta"], table_frame_poses(spec, np.radians([10.0, 36.0, 20.0, 0.0, 0.0, 0.0]))[1]
    assert isinstance(arc, Polyline)
    assert turned_by(np.array(arc.points), origin[:3, 3], origin[:3, 2]) == pytest.approx(math.radians(18.0))
    assert label(scene, "theta") == "θ₂* = 36.0°"
    assert "/row/a" not in scene


@pytest.mark.parametrize("number", [-1, 6])
def test_a_row_that_is_not_there_is_an_error(number: int) -> None:
    spec = robot("puma560")
    with pytest.raises(IndexError, match=rf"^puma560 has rows 0 to 5, not {number}$"):
        explained(spec, number, np.zeros(6))


def test_a_joint_vector_of_the_wrong_length_is_an_error() -> None:
    with pytest.raises(ConfigurationError, match="expected 6 joint coordinates"):
        explained(robot("puma560"), 0, np.zeros(5))


def test_a_fixed_row_has_no_star() -> None:
    spec = RobotSpec(
        name="r",
        rows=(Row(name="f", type=JointType.FIXED, convention=STANDARD, theta=0.5, d=0.1), row("j")),
    )
    scene = explained(spec, 0, [0.3])
    assert (label(scene, "theta"), label(scene, "d")) == ("θ₁ = 28.6479°", "d₁ = 0.1 m")
