"""Curves of joint vectors: piecewise polynomials, by their values at the ends of pieces or at Chebyshev's nodes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from dh2sim.typing import Array, read_only

ORDERS: Final = 4
"""Of the derivatives that are computed: position, velocity, acceleration and jerk."""


class Curve(Protocol):
    """A vector that depends on a parameter."""

    @property
    def breaks(self) -> Array:
        """Ends of the pieces, increasing, shape (pieces + 1,)."""
        ...

    def derivatives(self, x: Array) -> Array:
        """Return the vector and its first three derivatives at parameters, shape (4, N, n)."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PiecewisePolynomial:
    """A curve whose pieces are polynomials, each in the distance from the start of its piece."""

    breaks: Array
    """Ends of the pieces, increasing, shape (pieces + 1,)."""
    coefficients: Array
    """Of 1, x, x² …, shape (pieces, degree + 1, n)."""

    @classmethod
    def of(cls, breaks: Sequence[float] | Array, coefficients: object) -> Self:
        """Make one of its breaks and coefficients."""
        return cls(breaks=read_only(breaks), coefficients=read_only(coefficients))

    @property
    def end(self) -> float:
        """The last break."""
        return float(self.breaks[-1])

    def derivatives(self, x: Array) -> Array:
        """Return the vector and its first three derivatives, shape (4, N, n); beyond the ends, those of the ends.

        At a break they are those of the piece that starts there.
        """
        x = np.clip(x, self.breaks[0], self.breaks[-1])
        piece = np.clip(np.searchsorted(self.breaks, x, side="right") - 1, 0, len(self.coefficients) - 1)
        local = (x - self.breaks[piece])[:, None]
        terms = self.coefficients[piece]
        found = np.zeros((ORDERS, len(x), terms.shape[2]))
        for order in range(min(ORDERS, terms.shape[1])):
            for power in range(terms.shape[1] - 1, order - 1, -1):
                found[order] = found[order] * local + math.perm(power, order) * terms[:, power]
        return found

    def stretched(self, factor: float) -> Self:
        """Return the same curve run through ``factor`` times as slowly."""
        powers = factor ** -np.arange(self.coefficients.shape[1])
        return self.of(self.breaks * factor, self.coefficients * powers[None, :, None])


def straight(start: Array, end: Array) -> PiecewisePolynomial:
    """Return the straight line of joint vectors, shape (n,), over the parameters 0 to 1."""
    return PiecewisePolynomial.of([0.0, 1.0], [[start, end - start]])


def cubic_spline(knots: Array, points: Array) -> PiecewisePolynomial:
    """Return the cubic spline through points that starts and ends at rest, twice continuously differentiable.

    Source: C. de Boor, A Practical Guide to Splines (1978), chapter IV, complete cubic spline interpolation.

    Args:
        knots: Parameters of the points, increasing, shape (k,).
        points: Shape (k, n).
    """
    h = np.diff(knots)
    slopes = np.diff(points, axis=0) / h[:, None]
    rates = np.zeros(points.shape)
    inner = len(knots) - 2
    if inner > 0:  # h_i s_(i-1) + 2 (h_(i-1) + h_i) s_i + h_(i-1) s_(i+1) = 3 (h_i m_(i-1) + h_(i-1) m_i)
        right = 3.0 * (h[1:, None] * slopes[:-1] + h[:-1, None] * slopes[1:])
        diagonal = 2.0 * (h[:-1] + h[1:])
        above = np.empty(inner)
        for i in range(inner):  # Thomas's algorithm; the rates at both ends are zero
            pivot = diagonal[i] - (h[i + 1] * above[i - 1] if i else 0.0)
            above[i] = h[i] / pivot
            right[i] = (right[i] - (h[i + 1] * right[i - 1] if i else 0.0)) / pivot
        for i in range(inner - 2, -1, -1):
            right[i] -= above[i] * right[i + 1]
        rates[1:-1] = right
    steps = h[:, None]
    square = (3.0 * slopes - 2.0 * rates[:-1] - rates[1:]) / steps
    cube = (rates[:-1] + rates[1:] - 2.0 * slopes) / (steps * steps)
    return PiecewisePolynomial.of(knots, np.stack([points[:-1], rates[:-1], square, cube], axis=1))


