"""Check of self-contacts: neither adjacent links nor links in a named configuration may collide."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise

import mujoco
import numpy as np

from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array
from dh2sim.validate.motion.free_motion import compile_model
from dh2sim.validate.report import Check, Quantity, Worst, finding

WAYPOINTS = 16
"""Random configurations of a tour, connected by straight lines in joint space."""
POINTS = 40
"""Configurations on each line."""

Pair = tuple[str, str]
"""Names of two links, in the order of the chain."""


@dataclass(slots=True, kw_only=True)
class _ForbiddenContacts:
    """The pairs of links in forbidden contact, and the deepest contact."""

    depth: float = 0.0
    text: str = ""
    worst: Worst | None = None
    pairs: set[Pair] = field(default_factory=set)

    def add(self, pair: Pair, depth: float, q: Array, where: str, sample: int | None = None) -> None:
        self.pairs.add(pair)
        if self.worst is None or depth > self.depth:
            self.depth = depth
            self.text = f"{pair[0]} and {pair[1]} overlap by {depth:.2g} m {where}"
            self.worst = Worst(where=f"{pair[0]}, {pair[1]}", q=tuple(q.tolist()), sample=sample)


def check_self_contact(model: RobotModel, compiled: mujoco.MjModel, *, seed: int = 0) -> Check:
    """Look for forbidden contacts between links.

    - In the configurations of the robot file, and at zero where the limits allow it, no links may touch.
    - Along a random tour of the workspace links that touch by construction may not collide: neighbours on the chain
      (fixed links count as part of the link that carries them), and links whose shapes overlap at home or at zero
      when collisions of all links are enabled.
    - No two links may collide all along the tour: they, too, touch by construction.

    Other contacts on the tour are possible for a real arm, and not an error of its model.

    Args:
        model: The robot.
        compiled: The robot as it is simulated.
        seed: Seed of the tour.

    Returns:
        A check whose error is the deepest forbidden overlap of two links, m; none is allowed.
    """
    forbidden = _ForbiddenContacts()
    collide = _Collider(compiled)
    for name, q in _named_configurations(model):
        for pair, depth in collide.contacts(q).items():
            forbidden.add(pair, depth, q, name)
    apart = by_construction(model)
    tour = random_tour(model, seed)
    always: set[Pair] | None = None
    deepest: dict[Pair, tuple[float, int]] = {}
    for sample, q in enumerate(tour):
        found = collide.contacts(q)
        always = set(found) if always is None else always & set(found)
        for pair, depth in found.items():
            deepest[pair] = max(deepest.get(pair, (-1.0, 0)), (depth, sample))
    for pair, (depth, sample) in deepest.items():
        if pair in apart:
            forbidden.add(pair, depth, tour[sample], "on a tour of the workspace, and touch by construction", sample)
        elif always and pair in always:
            forbidden.add(pair, depth, tour[sample], "and touch all along a tour of the workspace", sample)
    more = len(forbidden.pairs) - 1
    others = f", and {more} other pair{'s' if more > 1 else ''} of links" if more > 0 else ""
    touching = float(np.nextafter(0.0, 1.0))  # a contact of depth zero counts, too
    return finding(
        Quantity.SELF_CONTACT,
        max(forbidden.depth, touching) if forbidden.pairs else 0.0,
        0.0,
        samples=len(tour),
        reference="table",
        failure=f"{forbidden.text}{others}. Simulated, they would push each other away",
        worst=forbidden.worst,
    )


def random_tour(model: RobotModel, seed: int) -> Array:
    """Return configurations along straight lines between random ones inside the limits, shape (N, n)."""
    lower, upper = model.travel
    waypoints = np.random.default_rng([seed, 6]).uniform(lower, upper, (WAYPOINTS, len(lower)))
    share = np.linspace(0.0, 1.0, POINTS, endpoint=False)[:, None]
    lines = [start + share * (end - start) for start, end in pairwise(waypoints)]
    return np.concatenate([*lines, waypoints[-1:]])


def by_construction(model: RobotModel) -> set[Pair]:
    """Return the pairs of links that touch by construction, found by MuJoCo and without the model's list of them."""
    body = [0]
    for row in model.spec.rows:
        body.append(body[-1] + (1 if row.type.moves else 0))
    names = [link.name for link in model.all_links]
    body += body[-1:] * (len(names) - len(body))
    pairs = {
        (names[i], names[j]) for i in range(len(names)) for j in range(i + 1, len(names)) if body[j] - body[i] <= 1
    }
    everything = _Collider(compile_model(replace(model, excluded=())))
    for q in (model.home, np.zeros_like(model.home)):
        pairs |= set(everything.contacts(q))
    return pairs


def _named_configurations(model: RobotModel) -> Iterator[tuple[str, Array]]:
    """Yield configurations with words for them; zero only if it is inside the limits."""
    lower, upper = model.travel
    zero = np.zeros_like(model.home)
    if np.all((lower <= zero) & (zero <= upper)):
        yield "at joint coordinates zero", zero
    for name, q in {"home": model.home, **model.spec.configurations}.items():
        yield f"in configuration '{name}'", q


class _Collider:
    """Finds the colliding links of a model."""

    def __init__(self, compiled: mujoco.MjModel) -> None:
        self._model = compiled
        self._data = mujoco.MjData(compiled)

    def contacts(self, q: Array) -> dict[Pair, float]:
        """Return pairs of links that overlap with the depth, m."""
        self._data.qpos[:] = q
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_collision(self._model, self._data)
        found: dict[Pair, float] = {}
        for contact in self._data.contact:
            bodies = sorted(int(self._model.geom_bodyid[geom]) for geom in contact.geom)
            pair = (self._model.body(bodies[0]).name, self._model.body(bodies[1]).name)
            found[pair] = max(found.get(pair, 0.0), -float(contact.dist))
        return found
