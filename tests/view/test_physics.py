"""The robot moves as mechanics says, a little at a time, and stops with a reason when it cannot go on."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.forward import forward_kinematics, geometric_jacobian, joint_poses
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import with_actuators
from dh2sim.robot.links import LinkSpec
from dh2sim.robot.read import parse_robot
from dh2sim.robot.row import ActuatorType, Convention, Dynamics, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from dh2sim.validate.motion.free_motion import frictionless, without_contacts
from dh2sim.validate.motion.mechanics import energy
from dh2sim.view.motion.applied_force import LinkPoint, drag_spring, find_point
from dh2sim.view.motion.physics import STEPS_PER_CLOCK_READING, Drive, Physics
from dh2sim.view.scene.ground import ground_of
from tests.sample_robots import model as robot

PATIENT = 600.0
"""s: more than any simulation here takes, so that time never runs out."""


@cache
def pendulum() -> RobotModel:
    """A ball of 2 kg at the end of a rod of 0.5 m, swinging in the plane y = 0; q = 0 is level."""
    ball = LinkSpec(mass=2.0, com=read_only([0.0, 0.0, 0.0]), inertia=read_only(1e-3 * np.eye(3)))
    row = Row(name="swing", type=JointType.CONTINUOUS, convention=Convention.STANDARD, a=0.5, link=ball)
    return build_model(RobotSpec(name="pendulum", rows=(row,), gravity=read_only([0.0, -9.81, 0.0])))


@cache
def slider() -> RobotModel:
    """A block of 3 kg that slides along z."""
    block = LinkSpec(mass=3.0, com=read_only([0.0, 0.0, 0.0]), inertia=read_only(1e-2 * np.eye(3)))
    row = Row(name="lift", type=JointType.PRISMATIC, convention=Convention.STANDARD, link=block)
    return build_model(RobotSpec(name="slider", rows=(row,)))


@dataclass(frozen=True)
class ConstantForce:
    """A force that does not depend on where its point is, unlike a spring's: what it does is known exactly."""

    place: LinkPoint
    force: Array

    def force_at(self, point: Array, velocity: Array) -> Array:  # noqa: ARG002
        return self.force


def apply_force(physics: Physics, link: str, point: ArrayLike, force: ArrayLike) -> None:
    """Apply a constant force, N, along base_link's axes to a point in a link's frame until ``release``."""
    place = find_point(physics._bodies, link, point)
    physics._force = ConstantForce(place, read_only(force))  # type: ignore[assignment]


def simulated(physics: Physics, duration: float) -> None:
    assert physics.advance(duration, time_budget_s=PATIENT) == pytest.approx(duration)


@pytest.mark.parametrize("gravity", [True, False])
@pytest.mark.parametrize("name", ["stanford", "puma560", "scara", "planar_2r"])
def test_a_driven_robot_stays_where_it_starts(name: str, gravity: bool) -> None:
    model = robot(name)
    physics = Physics(model, model.home, gravity=gravity)
    simulated(physics, 1.0)
    assert np.abs(physics.q - model.home).max() <= 1e-6
    assert np.abs(physics.qvel).max() <= 1e-6
    assert physics.time == pytest.approx(1.0)


def test_driven_joints_go_to_their_targets_and_stay() -> None:
    model = robot("stanford")
    physics, target = Physics(model, model.home), model.home + 0.1
    physics.set_targets(target)
    simulated(physics, 3.0)
    assert physics.q == pytest.approx(target, abs=1e-4)


def test_a_robot_with_motors_is_held_too() -> None:
    model = with_actuators(robot("stanford"), ActuatorType.MOTOR)
    physics = Physics(model, model.home)
    simulated(physics, 1.0)
    assert physics.q == pytest.approx(model.home, abs=1e-6)


def test_free_joints_fall_and_are_caught_when_they_are_driven_again() -> None:
    model = robot("puma560")
    physics = Physics(model, model.home, drive="free")
    simulated(physics, 0.3)
    assert np.abs(physics.q - model.home).max() > 0.05
    physics.set_drive("position")
    simulated(physics, 3.0)
    assert physics.q == pytest.approx(model.home, abs=1e-3)


def test_without_gravity_a_free_robot_floats_and_falls_when_it_comes_back() -> None:
    model = robot("puma560")
    physics = Physics(model, model.home, gravity=False, drive="free")
    simulated(physics, 0.5)
    assert physics.q == pytest.approx(model.home, abs=1e-12)
    assert physics.energy == pytest.approx((0.0, 0.0), abs=1e-12)
    physics.set_gravity(True)
    simulated(physics, 0.5)
    assert np.abs(physics.q - model.home).max() > 0.05


