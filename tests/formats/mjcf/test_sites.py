from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from dh2sim.formats.mjcf.sites import needs_body
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.kinematics.transforms import identity, pose_from_rpy
from dh2sim.model.build import build_model
from dh2sim.model.mass import MassProperties
from dh2sim.robot.row import Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.formats.readers import in_mujoco
from tests.sample_robots import ODD, REVOLUTE, STANDARD

TURNED = pose_from_rpy([0.3, 0.2, 0.1], [0.4, 0.5, 0.6])


def body(inertia: Array, com: tuple[float, float, float] = (0.1, 0.2, 0.3)) -> MassProperties:
    return MassProperties(mass=1.0, com=read_only(com), inertia=read_only(inertia))


def test_mujoco_still_takes_a_site_for_a_frame_that_is_near_it() -> None:
    # the reason for all of this: were it gone, so could be the bodies
    near = '<site pos="0 0 3e-7" quat="0.9999999999999982 5.960464479999996e-08 0 0"/>'
    mj = in_mujoco(f"<mujoco><worldbody><body>{near}</body></worldbody></mujoco>")
    data = mujoco.MjData(mj)
    mujoco.mj_kinematics(mj, data)
    np.testing.assert_array_equal(data.site_xpos[0], [0, 0, 0])
    np.testing.assert_array_equal(data.site_xmat[0].reshape(3, 3), np.eye(3))


@pytest.mark.parametrize(
    ("T", "needed"),
    [
        (identity(), False),
        (pose_from_rpy([0.3, 0, 0], [0, 0, 0]), False),
        (TURNED, False),
        (pose_from_rpy([0, 0, 0], [math.pi / 2, 0, 0]), False),
        (pose_from_rpy([1e-7, 0, 0], [0, 0, 0]), True),
        (pose_from_rpy([0, 0, 0], [1e-7, 0, 0]), True),
        (pose_from_rpy([0.3, 0, 0], [0, -1e-6, 0]), True),
        (pose_from_rpy([0.3, 0, 0], [0, 0, 1e-12]), True),
        (pose_from_rpy([1e-16, 0, 0], [0, 0, 1e-16]), False),
        (pose_from_rpy([1e-3, 0, 0], [0, 0, 0]), False),
        (pose_from_rpy([0, 0, 0], [1e-3, 0, 0]), False),
    ],
)
def test_a_site_needs_a_body_where_it_is_near_its_links_frame_but_not_in_it(T: Array, needed: bool) -> None:
    assert needs_body(T, None) is needed
    assert needs_body(T, body(np.diag([1.0, 2.0, 2.5]))) is needed


def test_a_site_needs_a_body_where_it_is_near_its_links_principal_axes() -> None:
    R = TURNED[:3, :3]
    inertia = R @ np.diag([1.0, 2.0, 2.5]) @ R.T
    for angle, needed in ((0.0, True), (1e-8, True), (1e-6, True), (1e-2, False)):
        T = TURNED @ pose_from_rpy([0.0, 0.0, 0.0], [angle, 0.0, 0.0])
        assert needs_body(read_only(T), body(inertia)) is needed


def test_a_site_needs_a_body_where_it_is_near_its_links_centre_of_mass() -> None:
    for gap, needed in ((0.0, False), (1e-7, True), (1e-3, False)):
        T = pose_from_rpy([0.1 + gap, 0.2, 0.3], [0.0, 0.0, 0.0])
        assert needs_body(T, body(np.diag([1.0, 2.0, 2.5]))) is needed


def test_a_body_for_a_site_bears_its_name_and_weighs_nothing() -> None:
    rows = (
        Row(name="one", type=REVOLUTE, convention=STANDARD, a=0.3, alpha=1e-7),
        Row(name="two", type=REVOLUTE, convention=STANDARD, a=0.2, alpha=ODD),
    )
    built = build_model(RobotSpec(name="near", rows=rows))
    mj = in_mujoco(to_mjcf(built))
    assert [mj.body(i).name for i in range(1, mj.nbody)] == ["base_link", "link_1", "dh_1", "link_2"]
    assert mj.body("dh_1").mass[0] == 0.0
    assert mj.body("dh_1").parentid[0] == mj.body("link_1").id
    assert mj.body("link_2").parentid[0] == mj.body("link_1").id
    assert mj.site("dh_1").bodyid[0] == mj.body("dh_1").id
    assert mj.nv == 2
