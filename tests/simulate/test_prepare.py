"""From a robot and options to a job."""

from __future__ import annotations

import hashlib
import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import dh2sim
from dh2sim.errors import SettingsError
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.row import ActuatorType
from dh2sim.simulate.block import Job
from dh2sim.simulate.options import RolloutOptions
from dh2sim.simulate.prepare import prepare
from tests.refusals import refusal
from tests.robot_files import write
from tests.sample_robots import ODD_ROBOT, model
from tests.simulate import robots


def job(robot: RobotModel | None = None, **how: Any) -> Job:
    return prepare(robot or model("stanford"), RolloutOptions(**{"rollouts": 3, "steps": 4, **how}))


refused = partial(refusal, SettingsError, job)


@pytest.mark.parametrize(
    ("controller", "kind"),
    [
        ("hold", ActuatorType.POSITION),
        ("sine", ActuatorType.POSITION),
        ("pd", ActuatorType.MOTOR),
        ("computed-torque", ActuatorType.MOTOR),
        ("gravity-compensation", ActuatorType.MOTOR),
        ("passive", ActuatorType.NONE),
        ("random", ActuatorType.VELOCITY),
    ],
)
def test_a_controller_gets_the_actuators_that_it_asks_for(controller: str, kind: ActuatorType) -> None:
    robot = robots.arm(ActuatorType.VELOCITY)
    actuators = ET.fromstring(job(robot, controller=controller).mjcf).find("actuator")
    tags = [] if actuators is None else [element.tag for element in actuators]
    assert tags == ([] if kind is ActuatorType.NONE else [kind.value] * 2)


def test_the_model_is_simulated_with_the_options() -> None:
    made = job(timestep=0.005, integrator="rk4", record=("energy",))
    compiled = mujoco.MjModel.from_xml_string(made.mjcf)
    assert compiled.opt.timestep == 0.005
    assert compiled.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
    assert compiled.opt.enableflags & mujoco.mjtEnableBit.mjENBL_ENERGY
    assert not mujoco.MjModel.from_xml_string(job().mjcf).opt.enableflags


@pytest.mark.parametrize("name", builtin_robots())
@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
def test_the_model_and_its_scene_need_no_other_file(name: str, floating: bool) -> None:
    made = job(model(name), floating_base=floating, controller="hold", start="random")
    attributes = made.layout.attributes
    assert attributes["mjcf"] == made.mjcf
    compiled = mujoco.MjModel.from_xml_string(
        attributes["scene"], assets={f"{attributes['robot']}.xml": made.mjcf.encode()}
    )
    assert compiled.nmesh == 0
    assert compiled.nv == mujoco.MjModel.from_xml_string(made.mjcf).nv
    assert compiled.nlight > 0


def test_attributes_tell_where_a_run_comes_from(tmp_path: Path) -> None:
    path = write(tmp_path, "name: small\nconvention: standard\njoints: [{type: revolute, a: 0.3}]\n")
    robot = build_model(dh2sim.load_robot(path))
    options = RolloutOptions(
        rollouts=3, steps=4, seed=2**70, randomize={"mass": 0.25}, controller="sine:amplitude=0.5"
    )
    attributes = prepare(robot, options, command="dh2sim rollout small.yaml").layout.attributes
    assert attributes["dh2sim_run"] == 1
    assert attributes["robot"] == "small"
    assert attributes["robot_file"] == path.read_text(encoding="utf-8")
    assert attributes["robot_file_sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert attributes["command"] == "dh2sim rollout small.yaml"
    assert attributes["seed"] == 2**70
    assert attributes["controller"] == "sine:amplitude=0.5"
    assert attributes["randomize"] == {"mass": 0.25}
    assert attributes["timestep"] == 0.002
    assert attributes["integrator"] == "implicitfast"
    versions = attributes["versions"]
    assert set(versions) == {"dh2sim", "mujoco", "mujoco_package", "numpy", "python"}
    assert versions["mujoco"] == version(versions["mujoco_package"]) == mujoco.__version__
    made = datetime.fromisoformat(attributes["created"])
    assert timedelta(0) <= datetime.now(UTC) - made < timedelta(minutes=1)
    assert json.loads(json.dumps(dict(attributes))) == attributes


def test_a_robot_that_was_not_read_from_a_file_has_no_text_of_one() -> None:
    attributes = job(model("odd")).layout.attributes
    assert (attributes["robot_file"], attributes["robot_file_sha256"]) == ("", "")


def test_settings_hold_everything_that_the_numbers_depend_on() -> None:
    made = job(every=2, start="random", record=("ctrl", "qpos"))
    settings = made.layout.attributes["settings"]
    robot = model("stanford")
    assert settings == {
        "rollouts": 3,
        "steps": 4,
        "timestep": 0.002,
        "integrator": "implicitfast",
        "every": 2,
        "seed": 0,
        "controller": "sine",
        "controller_digest": "",
        "start": "random",
        "start_digest": "",
        "home": robot.home.tolist(),
        "record": ["qpos", "ctrl"],
        "randomize": {},
        "floating_base": False,
        "velocity_limits": [joint.velocity for joint in robot.moving_joints],
        "kp": made.plant.kp.tolist(),
        "kv": made.plant.kv.tolist(),
    }


def test_what_does_not_fit_the_robot_is_reported_at_once() -> None:
    problems = refused(controller="sin", start="hme").splitlines()
    assert [problem[:24] for problem in problems] == [
        "unknown controller 'sin'",
        "start must be one of hom",
    ]


def test_a_robot_without_a_joint_that_moves_is_refused() -> None:
    still = replace(ODD_ROBOT, rows=(ODD_ROBOT.rows[2],), configurations={})
    assert refused(build_model(still)) == "odd has no joint that moves: there is nothing to simulate"


@pytest.mark.parametrize(
    ("how", "size"),
    [
        ({"timestep": 1e-9, "duration": 1.0, "steps": None}, "141.6"),
        ({"steps": 10**12}, "141,561.0"),
        ({"steps": 10**8, "record": ("contacts",)}, "1.9"),
    ],
)
def test_a_rollout_that_would_record_more_than_memory_holds_is_refused_before_it_takes_any(
    how: dict[str, Any], size: str
) -> None:
    assert refused(robots.arm(), **how) == (
        f"one rollout would record {size} GB, and at most 1 GB are possible; record fewer states (every) or fewer "
        "quantities (record)"
    )


def test_long_rollouts_may_be_recorded_now_and_then() -> None:
    made = job(robots.arm(), steps=10**9, every=10**6)
    assert made.layout.sizes["step"] == 1001


def test_the_same_options_make_the_same_run_but_for_its_date() -> None:
    one, other = job(start="random"), job(start="random")
    assert one.mjcf == other.mjcf
    assert one.options == other.options
    assert {**one.layout.attributes, "created": ""} == {**other.layout.attributes, "created": ""}


def test_initial_states_of_files_differ_by_their_digest(tmp_path: Path) -> None:
    path = tmp_path / "s.npy"
    digests = []
    for q in (0.1, 0.2):
        np.save(path, [q, 0.0])
        digests.append(job(robots.arm(), start=str(path)).initial.digest)
    assert digests[0] != digests[1]