def test_a_pendulum_swings_with_the_period_that_the_books_give() -> None:
    physics = Physics(pendulum(), [-math.pi / 2 + 0.05], drive="free")
    inertia = 1e-3 + 2.0 * 0.5**2
    period = 2.0 * math.pi * math.sqrt(inertia / (2.0 * 9.81 * 0.5)) * (1.0 + 0.05**2 / 16.0)
    below, crossings = False, []
    for _ in range(3000):
        physics.step()
        now = bool(physics.q[0] < -math.pi / 2)
        if now and not below:
            crossings.append(physics.time)
        below = now
    assert np.diff(crossings).mean() == pytest.approx(period, abs=0.002)


def test_the_energy_is_that_of_the_table_and_its_masses() -> None:
    model = robot("stanford")
    physics = Physics(model, model.home, drive="free")
    for _ in range(5):
        simulated(physics, 0.05)
        potential, kinetic = energy(model, physics.q[None, :], physics.qvel[None, :])
        assert physics.energy == pytest.approx((potential[0], kinetic[0]), rel=1e-9)
    assert physics.energy[1] > 0.1


def test_a_free_robot_without_friction_keeps_its_energy() -> None:
    model = without_contacts(frictionless(robot("planar_2r")))
    physics = Physics(model, model.home, drive="free")
    apply_force(physics, model.links[-1].name, [0.0, 0.0, 0.0], [3.0, 20.0, 0.0])
    simulated(physics, 0.3)
    physics.release()
    before = sum(physics.energy)
    simulated(physics, 0.5)
    assert before > 0.1
    assert sum(physics.energy) == pytest.approx(before, rel=5e-3)


def test_only_whole_time_steps_are_simulated() -> None:
    model = robot("planar_2r")
    physics = Physics(model, model.home)
    step = physics.timestep
    assert physics.advance(0.5 * step) == 0.0
    assert physics.advance(3 * step) == pytest.approx(3 * step)
    assert physics.advance(3.7 * step) == pytest.approx(3 * step)
    assert physics.advance(-1.0) == 0.0
    assert physics.time == pytest.approx(6 * step)


def test_the_time_budget_is_kept() -> None:
    model = robot("planar_2r")
    physics = Physics(model, model.home)
    assert physics.advance(1000.0, time_budget_s=0.0) == pytest.approx(STEPS_PER_CLOCK_READING * physics.timestep)


def test_steps_are_the_same_one_by_one_and_together() -> None:
    model = robot("puma560")
    one, many = (Physics(model, model.home, drive="free") for _ in range(2))
    for _ in range(100):
        one.step()
    simulated(many, 100 * many.timestep)
    assert np.array_equal(one.q, many.q)


def test_a_reset_puts_the_robot_at_rest_without_forces() -> None:
    model = robot("puma560")
    physics = Physics(model, model.home, drive="free")
    apply_force(physics, model.links[-1].name, [0.0, 0.0, 0.0], [10.0, 0.0, 0.0])
    simulated(physics, 0.5)
    physics.set_drive("position")
    q = model.home + 0.1
    physics.reset(q)
    assert np.array_equal(physics.q, q)
    assert not physics.qvel.any()
    assert (physics.time, physics.applied_force) == (0.0, None)
    simulated(physics, 1.0)
    assert physics.q == pytest.approx(q, abs=1e-6)


def test_a_robot_yields_to_a_force_as_its_jacobian_and_stiffness_predict() -> None:
    model = robot("stanford")
    physics = Physics(model, model.home, gravity=False)
    T = forward_kinematics(model.chain, model.home)
    point = np.linalg.inv(joint_poses(model.chain, model.home)[-1]) @ T[:, 3]
    force = np.array([3.0, -4.0, 5.0])
    apply_force(physics, model.links[-1].name, point[:3], force)
    simulated(physics, 5.0)
    torque = geometric_jacobian(model.chain, physics.q)[:3].T @ force
    stiffness = np.array([joint.actuator.kp for joint in with_actuators(model, ActuatorType.POSITION).moving_joints])
    assert stiffness * (physics.q - model.home) == pytest.approx(torque, abs=2e-3 * np.abs(torque).max())
    where, shown = physics.applied_force or (None, None)
    assert where == pytest.approx(forward_kinematics(model.chain, physics.q)[:3, 3], abs=1e-9)
    assert shown is not None
    assert np.array_equal(shown, force)
    physics.release()
    simulated(physics, 5.0)
    assert physics.applied_force is None
    assert physics.q == pytest.approx(model.home, abs=1e-4)


