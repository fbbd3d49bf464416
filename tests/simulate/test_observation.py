"""What controllers see."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from dh2sim.simulate import rollout
from dh2sim.simulate.controllers.protocol import Observation
from dh2sim.typing import Array
from tests.simulate import drivers, plain, robots

SEEN = ("q", "v", "mass_matrix", "bias", "passive", "gravity")


class Looking(drivers.Damper):
    """Writes down what it sees, in some steps only."""

    steps: tuple[int, ...] = ()
    notes: dict[tuple[int, str], Array] = {}  # noqa: RUF012 - the test's own
    times: list[tuple[int, float]] = []  # noqa: RUF012

    def control(self, observation: Observation) -> Array:
        self.times.append((observation.step, observation.time))
        if observation.step in self.steps:
            self.notes.update({(observation.step, name): getattr(observation, name) for name in SEEN})
        return super().control(observation)


@pytest.fixture
def looking() -> type[Looking]:
    Looking.notes, Looking.times = {}, []
    return Looking


def felt(M: Array, c: Array, base: int) -> tuple[Array, Array]:
    """What the joints feel of the mass matrix and the bias forces of all degrees of freedom."""
    follows = np.linalg.inv(M[:base, :base])
    return M[base:, base:] - M[base:, :base] @ follows @ M[:base, base:], c[base:] - M[base:, :base] @ follows @ c[
        :base
    ]


@pytest.mark.parametrize("floating", [False, True], ids=["fixed", "floating"])
@pytest.mark.parametrize("randomized", [False, True])
@pytest.mark.parametrize("steps", [(0, 1, 2), (3, 17), (19,)])
def test_it_is_what_mujoco_computes_from_the_state(
    looking: type[Looking], floating: bool, randomized: bool, steps: tuple[int, ...]
) -> None:
    looking.steps = steps
    run = rollout(
        robots.worm(),
        rollouts=3,
        steps=20,
        start="random",
        controller="tests.simulate.test_observation:Looking",
        floating_base=floating,
        randomize={"mass": 0.4, "damping": 0.5, "armature": 0.3} if randomized else {},
    )
    base = floating * 6
    for i in range(3):
        factors = {name: run[f"{name}_scale"].values[i] for name in run.attrs["randomize"]}
        model = plain.scaled(run.attrs["mjcf"], factors)
        for k in steps:
            data = mujoco.MjData(model)
            if floating:
                data.qpos[:7], data.qvel[:6] = run.base_pose.values[i, k], run.base_twist.values[i, k]
            data.qpos[base + floating :], data.qvel[base:] = run.qpos.values[i, k], run.qvel.values[i, k]
            mujoco.mj_forward(model, data)
            M = np.zeros((model.nv, model.nv))
            mujoco.mj_fullM(model, data, M)
            expected = {
                "q": run.qpos.values[i, k],
                "v": run.qvel.values[i, k],
                "mass_matrix": felt(M, data.qfrc_bias, base)[0],
                "bias": felt(M, data.qfrc_bias, base)[1],
                "passive": data.qfrc_passive[base:].copy(),
            }
            data.qvel[:] = 0.0
            mujoco.mj_forward(model, data)
            expected["gravity"] = felt(M, data.qfrc_bias, base)[1]
            for name, values in expected.items():
                seen = looking.notes[k, name][i]
                if base and name in ("mass_matrix", "bias", "gravity"):
                    assert seen == pytest.approx(values, rel=1e-9, abs=1e-9 * np.abs(M).max()), (name, i, k)
                else:
                    assert np.array_equal(seen, values), (name, i, k)


def test_the_time_is_that_of_the_step(looking: type[Looking]) -> None:
    rollout(robots.arm(), rollouts=2, steps=4, timestep=0.25, controller="tests.simulate.test_observation:Looking")
    rehearsal = [(0, 0.0)]
    assert looking.times == [*rehearsal, (0, 0.0), (1, 0.25), (2, 0.5), (3, 0.75)]


@pytest.mark.parametrize("steps", [(), (0,), (5,), tuple(range(20))])
def test_looking_changes_nothing(looking: type[Looking], steps: tuple[int, ...]) -> None:
    looking.steps = steps
    how = {"rollouts": 3, "steps": 20, "start": "curled", "record": "qpos,qvel,qacc,contacts,tool_pose,torque"}
    seen = rollout(robots.worm(), controller="tests.simulate.test_observation:Looking", **how)  # type: ignore[arg-type]
    unseen = rollout(robots.worm(), controller="tests.simulate.drivers:Damper", **how)  # type: ignore[arg-type]
    assert seen.drop_attrs().identical(unseen.drop_attrs())


def test_arrays_are_the_controllers_own_to_change() -> None:
    how = {"rollouts": 3, "steps": 20, "start": "curled"}
    greedy = rollout(robots.worm(), controller="tests.simulate.drivers:Greedy", **how)  # type: ignore[arg-type]
    damper = rollout(robots.worm(), controller="tests.simulate.drivers:Damper", **how)  # type: ignore[arg-type]
    assert greedy.drop_attrs().identical(damper.drop_attrs())
