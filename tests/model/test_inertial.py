from __future__ import annotations

import dataclasses
import math

import mujoco
import numpy as np
import pytest

from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.model.build import build_model
from dh2sim.model.link_shapes import HOUSING, TUBE
from dh2sim.model.mass import ASSUMED_DENSITY, MIN_MASS, MassProperties
from dh2sim.model.robot_model import LinkModel
from dh2sim.model.shapes import neat
from dh2sim.robot import magnitudes
from dh2sim.robot.links import LinkSpec
from dh2sim.robot.row import Convention, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.model.test_mass import plates
from tests.sample_robots import FIXED, HAYATI, MODIFIED, ODD, REVOLUTE, STANDARD

MASS = 4.2
COM = read_only([0.05, -0.03, 0.11])
INERTIA = read_only([[0.04, 0.003, -0.002], [0.003, 0.05, 0.004], [-0.002, 0.004, 0.06]])
A = 0.3
BETA = -0.4


def robot(link: LinkSpec, convention: Convention = STANDARD) -> RobotSpec:
    d, beta = (0.0, BETA) if convention is HAYATI else (0.2, 0.0)
    row = Row(name="one", type=REVOLUTE, convention=convention, a=A, alpha=ODD, d=d, theta=0.7, beta=beta, link=link)
    behind = STANDARD if convention is HAYATI else convention
    after = Row(name="two", type=REVOLUTE, convention=behind, a=0.1, alpha=-1.1, d=0.15)
    return RobotSpec(name="weighed", rows=(row, after))


def first_link(link: LinkSpec, convention: Convention = STANDARD) -> tuple[LinkModel, MassProperties]:
    built = build_model(robot(link, convention)).links[0]
    assert built.inertial is not None
    return built, built.inertial


def dh_in_joint(convention: Convention) -> tuple[Array, Array]:
    """Rotation and position of DH frame 1 in the joint's frame, by hand."""
    if convention is MODIFIED:
        return np.eye(3), np.zeros(3)
    c, s = math.cos(ODD), math.sin(ODD)
    Rx = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    c, s = (math.cos(BETA), math.sin(BETA)) if convention is HAYATI else (1.0, 0.0)
    return Rx @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]), np.array([A, 0, 0])


@pytest.mark.parametrize("convention", list(Convention))
def test_what_is_given_in_the_dh_frame_ends_up_right_in_the_joint_frame(convention: Convention) -> None:
    link, body = first_link(LinkSpec(mass=MASS, com=COM, inertia=INERTIA), convention)
    R, p = dh_in_joint(convention)
    assert link.estimated == ()
    assert body.mass == MASS
    np.testing.assert_allclose(body.com, R @ COM + p, rtol=0, atol=1e-16)
    np.testing.assert_allclose(body.inertia, R @ INERTIA @ R.T, rtol=0, atol=1e-17)


def test_what_is_given_wins_and_what_is_estimated_is_marked() -> None:
    _, estimate = first_link(LinkSpec())
    R, p = dh_in_joint(STANDARD)
    link, body = first_link(LinkSpec(com=COM))
    assert link.estimated == ("mass", "inertia")
    assert body.mass == estimate.mass
    np.testing.assert_allclose(body.com, R @ COM + p, rtol=0, atol=1e-16)
    np.testing.assert_array_equal(body.inertia, estimate.inertia)
    link, body = first_link(LinkSpec(inertia=INERTIA))
    assert link.estimated == ("mass", "com")
    np.testing.assert_array_equal(body.com, estimate.com)
    np.testing.assert_allclose(body.inertia, R @ INERTIA @ R.T, rtol=0, atol=1e-17)
    link, _ = first_link(LinkSpec())
    assert link.estimated == ("mass", "com", "inertia")


def test_a_given_mass_scales_the_estimated_inertia() -> None:
    _, estimate = first_link(LinkSpec())
    link, body = first_link(LinkSpec(mass=MASS))
    assert link.estimated == ("com", "inertia")
    assert body.mass == MASS
    np.testing.assert_array_equal(body.com, estimate.com)
    np.testing.assert_allclose(body.inertia, estimate.inertia * MASS / estimate.mass, rtol=1e-15)


