"""Tables made fit for calibration are the same arms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.calibrate.hayati_rows import NEARLY_PARALLEL, fit_rows
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from tests.calibrate.measured import off, random_q
from tests.sample_robots import NAMES, robot
from tests.strategies import robot_specs


def require_same_arm(spec: RobotSpec) -> RobotSpec:
    fitted = fit_rows(spec)
    q = random_q(spec, 4, 0)
    scale = 1.0 + sum(abs(row.a) + abs(row.d) for row in spec.rows)
    assert np.abs(table_tool_pose(fitted, q) - table_tool_pose(spec, q)).max() < 1e-12 * scale
    for row, after in zip(fitted.rows, fitted.rows[1:], strict=False):
        if row.convention is Convention.STANDARD and after.convention is not Convention.MODIFIED:
            assert abs(math.sin(row.alpha)) >= NEARLY_PARALLEL
        if row.convention is after.convention is Convention.MODIFIED:
            assert abs(math.sin(after.alpha)) >= NEARLY_PARALLEL
    return fitted


@pytest.mark.parametrize("name", NAMES)
def test_no_row_between_nearly_parallel_axes_is_left(name: str) -> None:
    spec = robot(name)
    fitted = require_same_arm(spec)
    if fitted is spec:
        return
    assert [row.name for row in fitted.rows] == [row.name for row in spec.rows]
    assert [row.limits for row in fitted.rows] == [row.limits for row in spec.rows]


@settings(max_examples=15)
@given(robot_specs(max_rows=5))
def test_any_table_stays_the_same_arm(spec: RobotSpec) -> None:
    fitted = fit_rows(spec)
    q = random_q(spec, 4, 0)
    scale = 1.0 + sum(abs(row.a) + abs(row.d) for row in spec.rows)
    assert np.abs(table_tool_pose(fitted, q) - table_tool_pose(spec, q)).max() < 1e-9 * scale


def test_a_table_with_small_twists_becomes_hayatis_row_by_row() -> None:
    spec = robot("ur5e")
    rows = [replace(row, alpha=row.alpha + 0.003 * (-1) ** k, d=row.d + 0.2) for k, row in enumerate(spec.rows)]
    near = replace(spec, rows=tuple(rows), source_file=None)
    fitted = fit_rows(near)
    assert [row.convention.value[0] for row in fitted.rows] == list("shhsss")
    assert all(row.d == 0.0 for row in fitted.rows[1:3])
    q = random_q(spec, 20, 1)
    assert np.abs(table_tool_pose(fitted, q) - table_tool_pose(near, q)).max() < 1e-13
    assert fitted.rows[1].beta != 0.0


@pytest.mark.parametrize("name", ["ur5e", "kuka_kr6_r900", "puma560"])
def test_links_stay_where_they_are(name: str) -> None:
    """Centres of mass in base_link, and inertias along its axes, are the same before and after."""
    spec = robot(name)
    before, after = build_model(spec), build_model(fit_rows(spec))
    q = random_q(spec, 3, 0)
    from dh2sim.kinematics.forward import frame_poses

    T, T_after = frame_poses(before.chain, q), frame_poses(after.chain, q)
    for i, (link, other) in enumerate(zip(spec.rows, fit_rows(spec).rows, strict=True), start=1):
        if link.link.com is None or other.link.com is None:
            continue
        one, two = (
            P[:, i, :3, :3] @ com + P[:, i, :3, 3] for P, com in ((T, link.link.com), (T_after, other.link.com))
        )
        assert np.abs(one - two).max() < 1e-14
        if link.link.inertia is not None and other.link.inertia is not None:
            one = T[:, i, :3, :3] @ link.link.inertia @ T[:, i, :3, :3].transpose(0, 2, 1)
            two = T_after[:, i, :3, :3] @ other.link.inertia @ T_after[:, i, :3, :3].transpose(0, 2, 1)
            assert np.abs(one - two).max() < 1e-14


def test_a_table_without_parallel_axes_is_handed_back() -> None:
    spec = robot("franka_panda")
    assert fit_rows(spec) is spec
    assert off(spec, 0.0, 0).rows[0].convention is Convention.MODIFIED
