from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings

from dh2sim.kinematics.transforms import pose_from_rpy, quaternion_from_rotation
from dh2sim.model.build import build_model
from dh2sim.model.mass import MassProperties, in_frame, made_possible, of_shapes, shifted_inertia
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.shapes import Shape, ShapeKind, ShapePart
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.model.samples import body_inertia, compiled
from tests.sample_robots import NAMES, model
from tests.strategies import robot_specs

DENSITY = 850.0
POSES = (
    pose_from_rpy([0, 0, 0], [0, 0, 0]),
    pose_from_rpy([0.3, -0.2, 0.5], [0.7, -1.1, 2.3]),
    pose_from_rpy([-0.4, 0.1, -0.6], [-2.0, 0.4, 0.9]),
)


def shape(kind: ShapeKind, radius: float, length: float, T: Array) -> Shape:
    size = (radius, 0.7 * radius, length) if kind is ShapeKind.BOX else None
    return Shape(kind=kind, part=ShapePart.LINK, radius=radius, length=length, T_link_shape=T, size=size)


SHAPES = [
    shape(kind, radius, length, T)
    for kind in ShapeKind
    for (radius, length) in ((0.1, 0.5), (0.3, 0.02), (0.004, 2.0))
    for T in POSES
]


def geom_size(one: Shape) -> str:
    """As MuJoCo has it: half of the sides of a box, radius and half the length of a cylinder or a capsule."""
    if one.size is not None:
        return " ".join(repr(0.5 * side) for side in one.size)
    return f"{one.radius!r} {0.5 * one.length!r}"


def in_mujoco(shapes: list[Shape]) -> MassProperties:
    geoms = "".join(
        f'<geom type="{one.kind.value}" size="{geom_size(one)}" density="{DENSITY!r}" '
        f'pos="{" ".join(map(repr, one.T_link_shape[:3, 3].tolist()))}" '
        f'quat="{" ".join(map(repr, quaternion_from_rotation(one.T_link_shape).tolist()))}"/>'
        for one in shapes
    )
    mj = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody><body><freejoint/>{geoms}</body></worldbody></mujoco>")
    return MassProperties(mass=float(mj.body_mass[1]), com=mj.body_ipos[1], inertia=body_inertia(mj, 1))


def assert_same(found: MassProperties, expected: MassProperties, tolerance: float) -> None:
    assert found.mass == pytest.approx(expected.mass, rel=tolerance)
    np.testing.assert_allclose(found.com, expected.com, rtol=0, atol=tolerance)
    scale = float(np.trace(expected.inertia))
    np.testing.assert_allclose(found.inertia, expected.inertia, rtol=0, atol=tolerance * scale)


@pytest.mark.parametrize("one", SHAPES, ids=range(len(SHAPES)))
def test_a_shape_weighs_what_mujoco_says(one: Shape) -> None:
    assert_same(of_shapes([one], DENSITY), in_mujoco([one]), 1e-12)


@pytest.mark.parametrize("count", [2, 3, 7])
def test_several_shapes_weigh_what_mujoco_says(count: int) -> None:
    some = [SHAPES[i] for i in np.random.default_rng(count).choice(len(SHAPES), count, replace=False)]
    assert_same(of_shapes(some, DENSITY), in_mujoco(some), 1e-11)


@pytest.mark.parametrize("kind", list(ShapeKind))
def test_a_shape_weighs_what_its_triangulated_surface_says(kind: ShapeKind) -> None:
    one = shape(kind, 0.2, 0.7, POSES[1])
    match kind:
        case ShapeKind.CYLINDER:
            surface = trimesh.creation.cylinder(radius=0.2, height=0.7, sections=400)
        case ShapeKind.CAPSULE:
            surface = trimesh.creation.capsule(radius=0.2, height=0.7, count=(200, 200))
            surface.apply_translation(-surface.bounds.mean(axis=0))
        case ShapeKind.SPHERE:
            surface = trimesh.creation.icosphere(subdivisions=5, radius=0.2)
        case ShapeKind.BOX:
            surface = trimesh.creation.box(one.size)
    surface.apply_transform(one.T_link_shape)
    surface.density = DENSITY
    faceted = MassProperties(mass=surface.mass, com=surface.center_mass, inertia=surface.moment_inertia)
    assert_same(of_shapes([one], DENSITY), faceted, 1e-3)


