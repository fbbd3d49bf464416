"""Links of mechanisms are shown to reach what they hold."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.kinematics.tree import BASE
from dh2sim.model.mechanism import build_mechanism
from dh2sim.robot.catalog import builtin_mechanisms
from dh2sim.robot.read import load_robot


@pytest.mark.parametrize("name", builtin_mechanisms())
def test_links_are_drawn_to_where_closures_hold_them(name: str) -> None:
    model = build_mechanism(load_robot(name))
    links = {BASE: model.base, **dict(enumerate(model.links))}
    for closure in model.tree.closures:
        for frame in (model.tree.frame(closure.a), model.tree.frame(closure.b)):
            point = frame.T_body_frame[:3, 3]
            ends = [np.zeros(3), *(np.array(end) for shape in links[frame.body].shapes for end in shape.ends)]
            nearest = min(math.dist(point, end) for end in ends)
            assert nearest < 0.15 * model.size, (closure.name, nearest)


def test_struts_weigh_nothing() -> None:
    model = build_mechanism(load_robot("four_bar"))
    coupler = model.links[1]
    assert [shape.solid for shape in coupler.shapes][-1] is False
    assert coupler.inertial is not None
