"""Where a link is grabbed, and the arrow that shows the drag."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from dh2sim.validate.motion.free_motion import compile_model
from dh2sim.view.scene.items import Arrow
from dh2sim.view.scene.scene import point_in_link, scene_of
from dh2sim.view.state import LinkDrag, Mode
from tests.view.states import STANFORD

Q = (0.3, -0.4, 0.35, 0.5, -0.6, 0.7)


def in_base_link(link: str, point: tuple[float, float, float]) -> np.ndarray:
    """Where MuJoCo has a point of a link with the joints at ``Q``, m."""
    model = compile_model(STANFORD.model)
    data = mujoco.MjData(model)
    data.qpos[:] = Q
    mujoco.mj_kinematics(model, data)
    body = model.body(link).id
    return np.asarray(data.xpos[body] + data.xmat[body].reshape(3, 3) @ np.array(point))


@pytest.mark.parametrize("link", ["link_1", "link_3", "link_6"])
def test_a_point_in_link_is_given_in_the_frame_of_its_link(link: str) -> None:
    point = (0.02, -0.1, 0.3)
    assert point_in_link(STANFORD.model, Q, link, in_base_link(link, point)) == pytest.approx(point, abs=1e-12)


def test_an_arrow_leads_from_the_point_in_link_to_the_mouse() -> None:
    drag = LinkDrag(link="link_3", point_in_link=(0.0, 0.05, 0.1), target=(1.0, 2.0, 3.0))
    pulled = replace(STANFORD, q=Q, mode=Mode.PHYSICS, drag=drag)
    arrow = scene_of(pulled)["/drag"]
    assert isinstance(arrow, Arrow)
    assert arrow.start == pytest.approx(in_base_link("link_3", drag.point_in_link), abs=1e-12)
    assert arrow.end == drag.target
    assert "/drag" not in scene_of(replace(pulled, drag=None))
