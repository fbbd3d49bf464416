"""Many tables at once, against the textbook product of each of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from dh2sim import Robot, TableBatch
from dh2sim.errors import ConfigurationError, RobotError
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array

FILE = """
name: mixed
convention: standard
units: {angle: deg, length: mm}
parameters: {reach: REACH, half: reach / 2 + sqrt(reach)}
base: {xyz: [10, -20, 30], rpy: [ROLL, 20, 30]}
tool: {xyz: [5, 6, TOOLZ], rpy: [-40, 50, 60]}
joints:
  - {type: revolute, a: half, alpha: ALPHA1, d: 120, theta: 11}
  - {type: continuous, convention: modified, a: reach, alpha: -52, d: 30, theta: -25, flip: true}
  - {type: prismatic, a: 30, alpha: 90, d: D3, theta: 71}
  - {type: fixed, convention: modified, a: 20, alpha: 15, d: 10, theta: 33}
  - {type: revolute, convention: hayati, a: 70, alpha: 12, beta: BETA5, theta: 5, flip: true}
  - {type: prismatic, convention: hayati, a: 7, alpha: -12, beta: -8, d: 14, flip: true}
"""
NAMES = {
    "reach": ("REACH", 300, 400),
    "alpha1": ("ALPHA1", 37.3, 60),
    "d3": ("D3", 40, 90),
    "beta_5": ("BETA5", 21, 30),
    "tool.xyz[2]": ("TOOLZ", 7, 50),
    "base.rpy[0]": ("ROLL", 10, 90),
}
"""By name: what stands for it in the file, its usual value, and another."""


def spec(values: Mapping[str, float]) -> RobotSpec:
    text = FILE
    for name, (mark, usual, _) in NAMES.items():
        text = text.replace(mark, repr(float(values.get(name, usual))))
    return parse_robot(text)


def tables(count: int, names: Sequence[str] = tuple(NAMES)) -> tuple[TableBatch, list[RobotSpec]]:
    random = np.random.default_rng(4)
    values = {name: random.uniform(*NAMES[name][1:], count) for name in names}
    specs = [spec({name: values[name][i] for name in names}) for i in range(count)]
    return TableBatch.from_robot(spec({}), values), specs


@pytest.mark.parametrize("names", [tuple(NAMES), ("d3",), ("reach", "beta_5")])
def test_poses_and_jacobians_are_those_of_the_textbook_product_of_each_table(names: tuple[str, ...]) -> None:
    batch, specs = tables(7, names)
    q = np.random.default_rng(1).uniform(-2, 2, (7, 3, batch.n))
    wanted = np.stack([table_tool_pose(spec, own) for spec, own in zip(specs, q, strict=True)])
    np.testing.assert_allclose(batch.fk(q), wanted, rtol=0, atol=5e-15)
    np.testing.assert_allclose(batch.fk(q[:, 1]), wanted[:, 1], rtol=0, atol=5e-15)
    np.testing.assert_allclose(batch.fk(q[2, 0])[2], wanted[2, 0], rtol=0, atol=5e-15)
    J = batch.jacobian(q)
    for own, spec, at in zip(J, specs, q, strict=True):
        np.testing.assert_allclose(own[0], central_differences(spec, at[0]), rtol=0, atol=1e-8)


def central_differences(spec: RobotSpec, q: Array, step: float = 1e-6) -> Array:
    """The Jacobian by differences of the table's own poses."""
    T = table_tool_pose(spec, q)
    columns = []
    for k in range(len(q)):
        away = np.zeros(len(q))
        away[k] = step
        rate = (table_tool_pose(spec, q + away) - table_tool_pose(spec, q - away)) / (2 * step)
        W = rate[:3, :3] @ T[:3, :3].T
        columns.append([*rate[:3, 3], W[2, 1], W[0, 2], W[1, 0]])
    return np.array(columns).T


def test_blocks_do_not_show() -> None:
    batch, specs = tables(3)
    q = np.random.default_rng(1).uniform(-2, 2, (3, 5000, batch.n))
    poses = batch.fk(q)
    for i in range(3):
        np.testing.assert_allclose(poses[i, 4990:], table_tool_pose(specs[i], q[i, 4990:]), rtol=0, atol=5e-15)


def test_tables_may_be_given_as_arrays() -> None:
    arm = Robot.load("puma560_standard")
    rows = arm.spec.rows
    a = np.array([[row.a for row in rows], [1.1 * row.a for row in rows]])
    shared = {cell: [getattr(row, cell) for row in rows] for cell in ("alpha", "d", "theta")}
    q = np.linspace(-1, 1, 6)
    longer = replace(arm.spec, rows=tuple(replace(row, a=1.1 * row.a) for row in rows))
    wanted = [table_tool_pose(spec, q) for spec in (arm.spec, longer)]
    pose = [np.linalg.inv(arm.chain.T_base_link_dh0) @ T @ np.linalg.inv(arm.chain.T_dhn_tool0) for T in wanted]
    np.testing.assert_allclose(TableBatch(a=a, **shared).fk(q), pose, rtol=0, atol=1e-14)


def test_what_does_not_fit_is_refused() -> None:
    batch, _ = tables(3)
    with pytest.raises(ConfigurationError, match=r"expected an array of shape \(5,\), \(3, 5\) or \(3, k, 5\)"):
        batch.fk(np.zeros((2, 5)))
    with pytest.raises(ConfigurationError, match="must be finite"):
        batch.fk([0, 0, np.nan, 0, 0])
    with pytest.raises(ConfigurationError, match=r"of one shape \(T, rows\)"):
        TableBatch(a=np.zeros((2, 3)), alpha=np.zeros((2, 4)), d=0, theta=0)
    with pytest.raises(ConfigurationError, match="'round' is not a valid JointType"):
        TableBatch(a=np.zeros((2, 3)), alpha=0, d=0, theta=0, types="round")
    with pytest.raises(RobotError, match=r"joint_1.link.mass: is not a number of the table"):
        TableBatch.from_robot(spec({}), {"joint_1.link.mass": [1.0]})
