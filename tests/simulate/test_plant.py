from __future__ import annotations

import mujoco
import numpy as np
import pytest

from dh2sim.errors import EngineError
from dh2sim.model.build import build_model
from dh2sim.robot.read import load_robot
from dh2sim.robot.row import ActuatorType, Convention, Limits, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.plant import Plant, compile_plant
from dh2sim.simulate.prepare import prepare
from tests.sample_robots import CONTINUOUS, FIXED, PRISMATIC, REVOLUTE, model
from tests.simulate import robots


def plant(name: str = "odd", *, controller: str = "tests.simulate.drivers:Wave", floating: bool = False) -> Plant:
    robot = model(name) if name != "arm" else robots.arm(ActuatorType.VELOCITY)
    job = prepare(
        robot, RolloutOptions(rollouts=1, steps=1, timestep=0.003, controller=controller, floating_base=floating)
    )
    return job.plant


@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
def test_joints_are_those_of_the_table_that_move(floating: bool) -> None:
    made = plant(floating=floating)
    assert made.joints == ("one", "two", "four", "five", "six")
    assert made.turns == (True, False, True, False, True)
    assert made.n == 5
    assert made.timestep == 0.003
    assert made.floating is floating
    assert made.model.nv == 5 + 6 * floating
    assert made.home.tolist() == [0.4, 0.2, -2.5, 0.3, 1.1]


@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
def test_limits_are_those_of_the_model_and_infinite_where_there_are_none(floating: bool) -> None:
    made, robot = plant(floating=floating), model("odd")
    for i, joint in enumerate(robot.moving_joints):
        wanted = joint.position_range or (-np.inf, np.inf)
        assert (made.lower[i], made.upper[i]) == wanted
        assert made.velocity[i] == joint.velocity
    assert (made.lower[2], made.upper[2]) == (-np.inf, np.inf)
    assert (made.lower[0], made.upper[0]) == (-2.0, 1.5)


@pytest.mark.parametrize(
    ("controller", "floating"),
    [("tests.simulate.drivers:Wave", False), ("tests.simulate.drivers:Wave", True), ("pd", True)],
)
def test_each_actuator_knows_its_joint_and_its_range(controller: str, floating: bool) -> None:
    made, robot = plant(controller=controller, floating=floating), model("odd")
    kind = "motor" if controller == "pd" else "position"
    assert made.actuators == tuple(f"{name}_{kind}" for name in made.joints)
    assert made.driven == (0, 1, 2, 3, 4)
    if kind == "position":
        assert np.array_equal(made.control_lower, made.lower)
        assert np.array_equal(made.control_upper, made.upper)
    else:
        efforts = [joint.effort for joint in robot.moving_joints]
        assert made.control_upper.tolist() == efforts
        assert (-made.control_lower).tolist() == efforts


def test_velocity_actuators_range_over_the_velocity_limits() -> None:
    made = plant("arm")
    assert made.actuators == ("joint_1_velocity", "joint_2_velocity")
    assert made.control_upper.tolist() == [3.0, 3.0]


def test_without_actuators_there_are_none() -> None:
    made = plant(controller="passive")
    assert (made.actuators, made.driven) == ((), ())
    assert made.control_lower.shape == (0,)


def test_actuators_of_some_joints_only_know_which() -> None:
    rows = tuple(
        Row(
            name=name,
            type=kind,
            convention=Convention.STANDARD,
            a=0.2,
            alpha=0.3,
            limits=Limits(),
            actuator=robots.actuator(driven),
        )
        for name, kind, driven in (
            ("base", REVOLUTE, "none"),
            ("spacer", FIXED, "position"),
            ("slide", PRISMATIC, "motor"),
            ("wheel", CONTINUOUS, "velocity"),
        )
    )
    robot = build_model(RobotSpec(name="some", rows=rows))
    job = prepare(robot, RolloutOptions(rollouts=1, steps=1, controller="random"))
    made = job.plant
    assert made.actuators == ("slide_motor", "wheel_velocity")
    assert made.driven == (1, 2)
    labels = {item.name: list(item.values) for item in job.layout.coordinates}
    assert labels["actuator_unit"] == ["N", "rad/s"]
    assert labels["joint_unit"] == ["rad", "m", "rad"]


def test_arrays_cannot_be_written() -> None:
    made = plant()
    for name in ("lower", "upper", "velocity", "kp", "kv", "home", "control_lower", "control_upper"):
        assert not getattr(made, name).flags.writeable


def test_gains_make_each_joint_a_critically_damped_oscillator_without_a_payload() -> None:
    made = plant(controller="pd")
    data = mujoco.MjData(made.model)
    data.qpos[:] = made.home
    mujoco.mj_forward(made.model, data)
    M = np.empty((made.model.nv, made.model.nv))
    mujoco.mj_fullM(made.model, data, M)
    inertia = np.diag(M)
    assert np.allclose(made.kp, inertia * 100.0**2, rtol=6e-3)
    assert np.allclose(made.kv, 2 * np.sqrt(made.kp * inertia), rtol=6e-3)
    assert (made.kp > 0.0).all()


def test_a_model_that_mujoco_refuses_is_an_error_in_one_line() -> None:
    job = prepare(model("odd"), RolloutOptions(rollouts=1, steps=1))
    with pytest.raises(EngineError) as caught:
        compile_plant(job.mjcf.replace('type="slide"', 'type="slid"', 1), model("odd"))
    assert str(caught.value).startswith("MuJoCo refuses the robot as it would be simulated: ")
    assert "slid" in str(caught.value)
    assert "\n" not in str(caught.value)


def contacts(of: mujoco.MjModel, q: np.ndarray) -> list[bytes]:
    """Every contact of a configuration to the last bit, in MuJoCo's order."""
    data = mujoco.MjData(of)
    data.qpos[of.nq - len(q) :] = q
    mujoco.mj_forward(of, data)
    fields = ("geom", "dist", "pos", "frame", "friction", "solref", "solimp", "includemargin", "dim")
    return [getattr(data.contact, field).tobytes() for field in fields]


@pytest.mark.parametrize(("name", "floating"), [("ur5e", True), ("so101", False), ("franka_panda", False)])
def test_links_touch_as_in_the_model_that_is_recorded(name: str, floating: bool) -> None:
    robot = build_model(load_robot(name))
    job = prepare(robot, RolloutOptions(rollouts=1, steps=1, floating_base=floating))
    text, simulated = mujoco.MjModel.from_xml_string(job.mjcf), job.plant.model
    assert job.plant.may_touch
    assert (simulated.npair > 0) == (name != "franka_panda")  # which has too many pairs to name
    poses = np.random.default_rng(7).uniform(-2.5, 2.5, (40, job.plant.n))
    found = [contacts(simulated, q) for q in poses]
    assert found == [contacts(text, q) for q in poses]
    assert sum(bool(each[0]) for each in found) > 10
