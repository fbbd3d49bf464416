from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from dh2sim.errors import SettingsError
from dh2sim.model.build import build_model
from dh2sim.robot.row import ActuatorSpec, ActuatorType
from dh2sim.simulate import rollout
from dh2sim.simulate.randomization import SCALES, Generators, Purpose, generator
from tests.sample_robots import model
from tests.simulate import plain, robots

ALL = {"mass": 0.3, "friction": 0.4, "damping": 0.5, "armature": 0.2, "gain": 0.1}
RECORD = ("qpos", "qvel", "ctrl", "tool_pose", "qacc", "torque", "energy", "contacts")


@pytest.mark.slow
@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
@pytest.mark.parametrize(
    ("controller", "what"),
    [
        *(("random", what) for what in (*SCALES, "all")),
        *(("tests.simulate.drivers:Spring", what) for what in (*SCALES, "all") if what != "gain"),
    ],
)
def test_each_rollout_moves_as_a_model_with_multiplied_fields(controller: str, what: str, floating: bool) -> None:
    wanted = ALL if what == "all" else {what: ALL[what]}
    if controller != "random":
        wanted = {name: share for name, share in wanted.items() if name != "gain"}  # motors have none
    run = rollout(
        robots.worm(),
        rollouts=3,
        steps=60,
        start="curled",
        controller=controller,
        randomize=wanted,
        record=RECORD,
        floating_base=floating,
    )
    if controller == "random":
        plain.assert_equal(run, plain.expected(run, plain.replayed(run)))
    else:
        plain.assert_equal(run, plain.expected(run, plain.spring))
    assert {str(name) for name in run.data_vars if str(name).endswith("_scale")} == {
        f"{name}_scale" for name in wanted
    }


def test_factors_are_spread_evenly_around_one() -> None:
    run = rollout(robots.worm(), rollouts=2000, steps=1, randomize=ALL, record="qpos")
    for name, share in ALL.items():
        factors = run[f"{name}_scale"].values
        assert np.abs(factors - 1.0).max() <= share
        assert factors.min() < 1.0 - 0.99 * share
        assert factors.max() > 1.0 + 0.99 * share
        assert abs(factors.mean() - 1.0) < 0.02 * share
        assert np.unique(factors).size == factors.size


def test_labels_say_what_a_factor_belongs_to() -> None:
    run = rollout(robots.worm(), rollouts=2, steps=1, randomize=ALL)
    assert run.mass_scale.dims == ("rollout", "link")
    assert run.link.values.tolist() == [f"link_{i}" for i in range(1, 6)]
    assert run.gain_scale.dims == ("rollout", "actuator")
    for name in ("friction", "damping", "armature"):
        assert run[f"{name}_scale"].dims == ("rollout", "joint")
    assert run.mass_scale.attrs == {"units": "1", "long_name": "factor of the mass"}
    assert run.attrs["randomize"] == ALL


def test_a_floating_base_has_a_factor_too() -> None:
    run = rollout(robots.worm(), rollouts=2, steps=1, randomize={"mass": 0.1}, floating_base=True)
    assert run.link.values.tolist() == ["base_link", *(f"link_{i}" for i in range(1, 6))]


def test_one_quantity_is_drawn_alike_whichever_others_are() -> None:
    whole = rollout(robots.worm(), rollouts=4, steps=1, randomize=ALL)
    for name, share in ALL.items():
        alone = rollout(robots.worm(), rollouts=4, steps=1, randomize={name: share})
        assert np.array_equal(alone[f"{name}_scale"].values, whole[f"{name}_scale"].values)


def test_starts_and_controllers_draw_alike_whether_models_are_random_or_not() -> None:
    how = {"rollouts": 4, "steps": 5, "start": "random", "controller": "random"}
    fixed = rollout(robots.worm(), **how)  # type: ignore[arg-type]
    loose = rollout(robots.worm(), randomize={"mass": 0.5}, **how)  # type: ignore[arg-type]
    assert np.array_equal(fixed.qpos.values[:, 0], loose.qpos.values[:, 0])
    assert np.array_equal(fixed.ctrl.values, loose.ctrl.values)
    assert not np.array_equal(fixed.qpos.values[:, -1], loose.qpos.values[:, -1])


