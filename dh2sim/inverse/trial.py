"""Which eliminations suit an arm, chosen by trial when its solver is built.

No rule says beforehand which pencils are regular: of the 12 of a UR5 one is. So each is tried on poses that random
configurations reach, and the best two are kept. What the trial shows that they miss is reported.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain, product
from typing import Final

import numpy as np

from dh2sim.inverse.elimination import NUDGE, Elimination, Found, Method, Nudged, joined, small_motions
from dh2sim.inverse.loop import Arm, Flags, Loop, close_loop, inverse_poses, pose_and_jacobian
from dh2sim.inverse.pencil import build_pencil
from dh2sim.inverse.slides import OppositeSlides, ThreeSlides
from dh2sim.typing import Array

_TRIALS: Final = 40
"""Poses of the trial."""
_FIRST: Final = 8
"""Of them on which a hopeless elimination is told from others."""
_MORE: Final = 4
"""Eliminations of a kind that are tried in full where those of the kind before may miss solutions, or all must."""
_ROUNDED: Final = 1e-6
"""Least share of singular values, below which the joints are independent by rounding of the table alone."""
_SEED: Final = 2026


def choose_method(arm: Arm, moving: Flags, ranges: Array) -> Method:
    """Try the eliminations of an arm and return how its poses are solved.

    Args:
        arm: The arm.
        moving: Which joints are not locked, bool, shape (n,): at most six.
        ranges: Where trial configurations are drawn from, in the arm's units, shape (n, 2).
    """
    if not moving.any():
        return Method(arm=arm, moving=moving, virtual=(), eliminations=(), found_share=1.0)
    rng = np.random.default_rng(_SEED)
    missing = 6 - int(moving.sum())
    q = rng.uniform(ranges[:, 0], ranges[:, 1], (2 * _TRIALS, arm.n))
    J = pose_and_jacobian(arm, q)[1][:, :, moving]
    q = q[np.sort(np.argsort(-np.linalg.svd(J, compute_uv=False)[:, -1])[:_TRIALS])]  # away from singular ones
    # three virtual joints make a wrist, unless that leaves the others with a point that they cannot move freely
    wrists = (True, False) if missing == 3 else (False,)
    methods: list[Method] = []
    for wrist in wrists:
        methods.append(_tried(arm, moving, q, _virtual_links(missing, rng, wrist=wrist), rng))
        if methods[-1].found_share == 1.0:
            break
    return max(methods, key=lambda method: method.found_share)


def _tried(arm: Arm, moving: Flags, q: Array, virtual: tuple[Array, ...], rng: np.random.Generator) -> Method:
    """Return the best eliminations for the poses that trial configurations reach."""
    T = np.zeros((len(q), 4, 4))
    T[:, :3], T[:, 3, 3] = pose_and_jacobian(arm, q)[0], 1.0
    locked = {int(joint): q[:, joint] for joint in np.flatnonzero(np.logical_not(moving))}
    loop = close_loop(arm, T, locked, virtual)
    J = pose_and_jacobian(arm, q)[1]
    drawn = Found(pose=np.arange(len(q)), q=q, sigma=np.ones(len(q)), error=np.zeros(len(q)), J=J)
    bare = Method(arm=arm, moving=moving, virtual=virtual, eliminations=(), found_share=0.0)
    values = np.linalg.svd(J[:, :, moving], compute_uv=False)
    rounded = bool((values[:, -1] < _ROUNDED * values[:, 0]).all())
    trials: list[_Trial] = []
    share = 0.0
    nudges = small_motions(rng, 6, NUDGE)
    nudged = loop.moved(nudges)
    for number, (seen, hidden) in enumerate(product((loop, nudged), ((0,), (1, 2)))):
        more = _MORE if number or rounded else math.inf  # where all is rounded, none is better
        for elimination in _eliminations(seen, hidden, rng):
            if not more:
                break
            used = elimination if seen is loop else Nudged(elimination=elimination, nudges=nudges)
            few = bare.solve_by(used, T[:_FIRST], {joint: value[:_FIRST] for joint, value in locked.items()})
            if _own(bare, few, drawn) >= _FIRST // 2:
                found = bare.solve_by(used, T, locked)
                own, condition = _own(bare, found, drawn), float(np.median(elimination.condition(seen)))
                trials.append(_Trial(elimination=used, found=found, own=own, condition=condition))
                more -= 1
        trials.sort(key=lambda trial: trial.rank)
        union = bare.distinct(joined([drawn, *(trial.found for trial in trials)], arm.n))
        ours = bare.distinct(joined([trial.found for trial in trials[:2]], arm.n))
        share = len(ours.pose) / len(union.pose)
        if rounded or (share == 1.0 and not bare.doubtful(ours, len(q)).any()):
            break
    best = tuple(trial.elimination for trial in trials[:2])
    return replace(bare, eliminations=best, found_share=share, telling=not trials or trials[0].is_telling)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Trial:
    """How an elimination did."""

    elimination: Elimination
    found: Found
    own: int
    """How many of the drawn configurations it found."""
    condition: float

    @property
    def rank(self) -> tuple[int, int, bool, float]:
        """Sort the best first: what finds most, then what tells where it may not, then what is conditioned best."""
        return -self.own, -len(self.found.pose), not self.is_telling, self.condition

    @property
    def is_telling(self) -> bool:
        """Whether it is sure of most poses, so that where it is not tells something."""
        return len(self.found.unsure) < _TRIALS // 2


def _eliminations(loop: Loop, hidden: tuple[int, ...], rng: np.random.Generator) -> Iterator[Elimination]:
    """Yield the eliminations that may suit a ring, with the first or another joint as the eigenvalue of pencils."""
    slides = [i for i, turns in enumerate(loop.turns) if not turns]
    both = (False, True)
    if len(slides) == 3:
        yield ThreeSlides()
    elif len(slides) == 2 and slides[1] - slides[0] == 3:
        yield from (OppositeSlides(first=first, backwards=backwards) for first, backwards in product(slides, both))
    else:
        wrists = product((True,), (0, 1), both, range(6)) if 0 in hidden else ()
        for wrist, which, backwards, first in chain(wrists, product((False,), hidden, both, range(6))):
            pencil = build_pencil(loop, first, backwards=backwards, wrist=wrist, hidden=which, rng=rng)
            if pencil is not None:
                yield pencil


def _own(method: Method, found: Found, drawn: Found) -> int:
    """Return how many of the drawn configurations are among the solutions found."""
    drawn = drawn.of(drawn.pose <= found.pose.max(initial=-1))
    both = method.distinct(joined([found, drawn], method.arm.n))
    return len(found.pose) + len(drawn.pose) - len(both.pose)


def _virtual_links(count: int, rng: np.random.Generator, *, wrist: bool) -> tuple[Array, ...]:
    """Return links around virtual joints: random, so that the ring is not singular; their product is the identity.

    Those of a wrist meet in a point, which then is all that the other joints have to reach.
    """
    if count == 0:
        return ()
    links = []
    for k in range(count):
        K = np.eye(4)
        K[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        K[:3, :3] *= np.sign(np.linalg.det(K[:3, :3]))
        if k == 0 or not wrist:
            K[:3, 3] = rng.choice([-1.0, 1.0], 3) * rng.uniform(0.3, 0.8, 3)
        links.append(K)
    product = np.eye(4)
    for K in links:
        product = product @ K
    return (*links, inverse_poses(product))