def quintic_hermite(knots: Array, q: Array, qd: Array, qdd: Array) -> PiecewisePolynomial:
    """Return the curve of fifth degree with given values, first and second derivatives at knots.

    Args:
        knots: Increasing, shape (k,).
        q: Shape (k, n), as the derivatives.
        qd: With respect to the parameter.
        qdd: Likewise.
    """
    h = np.diff(knots)[:, None]
    v0, v1 = qd[:-1] * h, qd[1:] * h
    a0, a1 = 0.5 * qdd[:-1] * h * h, 0.5 * qdd[1:] * h * h
    rest = q[1:] - q[:-1] - v0 - a0
    speed, curve = v1 - v0 - 2.0 * a0, a1 - a0
    third = 10.0 * rest - 4.0 * speed + curve
    fourth = -15.0 * rest + 7.0 * speed - 2.0 * curve
    fifth = 6.0 * rest - 3.0 * speed + curve
    terms = [q[:-1], v0 / h, a0 / h**2, third / h**3, fourth / h**4, fifth / h**5]
    return PiecewisePolynomial.of(knots, np.stack(terms, axis=1))


DEGREE: Final = 16
"""Of the pieces of a :class:`ChebyshevCurve`."""
_NARROWEST: Final = 1e-7
"""Width of pieces, as a share of the whole, below which a curve is not smooth."""
_MOST_PIECES: Final = 1024
"""That are divided at a time: a smooth function needs fewer."""
_OPEN: Final = 50.0
"""Times as large terms are rounding where values at an end are extrapolated."""
_SPLIT: Final = 0.4871
"""Where pieces are divided: an odd number, as singularities like to be halfway."""
_ROUNDING: Final = 1e-14
"""Of a value that does not change: what is left of it has derivatives of some size."""
NODES: Final = read_only(-np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE))
"""Extreme points of Chebyshev's polynomial of that degree, from -1 to 1."""


def _fit_matrix() -> Array:
    """Return the inverse of T_k(node_j): a discrete cosine transform."""
    k, j = np.meshgrid(np.arange(DEGREE + 1), np.arange(DEGREE + 1), indexing="ij")
    matrix = 2.0 / DEGREE * np.cos(np.pi * k * (DEGREE - j) / DEGREE)
    matrix[:, [0, -1]] *= 0.5
    matrix[[0, -1]] *= 0.5
    return read_only(matrix)


_FIT: Final = _fit_matrix()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChebyshevCurve:
    """A curve whose pieces are Chebyshev series of degree ``DEGREE``, smooth but for what the series leave out."""

    breaks: Array
    """Ends of the pieces, increasing, shape (pieces + 1,)."""
    series: tuple[Array, ...]
    """Coefficients of the curve and its first three derivatives, each of shape (pieces, terms, n)."""

    @classmethod
    def of(cls, breaks: Array, coefficients: Array) -> Self:
        """Make one of its breaks and the coefficients of each piece on -1 to 1."""
        series = [np.moveaxis(coefficients, 1, 0)]
        scale = (2.0 / np.diff(breaks))[:, None]
        for _ in range(ORDERS - 1):
            series.append(np.polynomial.chebyshev.chebder(series[-1], axis=0) * scale)
        return cls(breaks=read_only(breaks), series=tuple(read_only(np.moveaxis(s, 0, 1)) for s in series))

    @property
    def nodes(self) -> Array:
        """Parameters at which its series are exact, shape (N,)."""
        return np.asarray(self.breaks[:-1, None] + np.diff(self.breaks)[:, None] * (NODES + 1.0) / 2.0).ravel()

    def integral(self) -> Self:
        """Return the curve whose derivative this one is, from zero."""
        half = (0.5 * np.diff(self.breaks))[:, None, None]
        terms = np.polynomial.chebyshev.chebint(self.series[0], axis=1, lbnd=-1.0) * half
        rises = terms.sum(axis=1)  # at the ends of pieces, where every T_k is 1
        terms[:, 0] += np.concatenate([np.zeros((1, rises.shape[1])), np.cumsum(rises, axis=0)[:-1]])
        return self.of(self.breaks, terms)

    def derivatives(self, x: Array) -> Array:
        """Return the vector and its first three derivatives, shape (4, N, n); beyond the ends, those of the ends."""
        x = np.clip(x, self.breaks[0], self.breaks[-1])
        piece = np.clip(np.searchsorted(self.breaks, x, side="right") - 1, 0, len(self.breaks) - 2)
        low, high = self.breaks[piece], self.breaks[piece + 1]
        local = ((2.0 * x - low - high) / (high - low))[:, None]
        return np.stack([_clenshaw(series[piece], local) for series in self.series])


