"""The description of a run: what it may contain, and how mistakes are reported."""

from __future__ import annotations

import inspect
import json
import re
from dataclasses import fields
from typing import Any, get_type_hints

import numpy as np
import pytest

from dh2sim.errors import SettingsError
from dh2sim.simulate.options import RECORDABLE, RolloutKeywords, RolloutOptions
from dh2sim.simulate.quantities import QUANTITIES as RANDOMIZABLE
from tests.refusals import refusal

QUANTITIES = ", ".join(RANDOMIZABLE)
INTEGRATORS = "Euler, RK4, implicit, implicitfast"


def problems(**how: Any) -> list[str]:
    return refusal(SettingsError, RolloutOptions, **how).splitlines()


@pytest.mark.parametrize(
    ("how", "steps"),
    [
        ({}, 1000),
        ({"steps": None, "duration": None}, 1000),
        ({"duration": 0.5}, 250),
        ({"steps": 7}, 7),
        ({"steps": 10**12}, 10**12),
        ({"duration": 60.0, "timestep": 0.001}, 60_000),
        ({"duration": 0.3, "timestep": 0.1}, 3),
        ({"duration": 1.0, "timestep": 1e-9}, 10**9),
        ({"timestep": 1.0}, 2),
    ],
)
def test_steps_are_as_many_as_the_duration_takes(how: dict[str, Any], steps: int) -> None:
    assert RolloutOptions(**how).steps == steps


@pytest.mark.parametrize(
    ("how", "problem"),
    [
        ({"rollouts": 0}, "rollouts must be at least 1, got 0"),
        (
            {"rollouts": 10**12},
            "rollouts must be at most 10,000,000, got 1000000000000; make several runs with other seeds",
        ),
        ({"rollouts": "5"}, "rollouts must be a whole number, got '5'"),
        ({"every": 0}, "every must be at least 1, got 0"),
        ({"every": -2}, "every must be at least 1, got -2"),
        ({"every": 3}, "every must divide the 1000 steps of a rollout, got 3"),
        ({"every": 10**30}, f"every must divide the 1000 steps of a rollout, got {10**30}"),
        ({"seed": -1}, "seed must be at least 0, got -1"),
        ({"steps": 0}, "steps must be at least 1, got 0"),
        ({"steps": -3}, "steps must be at least 1, got -3"),
        ({"steps": 10**30}, f"steps must be at most 1,000,000,000,000, got {10**30}"),
        ({"steps": 5, "duration": 1.0}, "duration must not be given together with steps"),
        ({"duration": 0.0}, "duration must be a finite time above 0 s, got 0.0"),
        ({"duration": float("nan")}, "duration must be a finite time above 0 s, got nan"),
        ({"duration": float("inf")}, "duration must be a finite time above 0 s, got inf"),
        ({"duration": 1e300}, "duration must be at most 1,000,000,000,000 time steps of 0.002 s, got 1e+300"),
        (
            {"duration": 0.0051},
            "duration must be a whole number of time steps of 0.002 s, got 0.0051; 0.006 s is 3 steps",
        ),
        (
            {"duration": 0.0001},
            "duration must be a whole number of time steps of 0.002 s, got 0.0001; 0.002 s is 1 step",
        ),
        ({"timestep": 0.0}, "timestep must be above 0 s and at most 1 s, got 0.0"),
        ({"timestep": -0.1}, "timestep must be above 0 s and at most 1 s, got -0.1"),
        ({"timestep": 1.5}, "timestep must be above 0 s and at most 1 s, got 1.5"),
        ({"timestep": float("nan")}, "timestep must be above 0 s and at most 1 s, got nan"),
        ({"timestep": "2 ms"}, "timestep must be a number, got '2 ms'"),
        ({"integrator": "rk5"}, f"integrator must be one of {INTEGRATORS}, got 'rk5'. Did you mean 'RK4'?"),
        ({"integrator": ""}, f"integrator must be one of {INTEGRATORS}, got ''"),
        ({"controller": 3}, "controller must be text, got 3"),
        (
            {"integrator": "rk4", "record": ("qpos", "qacc")},
            "record must not contain 'qacc' with RK4, which overwrites the acceleration; use Euler",
        ),
        ({"record": ()}, f"record must not be empty. Allowed: {', '.join(RECORDABLE)}"),
        ({"record": 3}, "record must be names, got 3"),
        (
            {"record": ("qpos", "qve")},
            f"record must not contain 'qve'. Did you mean 'qvel'? Allowed: {', '.join(RECORDABLE)}",
        ),
        (
            {"randomize": {"mas": 0.1}},
            f"randomize must not contain 'mas'. Did you mean 'mass'? Allowed: {QUANTITIES}",
        ),
        ({"randomize": 0.1}, "randomize must map names to numbers or distributions, got 0.1"),
        ({"randomize": {"mass": 1.0}}, "randomize must have shares of at least 0 and below 1, got mass=1"),
        ({"randomize": {"gain": -0.1}}, "randomize must have shares of at least 0 and below 1, got gain=-0.1"),
        ({"randomize": {"gain": float("nan")}}, "randomize must have shares of at least 0 and below 1, got gain=nan"),
        ({"floating_base": "yes"}, "floating_base must be True or False, got 'yes'"),
        ({"rolouts": 3}, "rolouts is not an option. Did you mean 'rollouts'?"),
    ],
    ids=str,
)
def test_each_mistake_is_reported_with_what_is_allowed(how: dict[str, Any], problem: str) -> None:
    assert problems(**how) == [problem]


