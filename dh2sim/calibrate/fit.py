"""The least-squares fit: Gauss-Newton on the identifiable parameters, damped where a step goes too far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.calibrate.identify import Basis, find_basis
from dh2sim.calibrate.observations import ANGLE, ARTEFACT, ARTEFACT_SIGMA, LENGTH, Equations, Observations, State
from dh2sim.typing import Array

_ITERATIONS: Final = 100
_SETTLED: Final = 1e-9
"""Step in units of the parameters' standard deviations, or of rounding, at which a fit ends."""
_ROUNDS: Final = 30
NOISY: Final = 1e-3
"""m and rad: the greatest noise that makes parameters count as not determined."""
_EXACT: Final = 1e-9
"""m and rad: the least noise that is estimated; steps of a fit with less drown in rounding."""
_STRICTER: Final = (1.0, 0.3, 0.1)
"""Shares of what parameters must be known to, tried in turn where a fit does not settle with all that are."""
_SAME: Final = 1e-3
"""Relative change of the estimated noise, or change of a weight, at which a fit ends."""
HUBER: Final = 1.345
"""Standard deviations beyond which a residual counts by its size, no longer by its square (P. J. Huber, 1964): 95 %
as efficient as least squares where all errors are normal."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sigma:
    """Standard deviations of what was measured, a component each."""

    length: float
    """m."""
    angle: float
    """rad."""
    length_known: bool = True
    angle_known: bool = True

    def at_most(self, size: float) -> Sigma:
        """Return these, or what is less: a fit that is still far off must not count as noise."""
        return replace(self, length=min(self.length, size), angle=min(self.angle, size))

    def of(self, scale: NDArray[np.intp]) -> Array:
        """Return those of equations."""
        return np.array([self.length, self.angle, ARTEFACT_SIGMA])[scale]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prior:
    """What is known of parameters beforehand."""

    columns: NDArray[np.intp]
    sigma: Array
    """m and rad, a column each."""
    target: State
    """Where they are expected."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fit:
    """The state that fits best."""

    observations: Observations
    state: State
    basis: Basis
    sigma: Sigma
    equations: Equations
    """At the state."""
    weight: Array
    """Of each equation: 1, less for what is far off in a robust fit; shape (E,)."""
    covariance: Array
    """Of the kept parameters, m and rad, shape (kept, kept)."""
    leverage: Array
    """Share of each equation's own error that the fit follows, shape (E,)."""
    chi2: float
    """Of equations and prior."""
    dof: int
    iterations: int
    settled: bool

    @property
    def chi2_per_dof(self) -> float:
        """Chi-squared per degree of freedom; 1 where all is well."""
        return self.chi2 / self.dof if self.dof > 0 else float("nan")


@dataclass(slots=True)
class _Weighted:
    """Equations and prior with standard deviation one."""

    e: Array
    J: Array
    size: int
    cost: float = field(init=False)

    def __post_init__(self) -> None:
        self.cost = float(self.e @ self.e)


def _weighted(
    observations: Observations, state: State, equations: Equations, sigma: Sigma, weight: Array, prior: Prior | None
) -> _Weighted:
    scale = np.sqrt(weight) / sigma.of(equations.scale)
    e, J = equations.e * scale, equations.J * scale[:, None]
    size = len(e)
    if prior is not None and len(prior.columns):
        off = observations.robot.change(prior.target.values, state.values)[prior.columns]
        rows = np.zeros((len(prior.columns), J.shape[1]))
        rows[np.arange(len(rows)), prior.columns] = 1.0 / prior.sigma
        e, J = np.concatenate([e, off / prior.sigma]), np.concatenate([J, rows])
    return _Weighted(e, J, size)


def weighted_jacobian(observations: Observations, state: State, sigma: Sigma) -> Array:
    """Return the derivatives of all equations, in standard deviations, shape (E, U)."""
    equations = observations.equations(state)
    return _weighted(observations, state, equations, sigma, np.ones(len(equations.e)), None).J


def fit(
    observations: Observations,
    state: State,
    columns: Sequence[int],
    sigma: Sigma,
    *,
    prior: Prior | None = None,
    weight: Array | None = None,
    robust: bool = False,
) -> Fit:
    """Fit unknowns to measurements.

    Args:
        observations: The measurements.
        state: Where to start.
        columns: Unknowns that may change; of those that do the same only one does.
        sigma: Of the measurements; what is not known of it is estimated from the residuals.
        prior: What is known of parameters beforehand.
        weight: Of each equation; by default 1.
        robust: Whether rows that are far off count less, by Huber's function.
    """
    known = weight
    start, equations = state, observations.equations(state)
    weights: Array = np.ones(len(equations.e)) if known is None else known
    iterations, settled = 0, False

    def determined(scale: float = 1.0) -> Basis:
        J = _weighted(observations, state, equations, sigma.at_most(NOISY), weights, prior).J
        return find_basis(J, observations.unknowns, columns, scale=scale)

    basis = determined()
    kept = list(basis.kept)
    for _ in range(_ROUNDS):
        state, equations, now, steps, settled = _least_squares(observations, state, kept, sigma, weights, prior)
        iterations += steps
        fewer = (determined(scale) for scale in ((1.0,) if settled else _STRICTER))
        found = next((found for found in fewer if len(found.kept) < len(kept)), None)
        if found is not None:  # what seemed to be determined is not, where the others lead
            basis, kept, state = found, list(found.kept), start
            continue
        leverage = _leverage(now, kept)[: now.size]
        new_sigma = _estimated(equations, sigma, weights, leverage, robust=robust)
        new_weight = _huber(equations, new_sigma, known) if robust else weights
        ratio = (new_sigma.length / sigma.length, new_sigma.angle / sigma.angle)
        done = (
            max(ratio) < 1.0 + _SAME
            and min(ratio) > 1.0 - _SAME
            and bool(np.abs(new_weight - weights).max(initial=0.0) < _SAME)
        )
        sigma, weights = new_sigma, new_weight
        if done:
            break
    now = _weighted(observations, state, equations, sigma, weights, prior)
    leverage = _leverage(now, kept)
    count = len(now.e) - int((weights == 0.0).sum())
    return Fit(
        observations=observations,
        state=state,
        basis=basis,
        sigma=sigma,
        equations=equations,
        weight=weights,
        covariance=_covariance(now.J[:, kept]),
        leverage=leverage[: now.size],
        chi2=now.cost,
        dof=count - len(kept),
        iterations=iterations,
        settled=settled,
    )


