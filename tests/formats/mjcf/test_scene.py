from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.formats.mjcf.scene import to_scene
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.links import BaseSpec, Pose
from dh2sim.robot.row import JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.formats.readers import no_mujoco_warnings, parsed
from tests.sample_robots import NAMES, ODD_ROBOT, REVOLUTE, STANDARD, model
from tests.strategies import robot_specs


def compiled(built: RobotModel) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The scene with its robot, at home."""
    files = {f"{built.name}.xml": to_mjcf(built).encode()}
    with no_mujoco_warnings():
        mj = mujoco.MjModel.from_xml_string(to_scene(built), files)
    data = mujoco.MjData(mj)
    data.qpos[:] = built.home
    mujoco.mj_forward(mj, data)
    return mj, data


def in_image(mj: mujoco.MjModel, data: mujoco.MjData, points: Array, aspect: float) -> Array:
    """Where points (k, 3) are in the overview camera's image, shape (k, 2); the edges are at -1 and 1."""
    camera = mj.camera("overview").id
    seen = (points - data.cam_xpos[camera]) @ data.cam_xmat[camera].reshape(3, 3)
    assert (seen[:, 2] < 0).all()  # it looks along -z
    half = math.tan(math.radians(float(mj.cam_fovy[camera]) / 2))
    image: Array = seen[:, :2] / -seen[:, 2:] / [half * aspect, half]
    return image


def assert_shows_the_robot(built: RobotModel) -> None:
    mj, data = compiled(built)
    assert mj.geom("floor").type[0] == mujoco.mjtGeom.mjGEOM_PLANE
    assert mj.geom("floor").pos[2] <= 0.0
    assert mj.nlight == 1
    assert data.ncon == 0
    robot = [
        geom
        for geom in range(mj.ngeom)
        if mj.geom(geom).name not in ("floor", "pedestal") and mj.geom_bodyid[geom] > 0
    ]
    assert len(robot) == sum(len(link.shapes) for link in built.all_links)
    for aspect in (16 / 9, 1.0):
        assert np.abs(in_image(mj, data, data.geom_xpos[robot], aspect)).max() < 1.0
    # nothing that is shown lies under the floor
    assert float((data.geom_xpos[robot][:, 2]).min()) >= mj.geom("floor").pos[2]


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_the_scene_shows_the_robot_on_a_floor_that_it_does_not_touch(name: str) -> None:
    assert_shows_the_robot(model(name))


@settings(max_examples=min(30, settings().max_examples))
@given(robot_specs(must_move=False))
def test_the_scene_shows_any_robot_on_a_floor_that_it_does_not_touch(spec: RobotSpec) -> None:
    assert_shows_the_robot(build_model(spec))


def test_the_scene_includes_the_robot_beside_it(tmp_path: Path) -> None:
    built = model("odd")
    assert [e.attrib for e in parsed(to_scene(built)).findall("include")] == [{"file": "odd.xml"}]
    (tmp_path / "odd.xml").write_text(to_mjcf(built))
    (tmp_path / "scene.xml").write_text(to_scene(built))
    alone = mujoco.MjModel.from_xml_path(str(tmp_path / "odd.xml"))
    whole = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    assert (whole.nbody, whole.njnt, whole.nu) == (alone.nbody, alone.njnt, alone.nu)
    assert (whole.nsensor, whole.nkey) == (alone.nsensor, alone.nkey)
    assert whole.opt.timestep == alone.opt.timestep
    np.testing.assert_array_equal(whole.opt.gravity, alone.opt.gravity)
    np.testing.assert_array_equal(whole.key_ctrl, alone.key_ctrl)


def lifted(height: float) -> RobotModel:
    base = BaseSpec(pose=Pose(xyz=read_only([0.5, -0.4, height]), rpy=ODD_ROBOT.base.pose.rpy))
    return build_model(dataclasses.replace(ODD_ROBOT, base=base))


def test_the_floor_is_at_zero_below_a_robot_that_is_above_it() -> None:
    mj, _ = compiled(lifted(3.0))
    assert mj.geom("floor").pos[2] == 0.0
    assert "pedestal" not in [mj.geom(i).name for i in range(mj.ngeom)]


def test_the_floor_is_at_the_foot_of_a_base_whose_first_axes_meet_at_its_origin() -> None:
    mj, _ = compiled(model("puma560"))
    plate = mj.body("base_link").geomadr[0]
    assert mj.geom("floor").pos[2] == pytest.approx(float(mj.geom_pos[plate, 2] - mj.geom_size[plate, 1]), abs=1e-4)
    assert mj.geom("floor").pos[2] < 0.0
    assert "pedestal" not in [mj.geom(i).name for i in range(mj.ngeom)]


def test_an_arm_that_hangs_from_its_base_has_no_pedestal() -> None:
    mj, _ = compiled(lifted(-1.0))
    assert mj.geom("floor").pos[2] < -1.0
    assert "pedestal" not in [mj.geom(i).name for i in range(mj.ngeom)]


def test_a_robot_that_reaches_lower_is_on_a_pedestal_that_nothing_touches() -> None:
    rows = [Row(name=f"j{i}", type=REVOLUTE, convention=STANDARD, alpha=a) for i, a in enumerate((1.5, 0.0))]
    hanging = Row(name="down", type=REVOLUTE, convention=STANDARD, a=0.8, theta=-1.4)
    mj, _ = compiled(build_model(RobotSpec(name="reaching", rows=(*rows, hanging))))
    floor, pedestal, plate = mj.geom("floor"), mj.geom("pedestal"), mj.geom_size[mj.body("base_link").geomadr[0]]
    foot = float(mj.geom_pos[mj.body("base_link").geomadr[0], 2] - plate[1])
    assert floor.pos[2] < -0.8 < foot < 0.0
    assert pedestal.pos[2] == pytest.approx(0.5 * (floor.pos[2] + foot), abs=1e-3)
    assert pedestal.size[1] == pytest.approx(0.5 * (foot - floor.pos[2]), abs=1e-3)
    assert (pedestal.contype[0], pedestal.conaffinity[0]) == (0, 0)


@pytest.mark.parametrize("size", [1e-2, 1.0, 1e3])
def test_the_scene_fits_small_and_large_robots(size: float) -> None:
    rows = [Row(name=f"j{i}", type=REVOLUTE, convention=STANDARD, a=size, alpha=0.7, d=0.3 * size) for i in range(3)]
    built = build_model(RobotSpec(name="sized", rows=tuple(rows)))
    assert_shows_the_robot(built)
    mj, _ = compiled(built)
    assert built.reach / 4 < mj.stat.extent < built.reach * 4


def test_a_robot_of_one_fixed_row_has_a_scene() -> None:
    row = Row(name="only", type=JointType.FIXED, convention=STANDARD)
    assert_shows_the_robot(build_model(RobotSpec(name="statue", rows=(row,))))