def assert_possible(inertia: Array) -> None:
    np.testing.assert_array_equal(inertia, inertia.T)
    a, b, c = np.linalg.eigvalsh(inertia)
    assert a > 0
    assert a + b >= c * (1 - 1e-15)


def assert_bodies_are_possible(built: RobotModel) -> None:
    for link in built.links:
        if link.inertial is not None:
            assert_possible(link.inertial.inertia)


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_inertia_of_every_link_is_one_that_a_body_can_have(name: str) -> None:
    assert_bodies_are_possible(model(name))


@pytest.mark.slow
@settings(max_examples=min(60, settings().max_examples))
@given(robot_specs(must_move=False))
def test_inertia_of_every_link_of_any_robot_is_one_that_a_body_can_have(spec: RobotSpec) -> None:
    assert_bodies_are_possible(build_model(spec))


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_mujoco_reads_the_mass_properties_that_the_model_has(name: str) -> None:
    built = model(name)
    mj = compiled(built)
    assert float(mj.body_mass.sum()) == pytest.approx(built.mass, rel=1e-14)
    for link in built.links:
        if link.inertial is None:
            continue
        body = mj.body(link.name)
        assert body.mass[0] == link.inertial.mass
        np.testing.assert_array_equal(body.ipos, link.inertial.com)
        np.testing.assert_allclose(
            body_inertia(mj, body.id),
            link.inertial.inertia,
            rtol=0,
            atol=1e-12 * np.trace(link.inertial.inertia),
        )


def test_an_inertia_in_another_frame_is_turned_and_moved() -> None:
    T = POSES[1]
    R = T[:3, :3]
    tensor = np.array([[2.0, 0.1, -0.2], [0.1, 3.0, 0.3], [-0.2, 0.3, 4.0]])
    moved = in_frame(T, MassProperties(mass=2.5, com=np.array([0.1, 0.2, -0.3]), inertia=tensor))
    assert moved.mass == 2.5
    np.testing.assert_allclose(moved.com, R @ [0.1, 0.2, -0.3] + T[:3, 3], rtol=0, atol=1e-15)
    np.testing.assert_allclose(moved.inertia, R @ tensor @ R.T, rtol=0, atol=2e-15)


def test_the_parallel_axis_theorem_equals_a_point_mass_farther_out() -> None:
    offset = [0.3, -0.4, 0.5]
    found = shifted_inertia([[0.0] * 3] * 3, 2.0, offset)
    cross = np.array([[0, -0.5, -0.4], [0.5, 0, -0.3], [0.4, 0.3, 0]])
    np.testing.assert_allclose(found, 2.0 * cross.T @ cross, rtol=0, atol=1e-15)


def plates() -> list[Array]:
    rng = np.random.default_rng(4)
    tensors = []
    for k in range(60):
        a, b = rng.uniform(0.01, 5, 2) * 10.0 ** rng.integers(-5, 3)
        R = pose_from_rpy([0, 0, 0], rng.uniform(-math.pi, math.pi, 3))[:3, :3] if k % 3 else np.eye(3)
        tensor = R @ np.diag(rng.permutation([a, b, (a + b) * (1 + (9e-10 if k % 2 else 0.0))])) @ R.T
        tensors.append(read_only((tensor + tensor.T) / 2))
    return tensors


def test_flat_bodies_whose_numbers_are_rounded_become_possible() -> None:
    for tensor in plates():
        mended = made_possible(tensor)
        assert_possible(mended)
        np.testing.assert_allclose(mended, tensor, rtol=0, atol=2e-9 * np.trace(tensor))


def test_a_possible_inertia_stays_as_it_is() -> None:
    tensor = read_only([[2.0, 0.1, -0.2], [0.1, 3.0, 0.3], [-0.2, 0.3, 4.0]])
    np.testing.assert_array_equal(made_possible(tensor), tensor)
