from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from dh2sim.formats.mjcf.scene import to_scene
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.model.actuators import ASSUMED_BANDWIDTH, ActuatorModel
from dh2sim.model.build import BASE_COLOR, JOINT_COLOR, PALETTE, build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.links import BaseSpec, LinkSpec
from dh2sim.robot.row import ActuatorSpec, ActuatorType, Dynamics, Row
from dh2sim.robot.spec import RobotSpec
from tests.arrays import arrays_in
from tests.sample_robots import NAMES, ODD_ROBOT, REVOLUTE, STANDARD, model

ROOT = Path(__file__).parents[2]


def texts(built: RobotModel) -> list[str]:
    return [to_urdf(built), to_mjcf(built), to_scene(built)]


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_the_same_robot_makes_the_same_model_twice(name: str) -> None:
    built = model(name)
    assert texts(build_model(built.spec)) == texts(built)


@pytest.mark.parametrize("seed", ["1", "2"])
def test_another_process_makes_the_same_model(seed: str) -> None:
    script = (
        "import sys; from tests.sample_robots import model; from tests.model.test_build import texts; "
        "sys.stdout.buffer.write(''.join(texts(model('odd'))).encode())"
    )
    environment = {**os.environ, "PYTHONHASHSEED": seed}
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, env=environment, capture_output=True, check=True)
    assert done.stdout.decode() == "".join(texts(model("odd")))


def test_nothing_of_a_model_can_be_changed() -> None:
    built = model("odd")
    found = list(arrays_in(built))
    assert len(found) > 50
    assert not any(array.flags.writeable for array in found)
    with pytest.raises(dataclasses.FrozenInstanceError):
        built.reach = 0.0  # type: ignore[misc]
    with pytest.raises(TypeError):
        built.spec.configurations["home"] = built.home  # type: ignore[index]


def test_the_mass_of_a_robot_is_that_of_its_links() -> None:
    built = model("odd")
    assert built.mass == sum(link.inertial.mass for link in built.links if link.inertial is not None)
    assert built.base.inertial is None


def test_colours_are_those_of_the_file_or_of_the_palette() -> None:
    red = (1.0, 0.0, 0.0, 0.5)
    rows = (
        Row(name="a", type=REVOLUTE, convention=STANDARD, a=0.3),
        Row(name="b", type=REVOLUTE, convention=STANDARD, a=0.3, link=LinkSpec(color=red)),
        Row(name="c", type=REVOLUTE, convention=STANDARD, a=0.3),
    )
    built = build_model(RobotSpec(name="coloured", rows=rows))
    assert [link.color for link in built.all_links] == [BASE_COLOR, PALETTE[0], red, PALETTE[0]]
    assert [link.joint_color for link in built.all_links] == [BASE_COLOR, *[JOINT_COLOR] * 3]
    built = build_model(RobotSpec(name="coloured", rows=rows, base=BaseSpec(color=red)))
    assert (built.base.color, built.base.joint_color) == (red, red)


def actuated(actuator: ActuatorSpec, armature: float = 0.0) -> tuple[ActuatorModel, float]:
    """The actuator of the first joint of two, and the inertia that it is chosen for, rotor included."""
    rows = (
        Row(
            name="a",
            type=REVOLUTE,
            convention=STANDARD,
            a=0.3,
            alpha=0.4,
            actuator=actuator,
            dynamics=Dynamics(armature=armature),
        ),
        Row(name="b", type=REVOLUTE, convention=STANDARD, a=0.5, d=0.2),
    )
    built = build_model(RobotSpec(name="driven", rows=rows))
    return built.joints[0].actuator, built.joints[0].duty.inertia + armature


@pytest.mark.parametrize("armature", [0.0, 3.0])
def test_assumed_position_gains_make_a_critically_damped_oscillator(armature: float) -> None:
    found, inertia = actuated(ActuatorSpec(type=ActuatorType.POSITION), armature)
    assert found.assumed
    assert found.kp == pytest.approx(inertia * ASSUMED_BANDWIDTH**2, rel=5e-3)
    assert found.kv == pytest.approx(2 * np.sqrt(found.kp * inertia), rel=5e-3)


def test_an_assumed_damping_gain_fits_a_given_position_gain() -> None:
    found, inertia = actuated(ActuatorSpec(type=ActuatorType.POSITION, kp=12345.0))
    assert found.assumed
    assert found.kp == 12345.0
    assert found.kv == pytest.approx(2 * np.sqrt(12345.0 * inertia), rel=5e-3)


def test_an_assumed_velocity_gain_answers_at_the_assumed_bandwidth() -> None:
    found, inertia = actuated(ActuatorSpec(type=ActuatorType.VELOCITY))
    assert found.assumed
    assert found.kp == 0.0
    assert found.kv == pytest.approx(inertia * ASSUMED_BANDWIDTH, rel=5e-3)


@pytest.mark.parametrize(
    ("actuator", "gains"),
    [
        (ActuatorSpec(type=ActuatorType.POSITION, kp=100.0, kv=7.5), (100.0, 7.5)),
        (ActuatorSpec(type=ActuatorType.POSITION, kp=1e-15, kv=1e-15), (1e-15, 1e-15)),
        (ActuatorSpec(type=ActuatorType.VELOCITY, kv=8.5), (0.0, 8.5)),
        (ActuatorSpec(type=ActuatorType.MOTOR), (0.0, 0.0)),
        (ActuatorSpec(type=ActuatorType.NONE), (0.0, 0.0)),
    ],
    ids=["position", "tiny", "velocity", "motor", "none"],
)
def test_given_gains_win_and_a_motor_has_none(actuator: ActuatorSpec, gains: tuple[float, float]) -> None:
    found, _ = actuated(actuator)
    assert found.type is actuator.type
    assert (found.kp, found.kv, found.assumed) == (*gains, False)


def test_a_model_keeps_its_robot_and_its_chain() -> None:
    built = model("odd")
    assert built.spec is ODD_ROBOT
    assert built.name == "odd"
    assert [link.name for link in built.all_links] == ["base_link", *(f"link_{i}" for i in range(1, 7))]
    assert [joint.name for joint in built.moving_joints] == ["one", "two", "four", "five", "six"]