def test_all_mistakes_are_reported() -> None:
    found = problems(
        rollouts=0, timestep=2.0, seed=-1, record=("a", "b"), randomize={"x": 0.1}, integrator="", every=0
    )
    assert [problem.split(" ")[0] for problem in found] == [
        *("rollouts", "timestep", "integrator", "seed", "record", "record", "every", "randomize")
    ]


@pytest.mark.parametrize("name", ["euler", "EULER", "Euler"])
def test_an_integrator_may_be_written_small_or_large(name: str) -> None:
    assert RolloutOptions(integrator=name).integrator == "Euler"


def test_what_is_recorded_is_in_one_order_and_once() -> None:
    assert RolloutOptions(record=("contacts", "qpos", "ctrl", "qpos")).record == ("qpos", "ctrl", "contacts")


@pytest.mark.parametrize("given", ["qpos,qvel", " qpos , qvel,,", ["qpos", "qvel"], ("qpos ", " qvel")])
def test_names_may_be_one_text(given: Any) -> None:
    assert RolloutOptions(record=given).record == ("qpos", "qvel")


def test_options_survive_json_to_the_last_bit() -> None:
    options = RolloutOptions(
        rollouts=np.int64(3),
        duration=0.3,
        timestep=0.1,
        integrator="rk4",
        controller="pd:kp=3",
        start="q.npy",
        seed=2**70,
        record="energy,qpos",
        every=3,
        randomize={"gain": 0.1, "mass": np.float64(1 / 3)},
        floating_base=True,
        vary={"a2": 1 / 3, "d1": "uniform:0.1:0.30000000000000004"},
        per_design=2,
    )
    values = json.loads(json.dumps(options.to_json()))
    assert RolloutOptions.from_json(values) == options
    assert RolloutOptions.from_json({**values, "kp": [1.0]}) == options
    assert set(values) == {option.name for option in fields(RolloutOptions)} - {"designs", "engine"}
    assert list(values["randomize"]) == ["mass", "gain"]


def test_replaced_options_are_checked_again() -> None:
    options = RolloutOptions(steps=10, every=5)
    assert options.replace(every=2).records == 5
    with pytest.raises(SettingsError, match=r"^every must divide"):
        options.replace(steps=11)


def test_every_option_is_a_keyword_and_on_the_command_line() -> None:
    from dh2sim.cli.rollout import rollout as command

    names = {option.name for option in fields(RolloutOptions)} | {"duration"}
    assert set(get_type_hints(RolloutKeywords)) == names
    assert names <= set(inspect.signature(command).parameters)


def test_defaults_on_the_command_line_are_those_of_the_options() -> None:
    from dh2sim.cli.rollout import rollout as command

    options, given = RolloutOptions(), inspect.signature(command).parameters
    for name in ("timestep", "integrator", "controller", "start", "seed", "every", "floating_base"):
        assert given[name].default == getattr(options, name), name
    assert f"[default: {options.rollouts}, or" in given["rollouts"].annotation  # as text
    assert given["record"].default is None  # of a list, whose help names what there is, first the five by default
    record = str(get_type_hints(command, include_extras=True)["record"].__metadata__[0].help)
    assert f"repeated: {', '.join(options.record)}, " in record
    assert f"[default: the first {['no', 'one', 'two', 'three', 'four', 'five'][len(options.record)]}]" in record
    words = str(get_type_hints(command, include_extras=True)["randomize"].__metadata__[0].help)
    unmentioned = [name for name in RANDOMIZABLE if not re.search(rf"\b{name}\b", words)]
    assert unmentioned == ["push_interval", "push_duration"]
