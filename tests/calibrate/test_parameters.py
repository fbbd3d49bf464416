"""Derivatives of the tool's pose, and of everything measured, against differences of the oracle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.calibrate.measurements import Measurements
from dh2sim.calibrate.observations import Observations, State
from dh2sim.calibrate.parameters import Parameter, RobotParameters
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.calibrate.measured import measured, off, random_q
from tests.sample_robots import ODD_ROBOT, robot
from tests.strategies import robot_specs

STEP = 1e-6


def about(axis: int, angle: float) -> Array:
    c, s, R = np.cos(angle), np.sin(angle), np.eye(3)
    i, k = (axis + 1) % 3, (axis + 2) % 3
    R[i, i] = R[k, k] = c
    R[k, i], R[i, k] = s, -s
    return R


def moved(T: Array, part: int, by: float) -> Array:
    """A pose moved along, or turned about, an axis of the frame that it is in."""
    new = T.copy()
    if part < 3:
        new[part, 3] += by
    else:
        new[:3, :3] = about(part - 3, by) @ T[:3, :3]
    return new


def oracle(spec: RobotSpec, parameter: Parameter, by: float, q: Array) -> Array:
    """Poses of the tool with one number changed."""
    if parameter.row >= 0:
        key = str(parameter.group)
        row = spec.rows[parameter.row]
        rows = list(spec.rows)
        rows[parameter.row] = replace(row, **{key: getattr(row, key) + by})
        return table_tool_pose(replace(spec, rows=tuple(rows), source_file=None), q)
    T = table_tool_pose(spec, q)
    start = RobotParameters(spec).start
    if parameter.group == "base":
        return np.asarray(moved(start.base, parameter.part, by) @ np.linalg.inv(start.base) @ T)
    return np.asarray(T @ np.linalg.inv(start.tool) @ moved(start.tool, parameter.part, by))


def require_derivatives(spec: RobotSpec) -> None:
    parameters = RobotParameters(spec)
    q = random_q(spec, 3, 0)
    R, p, J = parameters.jacobian(parameters.start, q)
    T = table_tool_pose(spec, q)
    scale = 1.0 + float(np.abs(T[:, :3, 3]).max()) + sum(abs(row.a) + abs(row.d) for row in spec.rows)
    assert np.abs(R - T[:, :3, :3]).max() < 1e-13 * (10 + len(spec.rows))
    assert np.abs(p - T[:, :3, 3]).max() < 1e-13 * scale * (10 + len(spec.rows))
    for column, parameter in enumerate(parameters.parameters):
        above, below = (oracle(spec, parameter, sign * STEP, q) for sign in (1.0, -1.0))
        dT = (above - below) / (2.0 * STEP)
        W = dT[:, :3, :3] @ T[:, :3, :3].transpose(0, 2, 1)
        turn = np.stack([W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]], axis=1)
        assert np.abs(J[:, :3, column] - dT[:, :3, 3]).max() < 2e-9 * scale, parameter.name
        assert np.abs(J[:, 3:, column] - turn).max() < 2e-9, parameter.name


@pytest.mark.parametrize("name", ["puma560", "stanford", "franka_panda", "odd"])
def test_twists_are_the_derivatives_of_the_oracles_poses(name: str) -> None:
    spec = ODD_ROBOT if name == "odd" else off(robot(name), 0.01, 0)
    require_derivatives(spec)


@settings(max_examples=10)
@given(robot_specs(max_rows=4))
def test_twists_are_right_for_any_table(spec: RobotSpec) -> None:
    require_derivatives(spec)


def some_measurements(kind: str) -> tuple[RobotSpec, Measurements]:
    spec = robot("stanford")
    true = off(spec, 0.02, 1)
    q = random_q(spec, 6, 2)
    given = measured(spec, true, "distance" if kind in ("distance", "pairs") else "pose", q, seed=3)
    names = ("a", "b", "a", "b", "a", "b")
    match kind:
        case "stations":
            given = replace(given, station=names)
        case "distance":
            given = replace(given, station=names)
        case "pairs":
            given = replace(given, station=None, pair=("1", "2", "3", "1", "2", "3"), distance=np.full(6, 0.7))
        case "sockets":
            given = replace(
                given,
                kind=type(given.kind)("socket"),
                rotation=None,
                position=None,
                socket=names,
                distance=np.full(6, 0.05),
            )
    return spec, given


@pytest.mark.parametrize("kind", ["pose", "stations", "distance", "pairs", "sockets"])
def test_equations_follow_every_unknown_as_their_derivatives_say(kind: str) -> None:
    spec, given = some_measurements(kind)
    observations = Observations(RobotParameters(off(spec, 0.0, 0)), given)
    rng = np.random.default_rng(5)
    start = observations.start(observations.robot.start)
    state = observations.moved(
        State(
            values=start.values, stations=start.stations, points=start.points + rng.normal(size=start.points.shape)
        ),
        0.1 * rng.normal(size=len(observations.unknowns)),
    )
    equations = observations.equations(state)
    for column, parameter in enumerate(observations.unknowns):
        step = np.zeros(len(observations.unknowns))
        step[column] = STEP
        above, below = (observations.equations(observations.moved(state, sign * step)).e for sign in (1.0, -1.0))
        assert np.abs(equations.J[:, column] + (above - below) / (2.0 * STEP)).max() < 1e-7, parameter.name
