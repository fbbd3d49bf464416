"""Random numbers: every rollout has its own, for every purpose, whoever simulates it and with which others."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from typing import overload

import numpy as np


class Purpose(IntEnum):
    """What random numbers are drawn for; one does not disturb the other."""

    START = 0
    RANDOMIZE = 1
    CONTROLLER = 2


def generator(seed: int, rollout: int, purpose: Purpose) -> np.random.Generator:
    """Return a rollout's own generator: child number ``purpose`` of child number ``rollout`` of the seed.

    It is what ``SeedSequence(seed).spawn(…)[rollout].spawn(…)[purpose]`` gives, made without the others.
    """
    sequence = np.random.SeedSequence(seed, spawn_key=(rollout, int(purpose)))
    return np.random.Generator(np.random.PCG64(sequence))


class Generators(Sequence[np.random.Generator]):
    """The generators of some rollouts, each made when it is first asked for: that takes longer than a time step."""

    def __init__(self, seed: int, rollouts: range, purpose: Purpose) -> None:
        """Name them."""
        self._seed, self._rollouts, self._purpose = seed, rollouts, purpose
        self._made: dict[int, np.random.Generator] = {}

    def __len__(self) -> int:
        """Return the number of rollouts."""
        return len(self._rollouts)

    @overload
    def __getitem__(self, index: int) -> np.random.Generator: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[np.random.Generator]: ...
    def __getitem__(self, index: int | slice) -> np.random.Generator | Sequence[np.random.Generator]:
        """Return the generator of the ``index``-th of the rollouts, the same one every time."""
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        rollout = self._rollouts[index]
        if rollout not in self._made:
            self._made[rollout] = generator(self._seed, rollout, self._purpose)
        return self._made[rollout]