def test_a_share_of_zero_changes_nothing() -> None:
    how = {"rollouts": 2, "steps": 30, "start": "curled", "record": "qpos,qvel,qacc"}
    fixed = rollout(robots.worm(), **how)  # type: ignore[arg-type]
    loose = rollout(robots.worm(), randomize={"mass": 0.0, "gain": 0.0}, **how)  # type: ignore[arg-type]
    assert np.all(loose.mass_scale.values == 1.0)
    for name in ("qpos", "qvel", "qacc"):
        assert np.array_equal(fixed[name].values, loose[name].values)


def test_a_motor_among_other_actuators_keeps_its_gain() -> None:
    spec = robots.arm().spec
    mixed = build_model(
        replace(spec, rows=(replace(spec.rows[0], actuator=ActuatorSpec(type=ActuatorType.MOTOR)), spec.rows[1]))
    )
    run = rollout(mixed, rollouts=3, steps=20, controller="random", randomize={"gain": 0.2}, record=RECORD)
    assert run.actuator.values.tolist() == ["joint_1_motor", "joint_2_position"]
    assert np.all(run.gain_scale.values[:, 0] == 1.0)
    assert np.all(run.gain_scale.values[:, 1] != 1.0)
    plain.assert_equal(run, plain.expected(run, plain.replayed(run)))


@pytest.mark.parametrize(
    ("controller", "wanted", "idle"),
    [
        ("sine", ["friction"], ["friction"]),
        ("pd", ["gain"], ["gain"]),
        ("passive", ["mass", "gain", "friction"], ["friction", "gain"]),
    ],
)
def test_what_the_robot_has_none_of_cannot_be_random(controller: str, wanted: list[str], idle: list[str]) -> None:
    with pytest.raises(SettingsError) as caught:
        rollout(robots.arm(), rollouts=2, steps=2, controller=controller, randomize=dict.fromkeys(wanted, 0.1))
    assert sorted(str(caught.value).splitlines()) == [
        f"randomize must not contain '{name}': the robot as simulated has no {name} to multiply" for name in idle
    ]


def test_the_model_in_the_attributes_is_the_one_that_is_multiplied() -> None:
    run = rollout(model("stanford"), rollouts=1, steps=1, randomize={"mass": 0.5})
    still = rollout(model("stanford"), rollouts=1, steps=1)
    assert run.attrs["mjcf"] == still.attrs["mjcf"]
    assert mujoco.MjModel.from_xml_string(run.attrs["mjcf"]).body_mass.sum() > 0.0


@pytest.mark.parametrize("seed", [0, 7, 2**200 + 1])
@pytest.mark.parametrize("purpose", list(Purpose))
def test_a_generator_is_a_child_of_a_child_of_the_seed(seed: int, purpose: Purpose) -> None:
    children = np.random.SeedSequence(seed).spawn(5)
    for i, child in enumerate(children):
        expected = np.random.Generator(np.random.PCG64(child.spawn(len(Purpose))[purpose]))
        assert np.array_equal(generator(seed, i, purpose).random(10), expected.random(10))


def test_the_numbers_are_the_same_for_ever() -> None:
    # another number here means that every run that anybody made comes out otherwise
    assert generator(0, 0, Purpose.START).random(2).tolist() == [0.5651317655614634, 0.935433136976671]
    assert generator(1, 1000, Purpose.CONTROLLER).random(2).tolist() == [0.6954435642740793, 0.12866006363096616]


def test_generators_are_a_sequence_of_those_of_the_rollouts() -> None:
    sources = Generators(3, range(4, 9), Purpose.RANDOMIZE)
    assert len(sources) == 5
    assert [source.random() for source in sources] == [
        generator(3, i, Purpose.RANDOMIZE).random() for i in range(4, 9)
    ]
    assert sources[-1] is sources[4]
    assert sources[1:3] == [sources[1], sources[2]]
    with pytest.raises(IndexError):
        sources[5]


def test_a_generator_is_one_and_the_same_whenever_it_is_asked_for() -> None:
    sources = Generators(3, range(2), Purpose.START)
    first = sources[0].random()
    assert sources[0].random() != first


def test_a_controller_draws_from_its_rollouts_own_numbers() -> None:
    run = rollout(robots.arm(), rollouts=4, steps=2, seed=8, controller="tests.simulate.drivers:Drawn")
    for i in range(4):
        expected = generator(8, i, Purpose.CONTROLLER).random(2)
        assert np.array_equal(run.ctrl.values[i], [expected, expected])