def test_a_given_density_scales_the_estimated_mass() -> None:
    _, estimate = first_link(LinkSpec())
    link, body = first_link(LinkSpec(density=2.7 * ASSUMED_DENSITY))
    assert link.estimated == ("mass", "com", "inertia")
    assert body.mass == pytest.approx(2.7 * estimate.mass, rel=1e-14)
    np.testing.assert_allclose(body.com, estimate.com, rtol=0, atol=1e-15)
    np.testing.assert_allclose(body.inertia, 2.7 * estimate.inertia, rtol=1e-13, atol=1e-17)


def test_a_given_radius_is_that_of_the_shapes() -> None:
    link, _ = first_link(LinkSpec(radius=0.02))
    radii = {shape.radius for shape in link.shapes if shape.solid}
    assert neat(HOUSING * 0.02) in radii
    assert radii <= {neat(TUBE * 0.02), neat(HOUSING * 0.02)}


def fixed_link(link: LinkSpec) -> LinkModel:
    fixed = Row(name="mount", type=FIXED, convention=MODIFIED, link=link)
    turned = Row(name="turn", type=REVOLUTE, convention=MODIFIED)
    return build_model(RobotSpec(name="mounted", rows=(fixed, turned))).links[0]


def test_a_fixed_link_of_which_nothing_is_known_weighs_nothing() -> None:
    link = fixed_link(LinkSpec())
    assert link.shapes == ()
    assert link.inertial is None
    assert link.estimated == ()


def test_a_fixed_link_of_which_only_the_mass_is_known_is_a_small_ball() -> None:
    link = fixed_link(LinkSpec(mass=2.0, radius=0.05))
    assert link.inertial is not None
    assert link.inertial.mass == 2.0
    np.testing.assert_array_equal(link.inertial.com, [0, 0, 0])
    np.testing.assert_allclose(link.inertial.inertia, 0.4 * 2.0 * 0.05**2 * np.eye(3), rtol=1e-15)
    assert link.estimated == ("com", "inertia")


def test_mujoco_reads_links_that_are_flat() -> None:
    for tensor in plates():
        built = build_model(robot(LinkSpec(mass=1.0, com=COM, inertia=tensor)))
        for text in (to_mjcf(built), to_urdf(built)):
            mujoco.MjModel.from_xml_string(text)


def test_a_given_inertia_is_not_changed_by_what_follows_it() -> None:
    spec = robot(LinkSpec(mass=MASS, com=COM, inertia=INERTIA))
    longer = dataclasses.replace(spec, rows=(spec.rows[0], dataclasses.replace(spec.rows[1], d=3.0)))
    one, other = (build_model(one).links[0].inertial for one in (spec, longer))
    assert one is not None
    assert other is not None
    np.testing.assert_array_equal(one.inertia, other.inertia)


@pytest.mark.parametrize("size", [1e-2, 1e-3, 1e-4, 1e-6, 1e-8])
def test_mujoco_reads_robots_however_small_they_are(size: float) -> None:
    rows = [Row(name=f"j{i}", type=REVOLUTE, convention=STANDARD, a=size, alpha=ODD, d=0.5 * size) for i in range(3)]
    built = build_model(RobotSpec(name="tiny", rows=tuple(rows)))
    for text in (to_mjcf(built), to_urdf(built)):
        assert mujoco.MjModel.from_xml_string(text).nv == 3
    for link in built.links:
        assert link.inertial is not None
        assert link.inertial.mass >= MIN_MASS
        assert np.linalg.eigvalsh(link.inertial.inertia)[0] >= 0.999 * magnitudes.INERTIA.least


def test_a_given_mass_is_kept_however_small_it_is() -> None:
    _, body = first_link(LinkSpec(mass=1e-12, com=COM, inertia=read_only(2e-14 * np.eye(3))))
    assert body.mass == 1e-12
    np.testing.assert_allclose(body.inertia, 2e-14 * np.eye(3), rtol=0, atol=1e-27)