@pytest.mark.slow
def test_a_force_keeps_its_direction_while_the_link_turns() -> None:
    physics = Physics(pendulum(), [0.0], gravity=False, drive="free")
    apply_force(physics, "link_1", [0.5, 0.0, 0.0], [0.0, 4.0, 0.0])
    # the force is to this pendulum what its weight is to one that hangs: it swings about pi/2
    work = []
    for _ in range(500):
        physics.step()
        q, rate = float(physics.q[0]), float(physics.qvel[0])
        work.append((4.0 * 0.5 * math.sin(q), 0.5 * (1e-3 + 2.0 * 0.25) * rate**2))
    done, kinetic = np.array(work).T
    assert np.abs(done - kinetic).max() <= 0.02 * done.max()
    assert done.max() > 1.9


@pytest.mark.parametrize("name", ["planar_2r", "puma560"])
def test_a_dragged_point_comes_to_where_it_is_dragged(name: str) -> None:
    model = robot(name)
    physics = Physics(model, model.home, gravity=False, drive="free")
    target = forward_kinematics(model.chain, model.home + 0.15)[:3, 3]
    T_link_tool = np.linalg.inv(joint_poses(model.chain, model.home)[-1]) @ forward_kinematics(
        model.chain, model.home
    )
    physics.drag(model.links[-1].name, T_link_tool[:3, 3], target)
    pulled = physics.applied_force
    assert pulled is not None
    assert float(pulled[1] @ (target - pulled[0])) > 0.0
    simulated(physics, 20.0)
    assert not physics.stopped
    assert forward_kinematics(model.chain, physics.q)[:3, 3] == pytest.approx(target, abs=2e-3 * model.reach)


def test_a_drag_pulls_as_hard_as_the_point_is_heavy() -> None:
    physics = Physics(slider(), [0.0], gravity=False, drive="free")
    # it gives way in one of three directions, and so seems three times as heavy; but it is never more than it weighs
    physics.drag("link_1", [0.0, 0.0, 0.0], [0.0, 0.0, 0.1])
    assert physics.applied_force is not None
    assert physics.applied_force[1] == pytest.approx([0.0, 0.0, 0.1 * drag_spring(3.0).stiffness])
    arm = robot("puma560")
    light = Physics(arm, arm.home, gravity=False)
    point, far = [0.0, 0.0, 0.0], [1.0, 1.0, 1.0]
    strengths = []
    for link in ("base_link", arm.links[1].name, arm.links[-1].name):
        light.drag(link, point, far)
        assert light.applied_force is not None
        strengths.append(float(np.linalg.norm(light.applied_force[1])))
    assert strengths[0] >= strengths[1] > strengths[2] > 0.0


