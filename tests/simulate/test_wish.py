"""What may be wished for, and what is said of what may not."""

from __future__ import annotations

from typing import Any

import pytest

from dh2sim.simulate.options import Wish, check_wish, names_of
from dh2sim.simulate.settings import RECORDABLE

QUANTITIES = "mass, friction, damping, armature, gain"


def problems(**how: Any) -> list[str]:
    return check_wish(Wish(**how))[1]


@pytest.mark.parametrize(
    ("how", "steps"),
    [
        ({}, 1000),
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
    assert check_wish(Wish(**how)) == (steps, [])


@pytest.mark.parametrize(
    ("how", "problem"),
    [
        ({"rollouts": 0}, "--rollouts 0: is not at least 1"),
        ({"rollouts": 10**12}, "--rollouts 1000000000000: is more than 10,000,000; make several runs of other seeds"),
        ({"every": 0}, "--every 0: is not at least 1"),
        ({"every": -2}, "--every -2: is not at least 1"),
        ({"every": 3}, "--every 3: does not divide the 1000 steps of a rollout"),
        ({"every": 10**30}, f"--every {10**30}: does not divide the 1000 steps of a rollout"),
        ({"seed": -1}, "--seed -1: is not at least 0"),
        ({"steps": 0}, "--steps 0: is not at least 1"),
        ({"steps": -3}, "--steps -3: is not at least 1"),
        ({"steps": 10**30}, f"--steps {10**30}: is more than 1,000,000,000,000"),
        ({"steps": 5, "duration": 1.0}, "--steps and --duration: give one of them, not both"),
        ({"duration": 0.0}, "--duration 0.0: is not a time above 0 s"),
        ({"duration": float("nan")}, "--duration nan: is not a time above 0 s"),
        ({"duration": float("inf")}, "--duration inf: is not a time above 0 s"),
        ({"duration": 1e300}, "--duration 1e+300: is more than 1,000,000,000,000 time steps of 0.002 s"),
        (
            {"duration": 0.0051},
            "--duration 0.0051: is not a whole number of time steps of 0.002 s; --steps 3 is 0.006 s",
        ),
        (
            {"duration": 0.0001},
            "--duration 0.0001: is not a whole number of time steps of 0.002 s; --steps 1 is 0.002 s",
        ),
        ({"timestep": 0.0}, "--timestep 0.0: is not between 0 and 1 s"),
        ({"timestep": -0.1}, "--timestep -0.1: is not between 0 and 1 s"),
        ({"timestep": 1.5}, "--timestep 1.5: is not between 0 and 1 s"),
        ({"timestep": float("nan")}, "--timestep nan: is not between 0 and 1 s"),
        ({"integrator": "rk5"}, "--integrator rk5: allowed are Euler, RK4, implicit, implicitfast"),
        (
            {"integrator": "rk4", "record": ("qpos", "qacc")},
            "--record qacc: RK4 does not tell the acceleration at the beginning of a step; use Euler",
        ),
        ({"record": ()}, f"--record: names nothing. Allowed: {', '.join(RECORDABLE)}"),
        (
            {"record": ("qpos", "qve")},
            f"--record qve: is not known. Did you mean 'qvel'? Allowed: {', '.join(RECORDABLE)}",
        ),
        (
            {"randomize": {"mas": 0.1}},
            f"--randomize mas: is not known. Did you mean 'mass'? Allowed: {QUANTITIES}",
        ),
        ({"randomize": {"mass": 1.0}}, "--randomize mass=1: is not a share of at least 0 and below 1"),
        ({"randomize": {"gain": -0.1}}, "--randomize gain=-0.1: is not a share of at least 0 and below 1"),
        ({"randomize": {"gain": float("nan")}}, "--randomize gain=nan: is not a share of at least 0 and below 1"),
    ],
    ids=str,
)
def test_each_mistake_is_told_with_what_is_allowed(how: dict[str, Any], problem: str) -> None:
    assert problems(**how) == [problem]


def test_all_mistakes_are_told() -> None:
    told = problems(
        rollouts=0, timestep=2.0, seed=-1, record=("a", "b"), randomize={"x": 0.1}, integrator="", every=0
    )
    assert [problem.split(":")[0] for problem in told] == [
        "--timestep 2.0",
        "--rollouts 0",
        "--every 0",
        "--seed -1",
        "--randomize x",
        "--record a",
        "--record b",
        "--integrator ",
    ]


@pytest.mark.parametrize("name", ["euler", "EULER", "Euler"])
def test_an_integrator_may_be_written_small_or_large(name: str) -> None:
    assert Wish(integrator=name).integrator_name == "Euler"


def test_what_is_recorded_is_in_one_order_and_once() -> None:
    assert Wish(record=("contacts", "qpos", "ctrl", "qpos")).recorded == ("qpos", "ctrl", "contacts")


@pytest.mark.parametrize("given", ["qpos,qvel", " qpos , qvel,,", ["qpos", "qvel"], ("qpos ", " qvel")])
def test_names_may_be_one_text(given: Any) -> None:
    assert names_of(given) == ("qpos", "qvel")