def _least_squares(
    observations: Observations, state: State, kept: list[int], sigma: Sigma, weight: Array, prior: Prior | None
) -> tuple[State, Equations, _Weighted, int, bool]:
    """Return the state with least squares, its equations, the number of steps, and whether they came to an end."""
    equations = observations.equations(state)
    now = _weighted(observations, state, equations, sigma, weight, prior)
    damping = 0.0
    for step in range(1, _ITERATIONS + 1):
        J = now.J[:, kept]
        length = np.linalg.norm(J, axis=0)
        length = np.where(length > 0.0, length, 1.0)
        U, S, Vt = np.linalg.svd(J / length, full_matrices=False)
        right = U.T @ now.e
        while True:
            by = S / (S**2 + damping**2) if damping else 1.0 / np.maximum(S, 1e-12 * S[0])
            move = (Vt.T @ (by * right)) / length
            dx = np.zeros(now.J.shape[1])
            dx[kept] = move
            there = observations.moved(state, dx)
            equations_there = observations.equations(there)
            then = _weighted(observations, there, equations_there, sigma, weight, prior)
            if then.cost <= now.cost * (1.0 + 1e-12) + 1e-20:
                break
            damping = max(10.0 * damping, 1e-3)
            if damping > 1e6:
                return state, equations, now, step, True
        small = float(np.abs(move * length).max(initial=0.0))
        less = now.cost - then.cost
        state, equations, now = there, equations_there, then
        damping = damping / 10.0 if damping > 1e-6 else 0.0
        if small < _SETTLED * max(1.0, np.sqrt(now.cost)) or (damping == 0.0 and 0.0 <= less <= 1e-13 * now.cost):
            return state, equations, now, step, True
    return state, equations, now, _ITERATIONS, False


def _leverage(now: _Weighted, kept: list[int]) -> Array:
    """Return the diagonal of the hat matrix."""
    J = now.J[:, kept]
    length = np.linalg.norm(J, axis=0)
    Q, _ = np.linalg.qr(J / np.where(length > 0.0, length, 1.0))
    return np.asarray((Q**2).sum(axis=1))


def _covariance(J: Array) -> Array:
    length = np.linalg.norm(J, axis=0)
    length = np.where(length > 0.0, length, 1.0)
    _, S, Vt = np.linalg.svd(J / length, full_matrices=False)
    half = Vt.T / np.maximum(S, 1e-15 * S.max(initial=1.0)) / length[:, None]
    return np.asarray(half @ half.T)


def _estimated(equations: Equations, sigma: Sigma, weight: Array, leverage: Array, *, robust: bool) -> Sigma:
    """Return what is not known of the noise, from the residuals and the degrees of freedom that are theirs.

    W. Förstner's estimate of variance components; in a robust fit the median of the residuals takes its place.
    """
    found = {LENGTH: sigma.length, ANGLE: sigma.angle}
    for scale, known in ((LENGTH, sigma.length_known), (ANGLE, sigma.angle_known)):
        mine = (equations.scale == scale) & (weight > 0.0)
        if known or not mine.any():
            continue
        share = float((1.0 - leverage[mine]).sum())
        if share < 1e-6:
            continue
        e = equations.e[mine]
        if robust:
            spread = float(np.median(np.abs(e))) / 0.6745 * np.sqrt(mine.sum() / share)
        else:
            spread = float(np.sqrt((weight[mine] * e**2).sum() / share))
        found[scale] = max(spread, _EXACT)
    return Sigma(
        length=found[LENGTH],
        angle=found[ANGLE],
        length_known=sigma.length_known,
        angle_known=sigma.angle_known,
    )


def row_sizes(equations: Equations, sigma: Sigma) -> tuple[NDArray[np.intp], Array, NDArray[np.intp]]:
    """Return rows, how far off each is in standard deviations of a component, and how many components it has."""
    mine = equations.row >= 0
    scaled = (equations.e / sigma.of(equations.scale))[mine] ** 2
    rows, index, count = np.unique(equations.row[mine], return_inverse=True, return_counts=True)
    return rows, np.sqrt(np.bincount(index, scaled) / count), count


def _huber(equations: Equations, sigma: Sigma, known: Array | None) -> Array:
    """Return the weights of a robust fit, a row's components weighted alike; rows left out beforehand stay so."""
    rows, size, _ = row_sizes(equations, sigma)
    of_row = np.minimum(1.0, HUBER / np.maximum(size, 1e-300))
    weight = np.ones(len(equations.e))
    mine = equations.row >= 0
    weight[mine] = of_row[np.searchsorted(rows, equations.row[mine])]
    weight[equations.scale == ARTEFACT] = 1.0
    return weight if known is None else weight * known
