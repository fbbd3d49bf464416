from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.skeleton import Skeleton, build_skeleton
from dh2sim.robot.links import ToolSpec
from dh2sim.robot.row import Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import read_only
from tests.sample_robots import MODIFIED, PRISMATIC, REVOLUTE, STANDARD, row
from tests.strategies import robot_specs


def skeleton(
    *rows: Row, tool: tuple[float, float, float] = (0, 0, 0), travel: tuple[float, float] = (0, 0)
) -> Skeleton:
    spec = RobotSpec(name="r", rows=rows, tool=ToolSpec(xyz=read_only(tool)))
    return build_skeleton(build_chain(spec), [travel if one.type is PRISMATIC else (0.0, 0.0) for one in rows])


def test_an_arm_with_a_shoulder_an_elbow_and_a_wrist_meets_there() -> None:
    """The PUMA's shape: a roll along the forearm, three axes through the wrist's centre."""
    found = skeleton(
        row("waist", d=0.6, alpha=-math.pi / 2),
        row("shoulder", a=0.4),
        row("elbow", alpha=math.pi / 2),
        row("roll", d=0.3, alpha=-math.pi / 2),
        row("pitch", alpha=math.pi / 2),
        row("flange", d=0.1),
    )
    # the waist turns a column from the base to the shoulder, the roll all of the forearm
    assert found.entry_heights == pytest.approx((-0.6, 0, 0, -0.3, 0, -0.1))
    assert found.exit_heights == pytest.approx((0, 0, 0, 0, 0, 0))
    assert found.segments == pytest.approx((0, 0.6, 0, 0, 0.4, 0, 0, 0.3, 0, 0, 0, 0.1, 0), abs=1e-15)
    assert found.steps == pytest.approx((0.6, 0, 0.4, 0.3, 0, 0.1, 0), abs=1e-15)


def test_an_arm_with_parallel_axes_is_as_high_as_its_tool() -> None:
    found = skeleton(row("one", a=0.5, d=0.3), row("two", a=0.4), row("three", a=0.2), tool=(0, 0, 0.1))
    heights = [entry[2] for entry in found.arrivals]
    assert heights == pytest.approx([0.4, 0.1, 0.1])  # joint frame 1 is 0.3 above the base, the others at its height
    assert found.exit_heights == pytest.approx((0.1, 0.1, 0.1))
    assert found.entry_heights[0] == pytest.approx(-0.3)


def test_a_slide_is_held_where_the_axis_before_it_passes() -> None:
    found = skeleton(
        row("waist", d=0.4, alpha=-math.pi / 2),
        row("shoulder", d=0.15, alpha=math.pi / 2),
        row("reach", "prismatic"),
        row("roll", alpha=-math.pi / 2),
        row("pitch", alpha=math.pi / 2),
        row("flange", d=0.3),
        travel=(0.1, 1.2),
    )
    assert found.entry_heights[2] == pytest.approx(0.0)
    assert found.exit_heights[2] == pytest.approx(0.0)
    assert found.steps[2] == pytest.approx(1.2)
    assert found.slides == (None, None, (0.1, 1.2), None, None, None)


def test_a_vertical_slide_behind_vertical_axes_is_held_above_its_travel() -> None:
    down = row("two", a=0.3, alpha=math.pi)
    found = skeleton(row("one", a=0.3), down, row("quill", "prismatic"), row("turn", d=0.05), travel=(0.0, 0.2))
    # the tool is 0.05 below the arm's frames, and goes down by 0.2: the arm is a quarter of that above it
    assert found.entry_heights[2] == pytest.approx(0.0)
    assert found.exit_heights[2] == pytest.approx(0.05)


@settings(max_examples=min(60, settings().max_examples))
@given(robot_specs(max_rows=7, must_move=False))
def test_points_are_on_the_axes_and_projected_onto_them(spec: RobotSpec) -> None:
    chain = build_chain(spec)
    found = build_skeleton(chain, [(-0.1, 0.3) if one.type is PRISMATIC else (0.0, 0.0) for one in spec.rows])
    for k, joint in enumerate(chain.joints):
        T = np.asarray(joint.T_parent_joint)
        for point, height in (
            (found.entries[k], found.entry_heights[k]),
            (found.arrivals[k], found.exit_heights[k]),
        ):
            np.testing.assert_allclose(point, T[:3, 3] + height * T[:3, 2], rtol=0, atol=1e-14)
        # square to the axis that it is projected onto
        assert abs(float(np.subtract(found.entries[k], found.leaving(k)) @ T[:3, 2])) < 1e-14
        if joint.type is not PRISMATIC and k > 0:
            assert abs(float(found.arrivals[k][2] - found.leaving(k)[2])) < 1e-14


def test_a_row_that_only_moves_its_frame_moves_no_point() -> None:
    near = skeleton(row("one", a=0.5), row("two", a=0.4), row("three", convention=MODIFIED, alpha=0.3, a=0.1))
    far = skeleton(
        row("one", a=0.5, d=500.0), row("two", a=0.4, d=-500.0), row("three", convention=MODIFIED, alpha=0.3, a=0.1)
    )
    assert far.segments == pytest.approx(near.segments, abs=1e-12)
    assert far.steps == pytest.approx(near.steps, abs=1e-12)


def test_the_taut_length_of_a_stretched_arm_is_its_length() -> None:
    found = skeleton(row("one", a=0.5, d=0.3), row("two", a=0.4), tool=(0.2, 0.0, 0.0))
    assert found.taut_length == pytest.approx(math.hypot(1.1, 0.3), rel=1e-3)
    assert found.taut_length >= math.hypot(1.1, 0.3)


@settings(max_examples=min(60, settings().max_examples))
@given(robot_specs(max_rows=7, must_move=False))
def test_the_taut_length_is_no_longer_than_the_steps(spec: RobotSpec) -> None:
    chain = build_chain(spec)
    found = build_skeleton(chain, [(-0.1, 0.3) if one.type is PRISMATIC else (0.0, 0.0) for one in spec.rows])
    assert found.taut_length <= math.fsum(found.steps)


def test_an_arm_without_lengths_has_no_segments() -> None:
    found = skeleton(row("one"), Row(name="two", type=REVOLUTE, convention=STANDARD, alpha=1.0))
    assert set(found.segments) == {0.0}
    assert found.taut_length == 0.0
