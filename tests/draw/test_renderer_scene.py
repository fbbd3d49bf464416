from __future__ import annotations

import mujoco
import numpy as np
import pytest

from dh2sim.draw.renderer import dim, foot, widen
from dh2sim.formats.mjcf.scene import to_scene
from dh2sim.model.build import build_model
from dh2sim.robot.read import load_robot
from tests.draw.datasets import arm


def scene(robot: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(
        to_scene(build_model(load_robot(robot))), {f"{robot}.xml": arm(robot).mjcf.encode()}
    )


def test_surroundings_that_are_large_enough_stay_as_they_are() -> None:
    model, same = scene("stanford"), scene("stanford")
    widen(model, np.array([[0.1, 0.0, 0.0], [0.0, 0.1, 0.6]]))
    assert model.stat.extent == same.stat.extent
    for name in ("geom_pos", "geom_size", "light_pos", "geom_rgba", "geom_matid"):
        assert np.array_equal(getattr(model, name), getattr(same, name))


def test_a_floor_that_is_in_the_way_is_lowered_and_the_pedestal_grows() -> None:
    model = scene("stanford")
    size = model.stat.extent
    widen(model, np.array([[0.0, 0.0, -2.0], [0.0, 0.0, 1.0]]))
    floor, pedestal = model.geom("floor"), model.geom("pedestal")
    assert floor.pos[2] == pytest.approx(-2.0 - 0.1 * size)
    top, bottom = (pedestal.pos[2] + sign * pedestal.size[1] for sign in (1, -1))
    assert (top, bottom) == pytest.approx((0.0, floor.pos[2]))
    assert foot(model)[:, 2] == pytest.approx([floor.pos[2]] * 4)
    assert np.abs(foot(model)[:, :2]) == pytest.approx(np.full((4, 2), pedestal.size[0]))


def test_a_robot_on_the_ground_has_no_pedestal_until_the_floor_is_lowered() -> None:
    robot = next(
        name for name in ("cylindrical", "arm_5r", "puma560", "rpr") if "pedestal" not in _geoms(scene(name))
    )
    model = scene(robot)
    assert foot(model).shape == (0, 3)
    widen(model, np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]))
    assert len(foot(model)) == 4
    assert (foot(model)[:, 2] < -1.0).all()


def test_lights_go_out_with_a_motion_that_is_wider_than_the_robot() -> None:
    model, same = scene("stanford"), scene("stanford")
    points = np.array([[-4.0, 0.0, 0.0], [4.0, 2.0, 3.0]])
    widen(model, points)
    assert model.stat.extent == pytest.approx(np.linalg.norm(points[1] - points[0]) / 2)
    far = (model.light_pos[0] - model.stat.center) / model.stat.extent
    assert far == pytest.approx((same.light_pos[0] - same.stat.center) / same.stat.extent)


def test_the_lamp_at_the_camera_is_dimmed_only_where_it_looks_down() -> None:
    for elevation, dimmed in ((-5.0, False), (-21.0, False), (-60.0, True), (-90.0, True)):
        model = scene("stanford")
        before = float(model.vis.headlight.diffuse[0])
        dim(model, elevation)
        assert (model.vis.headlight.diffuse[0] < before) == dimmed


def _geoms(model: mujoco.MjModel) -> set[str]:
    return {model.geom(i).name for i in range(model.ngeom)}