def _clenshaw(coefficients: Array, x: Array) -> Array:
    """Return Chebyshev series, one for each x: coefficients (N, terms, n), x (N, 1)."""
    last, before = np.zeros((2, *coefficients[:, 0].shape))
    for term in range(coefficients.shape[1] - 1, 0, -1):
        last, before = coefficients[:, term] + 2.0 * x * last - before, last
    return np.asarray(coefficients[:, 0] + x * last - before)


class NotSmoothError(Exception):
    """A function has no accurate series at a place."""

    def __init__(self, place: float) -> None:
        """Keep the place."""
        self.place = place
        super().__init__(f"not smooth at {place}")


def fit(
    function: Callable[[Array], tuple[Array, NDArray[np.bool_]]],
    breaks: Array,
    units: Array,
    tail: float,
    open_ends: tuple[bool, bool] = (False, False),
) -> ChebyshevCurve:
    """Return a function as Chebyshev series: pieces are divided until the last terms of each vanish.

    Args:
        function: Returns values at parameters, shape (N, n), and whether each is valid, shape (N,).
        breaks: Pieces to begin with, increasing, shape (k + 1,).
        units: What the values are measured in, shape (n,).
        tail: Size of the last terms from which on a series is accurate.
        open_ends: Whether the values at the first, and at the last, parameter are to be extrapolated: where the
            function has a limit, and no accurate value.

    Raises:
        NotSmoothError: Pieces become too narrow.
    """
    pieces = list(zip(breaks[:-1].tolist(), breaks[1:].tolist(), strict=True))
    narrowest = _NARROWEST * (breaks[-1] - breaks[0])
    done: list[tuple[float, float, Array]] = []
    while pieces:
        if len(pieces) > _MOST_PIECES:
            raise NotSmoothError(min(pieces, key=lambda piece: piece[1] - piece[0])[0])
        low, high = np.array(pieces).T
        x = 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * NODES
        found, valid = function(x.ravel())
        values, good = found.reshape(*x.shape, -1) / units, valid.reshape(x.shape)
        allowed = np.full(len(low), tail)
        for node, at_end in ((0, low == breaks[0]), (-1, high == breaks[-1])):
            if open_ends[node]:  # the value that leaves the last term zero: the series through the other nodes
                others = np.delete(np.arange(DEGREE + 1), node)
                values[at_end, node] = -np.einsum("j,pjn->pn", _FIT[-1, others], values[at_end][:, others])
                values[at_end, node] /= _FIT[-1, node]
                good[at_end, node] = True
                allowed[at_end] = _OPEN * tail
        allowed[high - low <= 1e3 * narrowest] = 1e3 * tail  # there rounding is larger than what is left out
        terms = np.einsum("kj,pjn->pkn", _FIT, values)
        enough = good.all(axis=1) & (np.abs(terms[:, -3:]).max(axis=(1, 2)) <= allowed)
        pieces = []
        for a, b, series, accurate in zip(low.tolist(), high.tolist(), terms * units, enough.tolist(), strict=True):
            if accurate:
                done.append((a, b, series))
            elif b - a > narrowest:
                middle = a + _SPLIT * (b - a)
                pieces += [(a, middle), (middle, b)]
            else:
                raise NotSmoothError(0.5 * (a + b))
    done.sort(key=lambda piece: piece[0])
    ends = np.array([*(a for a, _, _ in done), breaks[-1]])
    series = np.stack([each for *_, each in done])
    off = np.abs(series - np.eye(1, DEGREE + 1).T * series[0, 0]).max(axis=(0, 1))
    rests = off <= _ROUNDING * np.maximum(units, np.abs(series[0, 0]))
    series[:, :, rests] = np.where(np.arange(DEGREE + 1)[:, None] == 0, series[0, 0], 0.0)[:, rests]
    return ChebyshevCurve.of(ends, series)
