"""Where links and frames are: where the table and the textbook's product of matrices have them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.robot.read import load_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from dh2sim.view.scene.link_poses import poses_at
from tests.strategies import robots_with_joint_vectors


@settings(max_examples=min(60, settings().max_examples))
@given(robots_with_joint_vectors(max_rows=7))
def test_frames_and_tool_are_where_the_table_has_them(robot: tuple[RobotSpec, Array]) -> None:
    spec, vectors = robot
    model = build_model(spec)
    scale = max(1.0, model.reach)
    for q in vectors:
        poses = poses_at(model, q)
        assert np.allclose(poses.frames, table_frame_poses(spec, q), rtol=0, atol=1e-12 * scale)
        assert np.allclose(poses.tool0, table_tool_pose(spec, q), rtol=0, atol=1e-12 * scale)
        assert poses.links[0].tolist() == np.eye(4).tolist()
        links = [*poses.links[1:]]
        if model.tool is not None:
            assert links.pop().tolist() == poses.frames[-1].tolist()
        for link, joint, frame in zip(links, model.chain.joints, poses.frames[1:], strict=True):
            assert np.allclose(link @ joint.T_joint_dh, frame, rtol=0, atol=1e-12 * scale)


def test_a_configuration_is_worked_out_once_and_cannot_be_spoilt() -> None:
    model = build_model(load_robot("stanford"))
    first = poses_at(model, [0.1] * 6)
    assert poses_at(model, np.full(6, 0.1)) is first
    assert poses_at(model, [0.1] * 5 + [0.2]) is not first
    for poses in (first.links, first.frames, first.tool0):
        with pytest.raises(ValueError, match="read-only"):
            poses[..., 0, 3] = 1.0


def test_a_configuration_of_the_wrong_length_is_refused() -> None:
    model = build_model(load_robot("stanford"))
    with pytest.raises(ConfigurationError):
        poses_at(model, [0.0] * 5)
