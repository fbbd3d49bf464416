from __future__ import annotations

import numpy as np
import pytest

from dh2sim.simulate import rollout
from dh2sim.simulate.randomization import Generators, Purpose, generator
from tests.simulate import robots


@pytest.mark.parametrize("seed", [0, 7, 2**200 + 1])
@pytest.mark.parametrize("purpose", list(Purpose))
def test_a_generator_is_a_child_of_a_child_of_the_seed(seed: int, purpose: Purpose) -> None:
    children = np.random.SeedSequence(seed).spawn(5)
    for i, child in enumerate(children):
        expected = np.random.Generator(np.random.PCG64(child.spawn(3)[purpose]))
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
