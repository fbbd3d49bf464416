from __future__ import annotations

import inspect
from functools import partial

import pytest

from dh2sim.errors import ControllerError
from dh2sim.robot.row import ActuatorType
from dh2sim.simulate.controllers.protocol import ClosedLoop, Follows, OpenLoop
from dh2sim.simulate.controllers.registry import BUILT_IN, choose, slower
from tests.refusals import refusal
from tests.simulate.controllers.samples import arm, make

NAMES = ["passive", "hold", "gravity-compensation", "pd", "computed-torque", "sine", "random", "replay"]
KNOWN = "passive, hold, gravity-compensation, pd, computed-torque, sine, random, replay"


refused = partial(refusal, ControllerError, choose)


@pytest.mark.parametrize(
    ("name", "actuation", "follows", "protocol"),
    [
        ("passive", ActuatorType.NONE, False, OpenLoop),
        ("hold", ActuatorType.POSITION, False, OpenLoop),
        ("gravity-compensation", ActuatorType.MOTOR, False, ClosedLoop),
        ("pd", ActuatorType.MOTOR, True, ClosedLoop),
        ("computed-torque", ActuatorType.MOTOR, True, ClosedLoop),
        ("sine", ActuatorType.POSITION, True, OpenLoop),
        ("random", None, False, OpenLoop),
    ],
)
def test_a_controller_says_how_it_drives(
    name: str, actuation: ActuatorType | None, follows: bool, protocol: type
) -> None:
    choice = choose(name)
    assert (choice.text, choice.name, choice.options, choice.digest) == (name, name, {}, "")
    assert choice.actuation is actuation
    assert choice.follows is follows
    controller, _ = make(name, arm())
    assert isinstance(controller, protocol)
    assert isinstance(controller, OpenLoop) is not isinstance(controller, ClosedLoop)
    assert isinstance(controller, Follows) is follows


def test_built_in_controllers_are_classes_as_users_write_them() -> None:
    for name, found in BUILT_IN.items():
        if name != "replay":
            parameters = list(inspect.signature(found).parameters.values())
            assert parameters[0].name == "batch"
            assert all(p.kind is p.KEYWORD_ONLY and p.default is not p.empty for p in parameters[1:])


@pytest.mark.parametrize(
    ("text", "canonical"),
    [
        ("pd:", "pd"),
        (" pd : kd = 4 , kp=3.50 ", "pd:kp=3.5,kd=4"),
        ("pd:gravity=off,kp=none", "pd:kp=none,gravity=false"),
        ("sine:fade=1e0", "sine:fade=1"),
    ],
)
def test_the_text_of_a_choice_does_not_depend_on_how_it_was_typed(text: str, canonical: str) -> None:
    choice = choose(text)
    assert choice.text == canonical
    assert choose(canonical) == choice


def test_options_reach_the_controller() -> None:
    assert choose("pd:kp=3,gravity=no").options == {"kp": 3.0, "gravity": False}
    plain, group = make("sine:fade=0.5", arm())
    quick, _ = make("sine", arm())
    assert isinstance(plain, OpenLoop)
    assert isinstance(quick, OpenLoop)
    assert (plain.controls(100, 1) != quick.controls(100, 1)).any()
    assert group.plant.n == 3


@pytest.mark.parametrize("text", ["sien", "sien:amplitude=3", "sien:amplitude"])
def test_an_unknown_name_is_reported_with_the_known_ones(text: str) -> None:
    what = "controller and no module" if text == "sien:amplitude" else "controller"
    assert refused(text) == (
        f"unknown {what} 'sien'. Did you mean 'sine'? Known controllers: {KNOWN}; your own is named MODULE:CLASS"
    )


@pytest.mark.parametrize("text", ["", ":", ":x"])
def test_no_name_is_an_unknown_one(text: str) -> None:
    assert refused(text) == (f"unknown controller ''. Known controllers: {KNOWN}; your own is named MODULE:CLASS")


@pytest.mark.parametrize(
    ("text", "gentler"),
    [
        ("computed-torque", "computed-torque:period=2"),
        ("computed-torque:amplitude=0.3,period=0.25", "computed-torque:period=0.5,amplitude=0.3"),
        ("pd:kp=10", "pd:kp=10,period=2"),
        ("sine", None),
        ("some.module:Own", None),
    ],
)
def test_a_slower_controller_has_twice_the_period_where_there_is_one(text: str, gentler: str | None) -> None:
    assert slower(text) == gentler
    if gentler is not None:
        assert choose(gentler).text == gentler
