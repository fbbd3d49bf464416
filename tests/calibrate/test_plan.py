"""Plans tell more than random configurations, by the covariance and by fits to simulated measurements."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from dh2sim import Fixed, Robot
from dh2sim.calibrate.calibration import calibrate_robot
from dh2sim.calibrate.measurements import Kind
from dh2sim.calibrate.plan import plan_measurements
from dh2sim.errors import CalibrationError
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.spec import RobotSpec
from tests.calibrate.measured import SIGMA, measured, numbers, off, random_q
from tests.refusals import refusal
from tests.sample_robots import model, robot, row


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "kind", "share"),
    [
        ("scara", "position", 0.62),
        ("puma560", "position", 0.55),
        ("franka_panda", "position", 0.4),
        ("ur5e", "distance", 0.4),
        ("puma560", "pose", 0.78),  # no twelve poses inside the limits have less than 0.757
        ("scara", "pose", 0.7),  # 0.680
    ],
)
def test_twelve_configurations_tell_the_tool_much_better_than_random_ones(name: str, kind: str, share: float) -> None:
    plan = plan_measurements(robot(name), 12, kind=kind)
    assert plan.q.shape == (12, len(robot(name).moving_rows))
    assert plan.error < share * plan.random_error
    assert ("beside it" in plan.note) is (kind != "pose")
    limits = np.array([row.limits.position for row in robot(name).moving_rows])
    assert ((plan.q >= limits[:, 0]) & (plan.q <= limits[:, 1])).all()
    again = plan_measurements(robot(name), 12, kind=kind)
    assert np.array_equal(plan.q, again.q)


@pytest.mark.slow
def test_a_plan_keeps_links_from_touching() -> None:
    plan = plan_measurements(robot("ur5e"), 12, kind="pose")
    assert plan.touching > 100
    assert plan.kind is Kind.POSE
    compiled = mujoco.MjModel.from_xml_string(to_mjcf(model("ur5e")))
    data = mujoco.MjData(compiled)
    for q in plan.q:
        data.qpos[:] = q
        mujoco.mj_forward(compiled, data)
        assert data.ncon == 0


@pytest.mark.slow
def test_what_a_plan_predicts_is_what_fits_show() -> None:
    """Errors of fits to simulated measurements at the plan and at random configurations, by the oracle."""
    nominal = robot("scara")
    nominal = replace(nominal, tool=replace(nominal.tool, xyz=numbers(0.05, 0.03, 0.1)), source_file=None)
    plan = plan_measurements(nominal, 12)
    assert plan.note == ""
    unseen = random_q(nominal, 100, 77)
    squares: dict[str, list[float]] = {"plan": [], "random": []}
    for k in range(12):
        true = off(nominal, 1e-3, k)
        for name, q in (("plan", plan.q), ("random", random_q(nominal, 12, 500 + k))):
            given = measured(nominal, true, "position", q, seed=k)
            found = calibrate_robot(nominal, given, noise=SIGMA, held_out=False).robot
            gap = (table_tool_pose(found, unseen) - table_tool_pose(true, unseen))[:, :3, 3]
            squares[name].append(float((gap**2).sum(axis=1).mean()))
    rms = {name: float(np.sqrt(np.median(values))) for name, values in squares.items()}
    assert 0.6 * plan.error < rms["plan"] / SIGMA < 1.5 * plan.error
    assert rms["plan"] < 0.85 * rms["random"]


def test_what_cannot_be_planned_is_refused() -> None:
    assert (
        "8 configurations give 24 equations, which cannot determine 27 parameters: at least 9 are needed"
        in refusal(CalibrationError, plan_measurements, robot("puma560"), 8)
    )
    assert refusal(CalibrationError, plan_measurements, robot("puma560"), 1001) == (
        "the number of configurations must be at most 1000, got 1001"
    )
    long = RobotSpec(name="long", rows=tuple(row(name=f"joint_{k}", a=0.1) for k in range(51)))
    assert refusal(CalibrationError, plan_measurements, long, 200) == (
        "51 joints move; configurations are chosen for at most 50"
    )
    assert "the ball has to be in one" in refusal(
        CalibrationError, plan_measurements, robot("puma560"), 20, kind="socket"
    )


def test_a_robot_of_fixed_rows_has_no_plan() -> None:
    with pytest.raises(CalibrationError, match="has no joint that moves"):
        plan_measurements(Robot([Fixed(a=0.5)], name="still"), 5)
