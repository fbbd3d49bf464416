"""Pictures, drawn for real."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from dh2sim.draw.camera import CameraChoice
from dh2sim.draw.motion import Motion
from dh2sim.draw.projection import scene_pinhole
from dh2sim.draw.renderer import PictureOptions, open_motion
from dh2sim.errors import PictureError
from dh2sim.typing import read_only
from tests.draw.drawing import moving, require_gl, robot_seen

SMALL = PictureOptions(width=320, height=180)
FLYING = """
<mujoco>
  <statistic extent="1"/>
  <worldbody>
    <light pos="0 0 5"/>
    <geom name="floor" type="plane" size="0 0 1"/>
    <body name="base_link"><freejoint/><geom size="0.3" rgba="1 0 0 1"/><site name="tool0" pos="0.3 0 0"/></body>
  </worldbody>
</mujoco>
"""


@pytest.fixture(autouse=True)
def _gl() -> None:
    require_gl()


def drawn(motion: Motion, number: int, **options: Any) -> NDArray[np.uint8]:
    with open_motion(motion, replace(SMALL, **options)) as renderer:
        return renderer.picture(number)


def changed(a: NDArray[np.uint8], b: NDArray[np.uint8]) -> NDArray[np.bool_]:
    return np.asarray((np.abs(a.astype(int) - b.astype(int)) > 24).any(axis=2))


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["rpr", "stanford", "planar_2r"])
@pytest.mark.parametrize(
    "camera", [CameraChoice(), CameraChoice(azimuth=20.0, elevation=-60.0)], ids=["usual", "from above"]
)
def test_the_robot_is_whole_in_every_picture_of_its_motion_and_not_small(robot: str, camera: CameraChoice) -> None:
    motion = moving(robot)
    together = np.zeros((180, 320), dtype=bool)
    with open_motion(motion, replace(SMALL, camera=camera)) as renderer:
        for number in range(0, len(motion.time), 5):
            together |= robot_seen(renderer, number)
    rows, columns = np.nonzero(together)
    assert rows.min() >= 6
    assert rows.max() <= 173
    assert columns.min() >= 11
    assert columns.max() <= 308
    assert max(np.ptp(rows) / 180, np.ptp(columns) / 320) > 0.6


def test_a_picture_is_lit_and_the_same_every_time() -> None:
    motion = moving()
    with open_motion(motion, replace(SMALL, trace=False)) as renderer:
        first = renderer.picture(3)
        renderer.picture(9)
        again, robot = renderer.picture(3), robot_seen(renderer, 3)
    assert first.shape == (180, 320, 3)
    assert np.array_equal(first, again)
    assert first[robot].std() > 10
    assert first[~robot].mean() > 100
    assert first.mean() < 230, "not all white"


def test_looking_straight_down_the_floor_is_not_all_white() -> None:
    picture = drawn(moving(), 0, camera=CameraChoice(azimuth=0.0, elevation=-90.0))
    assert (picture.min(axis=2) > 250).mean() < 0.02


@pytest.mark.slow
def test_the_trace_is_shown_where_the_tool_has_been_and_not_where_it_will_be() -> None:
    motion = moving("stanford")
    last = len(motion.time) - 1
    turning = motion.qpos.copy()
    turning[:, 0] += np.linspace(0.0, 2.0, last + 1)
    motion = replace(motion, qpos=read_only(turning))
    lengths = [
        int(changed(drawn(motion, number, trace=True), drawn(motion, number, trace=False)).sum())
        for number in (0, last // 2, last)
    ]
    assert lengths[0] == 0
    assert 20 < lengths[1] < lengths[2] < 0.05 * 320 * 180


def test_frames_are_drawn_over_the_robot() -> None:
    motion = moving()
    plain, framed = drawn(motion, 0, trace=False), drawn(motion, 0, trace=False, frames=True)
    differences = changed(plain, framed)
    assert 0.003 < differences.mean() < 0.1
    with open_motion(motion, SMALL) as renderer:
        renderer.picture(0)
        pinhole = scene_pinhole(renderer.renderer.scene, 180)
        for name in ("dh_1", "dh_2", "dh_3"):
            site = renderer.data.site(name)
            half = site.xpos + 0.085 * renderer.size * site.xmat.reshape(3, 3).T
            for axis, (x, y) in enumerate(pinhole.pixels(half, (320, 180))):
                around = framed[round(y) - 2 : round(y) + 3, round(x) - 2 : round(x) + 3].reshape(-1, 3).astype(int)
                others = np.delete(around, axis, axis=1).max(axis=1)
                assert (around[:, axis] - others).max() > 40, f"{name} has an axis {'xyz'[axis]} of its colour"


@pytest.mark.parametrize(
    "camera", [CameraChoice(azimuth=-35.0, elevation=-25.0), CameraChoice(name="side")], ids=["free", "fixed"]
)
def test_points_are_projected_to_where_they_are_drawn(camera: CameraChoice) -> None:
    model = mujoco.MjModel.from_xml_string("""
    <mujoco>
      <statistic extent="1"/>
      <worldbody>
        <light pos="0 0 5"/>
        <camera name="side" pos="0.2 -3 0.7" xyaxes="1 0.1 0 0 0.2 1"/>
        <body name="base_link">
          <geom pos="-0.4 0 0" size="0.3"/>
          <geom pos="0.5 0.3 0.4" size="0.05"/>
          <site name="tool0"/>
        </body>
      </worldbody>
    </mujoco>""")
    motion = Motion(model=model, qpos=read_only(np.zeros((1, 0))), time=read_only([0.0]))
    with open_motion(motion, PictureOptions(width=640, height=400, camera=camera)) as renderer:
        everything = robot_seen(renderer, 0)
        pinhole = scene_pinhole(renderer.renderer.scene, 400)
    x, y = pinhole.pixels([[0.5, 0.3, 0.4]], (640, 400))[0]
    rows, columns = np.nonzero(everything)
    near = np.hypot(columns + 0.5 - x, rows + 0.5 - y) < 30
    assert near.sum() > 100
    assert np.mean(columns[near] + 0.5) == pytest.approx(x, abs=0.6)
    assert np.mean(rows[near] + 0.5) == pytest.approx(y, abs=0.6)


def test_the_camera_goes_along_with_a_base_that_falls_far() -> None:
    model = mujoco.MjModel.from_xml_string(FLYING)
    time = np.linspace(0.0, 4.0, 21)
    qpos = np.zeros((21, 7))
    qpos[:, 2], qpos[:, 3] = -4.9 * time**2, 1.0
    with open_motion(Motion(model=model, qpos=read_only(qpos), time=read_only(time)), SMALL) as renderer:
        for number in (0, 20):
            rows, columns = np.nonzero(robot_seen(renderer, number))
            assert np.ptp(rows) > 90, "as large at the end as at the start"
            assert math.hypot(rows.mean() - 90, columns.mean() - 160) < 25


def test_the_floor_is_below_all_that_moves() -> None:
    motion = moving("stanford")
    low = motion.qpos.copy()
    low[:, 1] = 2.6  # the arm hangs down
    with open_motion(replace(motion, qpos=read_only(low)), SMALL) as renderer:
        hidden = robot_seen(renderer, 0)
        renderer.motion.model.geom_rgba[renderer.motion.model.geom("floor").id] = 0.0
        renderer.motion.model.geom_matid[renderer.motion.model.geom("floor").id] = -1
        assert np.array_equal(hidden, robot_seen(renderer, 0)), "it hides nothing"


def test_sizes_beyond_the_scenes_own_buffer_work() -> None:
    with open_motion(moving(), PictureOptions(width=2200, height=64)) as renderer:
        assert renderer.picture(0).shape == (64, 2200, 3)


@pytest.mark.parametrize(("width", "height"), [(63, 180), (320, 9000)])
def test_sizes_out_of_range_are_refused(width: int, height: int) -> None:
    name, value = ("width", width) if width < 64 else ("height", height)
    with pytest.raises(PictureError) as caught:
        PictureOptions(width=width, height=height)
    assert str(caught.value) == f"the {name} must be from 64 to 8192 pixels, got {value}"