def test_the_base_cannot_be_dragged_away() -> None:
    model = robot("puma560")
    physics = Physics(model, model.home)
    physics.drag("base_link", [0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    simulated(physics, 0.5)
    assert physics.q == pytest.approx(model.home, abs=1e-6)


@pytest.mark.parametrize(
    ("model", "lever", "force", "message"),
    [
        (
            pendulum(),
            0.5,
            [0.0, 1e9, 0.0],
            r"The simulation became unstable at 0\.002 s: swing moves at [\d.e+]+ rad/s; the limit is 500 rad/s\.",
        ),
        (
            slider(),
            0.5,
            [0.0, 0.0, 1e9],
            r"The simulation became unstable at 0\.002 s: lift moves at [\d.e+]+ m/s; the limit is 500 m/s\.",
        ),
        (
            pendulum(),
            1e3,
            [0.0, 1e308, 0.0],
            r"The simulation became unstable at 0\.002 s: swing has no finite speed; the limit is 500 rad/s\.",
        ),
    ],
    ids=["turns", "slides", "not finite"],
)
def test_an_unstable_simulation_stops_with_a_reason_and_a_reset_starts_it_again(
    model: RobotModel,
    lever: float,
    force: list[float],
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    physics = Physics(model, [0.1], drive="free", gravity=False)
    apply_force(physics, "link_1", [lever, 0.0, 0.0], force)
    assert physics.advance(1.0, time_budget_s=PATIENT) == 0.0
    assert re.fullmatch(message, physics.stopped), physics.stopped
    assert physics.q == pytest.approx([0.1]), "the last good state"
    physics.release()
    assert physics.advance(1.0, time_budget_s=PATIENT) == 0.0
    physics.step()
    physics.reset([0.2])
    assert physics.stopped == ""
    simulated(physics, 0.1)
    assert physics.q == pytest.approx([0.2])
    assert not list(tmp_path.iterdir())
    assert capfd.readouterr() == ("", "")


def test_what_was_good_before_an_instability_counts_as_simulated() -> None:
    physics = Physics(pendulum(), [0.0], drive="free", gravity=False)
    apply_force(physics, "link_1", [0.5, 0.0, 0.0], [0.0, 2.4e5, 0.0])
    done = physics.advance(1.0, time_budget_s=PATIENT)
    assert 0.0 < done < 1.0
    assert physics.stopped.startswith(f"The simulation became unstable at {done + physics.timestep:.3f} s: swing")
    assert np.isfinite(physics.q).all()


def test_a_robot_without_moving_joints_can_be_simulated() -> None:
    row = Row(name="j", type=JointType.FIXED, convention=Convention.STANDARD, a=0.5)
    physics = Physics(build_model(RobotSpec(name="stick", rows=(row,))), [])
    physics.drag("link_1", [0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    simulated(physics, 0.1)
    assert physics.q.shape == (0,)
    assert physics.stopped == ""


def test_dry_friction_and_damping_of_the_file_act_on_free_joints() -> None:
    spec = pendulum().spec
    [row] = spec.rows
    held = Row(
        name=row.name,
        type=row.type,
        convention=row.convention,
        a=row.a,
        link=row.link,
        dynamics=Dynamics(friction=30.0),
    )
    model = build_model(RobotSpec(name="held", rows=(held,), gravity=spec.gravity))
    physics = Physics(model, [0.0], drive="free")
    simulated(physics, 0.5)
    assert physics.q == pytest.approx([0.0], abs=0.05), "the weight's 9.81 N·m do not overcome 30 N·m"


@pytest.mark.parametrize(
    ("link", "point", "target", "message"),
    [
        (
            "link_9",
            [0.0] * 3,
            [0.0] * 3,
            "unknown link 'link_9'. Did you mean 'link_1'? Links: base_link, link_1",
        ),
        ("link_1", [0.0, math.nan, 0.0], [0.0] * 3, "the point must be three finite numbers, got [0.0, nan, 0.0]"),
        ("link_1", [0.0] * 3, [1.0, 2.0], "the target must be three finite numbers, got [1.0, 2.0]"),
        ("link_1", [0.0] * 3, [math.inf, 0.0, 0.0], "the target must be three finite numbers, got [inf, 0.0, 0.0]"),
    ],
    ids=["link", "point", "target", "finite target"],
)
def test_dragging_an_unknown_link_or_point_or_to_no_point_is_refused(
    link: str, point: list[float], target: list[float], message: str
) -> None:
    physics = Physics(pendulum(), [0.0])
    with pytest.raises(ConfigurationError, match=f"^{re.escape(message)}$"):
        physics.drag(link, point, target)
    assert physics.applied_force is None


def test_an_invalid_joint_vector_is_refused_and_changes_nothing() -> None:
    physics = Physics(pendulum(), [0.3])
    with pytest.raises(ConfigurationError, match=r"^coordinate of swing is nan: it must be finite$"):
        physics.reset([math.nan])
    with pytest.raises(ConfigurationError, match=r"^expected one joint vector of shape \(1,\), got shape \(2, 1\)$"):
        physics.set_targets([[0.0], [1.0]])
    simulated(physics, 0.5)
    assert physics.q == pytest.approx([0.3], abs=1e-6)


def test_an_unknown_drive_is_refused() -> None:
    drive: Drive = "fast"  # type: ignore[assignment]
    with pytest.raises(ValueError, match=r"^drive must be 'position' or 'free', got 'fast'$"):
        Physics(pendulum(), [0.0], drive=drive)


@cache
def falling() -> RobotModel:
    """A rod of 0.5 m that turns about y, 0.3 m above the floor; at home it is upright."""
    text = (
        "name: falling\nconvention: standard\nunits: {angle: deg}\nbase: {xyz: [0, 0, 0.3], rpy: [-90, 0, 0]}\n"
        "joints:\n"
        "  - {type: revolute, a: 0.5, limits: {position: [-360, 360]}, dynamics: {damping: 0.2}}\n"
        "configurations: {home: [-90], zero: [-45]}\n"
    )
    return build_model(parse_robot(text))


def lowest(model: RobotModel, q: Array) -> float:
    """The lowest point of link 1, m: of its capsules and cylinders, out of their axes."""
    T = joint_poses(model.chain, q)[0]
    ends = [T[:3, :3] @ end + T[:3, 3] for shape in model.links[0].shapes for end in shape.ends]
    return float(min(end[2] for end in ends))


def test_a_link_that_falls_is_stopped_by_the_floor_of_the_scene() -> None:
    model = falling()
    physics = Physics(model, [-math.pi / 2 + 0.2], drive="free")
    simulated(physics, 4.0)
    height = ground_of(model).height
    assert lowest(model, physics.q) > height - 0.01
    assert np.abs(physics.qvel).max() < 0.05, "it lies there"
    assert physics.q[0] < math.pi / 2 - 0.3, "without the floor it would hang"


def test_a_link_that_starts_in_the_floor_is_not_thrown_out_of_it() -> None:
    model = falling()
    physics = Physics(model, [math.pi / 2], drive="free")
    simulated(physics, 0.5)
    assert physics.q == pytest.approx([math.pi / 2], abs=1e-6), "it hangs through the floor"
