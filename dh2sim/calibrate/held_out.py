"""Errors at measurements that a fit has not seen, with groups held out whole.

Rows of one placement share its errors, so that a row held out alone would be predicted by its neighbours.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dh2sim.calibrate.fit import Fit, fit
from dh2sim.calibrate.initial import initial_states
from dh2sim.calibrate.measurements import Kind, Measurements, socket_distances
from dh2sim.calibrate.observations import ANGLE, LENGTH, Observations, State
from dh2sim.calibrate.parameters import RobotParameters
from dh2sim.errors import CalibrationError
from dh2sim.typing import Array

MOST_FOLDS: Final = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """Root mean square errors; NaN for what was not measured."""

    length: float
    """Of positions and distances, m; of sockets the scatter in them. Norms of vectors, not components."""
    angle: float = float("nan")
    """rad."""
    artefact: float = float("nan")
    """Of known distances between sockets, m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fold:
    """What was held out together, and how far off it was."""

    groups: tuple[str, ...]
    """Names; of rows that stand alone, their places."""
    rows: int
    nominal: Errors | None
    """With the table as it was, base and tool fitted to the rest; None where the rest cannot tell them."""
    fitted: Errors | None
    predicted: Errors | None
    """By the covariance of the fit to the rest, and the noise."""
    reason: str = ""
    """Why there is nothing."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldOut:
    """Errors at all measurements, each held out once."""

    by: str
    """What was held out: ``placement``, ``row``, …"""
    folds: tuple[Fold, ...]
    nominal: Errors | None
    fitted: Errors | None
    predicted: Errors | None


Refit: TypeAlias = Callable[[Measurements], tuple[Fit, Fit, RobotParameters]]
"""Fits the whole and, first, only base and tool to other measurements."""


def make_folds(measured: Measurements, seed: int) -> list[tuple[tuple[str, ...], NDArray[np.bool_]]]:
    """Return names and rows that are held out together: groups, at most ten folds of them."""
    count = len(measured)
    if measured.groups is None:
        names, of_row = [measured.place(k) for k in range(count)], np.arange(count)
    else:
        names = list(dict.fromkeys(measured.groups))
        known = {name: k for k, name in enumerate(names)}
        of_row = np.array([known[name] for name in measured.groups])
    folds = min(len(names), MOST_FOLDS)
    order = np.arange(len(names))
    if len(names) > MOST_FOLDS:
        order = np.random.default_rng(seed).permutation(len(names))
    found = []
    for k in range(folds):
        members = np.sort(order[k::folds])
        found.append((tuple(names[m] for m in members.tolist()), np.isin(of_row, members)))
    return found


def held_out_errors(measured: Measurements, refit: Refit, *, seed: int) -> HeldOut | None:
    """Fit to all but one fold after the other, and look at the one left out; None where there is only one group.

    Raises:
        CalibrationError: Of ``refit``, turned into the reason of its fold.
    """
    parts = make_folds(measured, seed)
    if len(parts) < 2:
        return None
    folds: list[Fold] = []
    sums: list[tuple[int, dict[str, _Sums]]] = []
    for groups, mine in parts:
        rows = int(mine.sum())
        try:
            nominal, whole, robot = refit(measured.rows(~mine))
        except CalibrationError as error:
            folds.append(Fold(groups=groups, rows=rows, nominal=None, fitted=None, predicted=None, reason=str(error)))
            continue
        test = measured.rows(mine)
        found = {
            "nominal": _look(robot, test, nominal),
            "fitted": _look(robot, test, whole),
        }
        sums.append(
            (rows, {"nominal": found["nominal"][0], "fitted": found["fitted"][0], "predicted": found["fitted"][1]})
        )
        nominal_errors, errors, predicted = (sums[-1][1][name].errors for name in ("nominal", "fitted", "predicted"))
        folds.append(Fold(groups=groups, rows=rows, nominal=nominal_errors, fitted=errors, predicted=predicted))
    total = {
        name: _Sums.total([each[name] for _, each in sums]).errors if sums else None
        for name in ("nominal", "fitted", "predicted")
    }
    return HeldOut(by=measured.group_name or "row", folds=tuple(folds), **total)


@dataclass(frozen=True, slots=True)
class _Sums:
    """Sums of squares and how many vectors they are of, of lengths, angles and artefacts."""

    squares: tuple[float, float, float]
    counts: tuple[int, int, int]

    @classmethod
    def total(cls, parts: Sequence[_Sums]) -> _Sums:
        squares = [sum(part.squares[k] for part in parts) for k in range(3)]
        counts = [sum(part.counts[k] for part in parts) for k in range(3)]
        return cls((squares[0], squares[1], squares[2]), (counts[0], counts[1], counts[2]))

    @property
    def errors(self) -> Errors:
        length, angle, artefact = (
            float(np.sqrt(square / count)) if count else float("nan")
            for square, count in zip(self.squares, self.counts, strict=True)
        )
        return Errors(length=length, angle=angle, artefact=artefact)


def _look(robot: RobotParameters, test: Measurements, fitted: Fit) -> tuple[_Sums, _Sums]:
    """Return how far off measurements are that a fit has not seen, and how far its covariance expects them to be."""
    distances = socket_distances(test) if test.kind is Kind.SOCKET else {}
    observations = Observations(robot, replace(test, distance=None, to=None) if distances else test)
    state, own = place_test(observations, fitted)
    equations = observations.equations(state)
    scale = fitted.sigma.of(equations.scale)
    J = equations.J / scale[:, None]
    here = {parameter.name: k for k, parameter in enumerate(observations.unknowns)}
    names = [fitted.observations.unknowns[column].name for column in fitted.basis.kept]
    shared = [k for k, name in enumerate(names) if name in here]
    spread = J[:, [here[names[k]] for k in shared]]
    noise = np.ones(len(J))
    if own:
        Q, _ = np.linalg.qr(J[:, own])
        spread = spread - Q @ (Q.T @ spread)
        noise = 1.0 - (Q**2).sum(axis=1)
    covariance = fitted.covariance[np.ix_(shared, shared)]
    variance = (noise + np.einsum("ei,ij,ej->e", spread, covariance, spread)) * scale**2
    number = observations.point_names.index
    artefact = [
        float(np.linalg.norm(state.points[number(one)] - state.points[number(other)])) - distance
        for (one, other), distance in distances.items()
    ]
    found = _sums(equations.e**2, equations.scale, observations, artefact)
    return found, _sums(variance, equations.scale, observations, [])


def _sums(squares: Array, scale: NDArray[np.intp], observations: Observations, artefact: Sequence[float]) -> _Sums:
    vector = 1 if observations.measured.kind is Kind.DISTANCE else 3
    parts = [
        (float(squares[scale == which].sum()), int((scale == which).sum()) // vector) for which in (LENGTH, ANGLE)
    ]
    parts.append((float(np.sum(np.square(artefact))), len(artefact)))
    return _Sums((parts[0][0], parts[1][0], parts[2][0]), (parts[0][1], parts[1][1], parts[2][1]))


def errors_of(observations: Observations, state: State) -> Errors:
    """Return the errors of all measurements at a state; distances between sockets from the middle of their rows."""
    equations = observations.equations(state)
    mine = equations.row >= 0
    artefact: list[float] = []
    distances = socket_distances(observations.measured) if observations.measured.kind is Kind.SOCKET else {}
    if distances:
        point, count = observations.rows_of_points(), len(observations.point_names)
        off = equations.e[mine].reshape(-1, 3)
        sums = np.stack([np.bincount(point, off[:, axis], minlength=count) for axis in range(3)], axis=1)
        middle = state.points - sums / np.bincount(point, minlength=count)[:, None]
        number = observations.point_names.index
        artefact = [
            float(np.linalg.norm(middle[number(one)] - middle[number(other)])) - distance
            for (one, other), distance in distances.items()
        ]
    return _sums(equations.e[mine] ** 2, equations.scale[mine], observations, artefact).errors


def place_test(observations: Observations, fitted: Fit) -> tuple[State, list[int]]:
    """Return a state for other measurements, and columns of its unknowns that the fit knew nothing of.

    Stations and sockets that the fit knew are where it has them; others are fitted to these measurements.
    """
    before = fitted.observations
    known = {parameter.name for parameter in before.unknowns}
    own = [k for k, each in enumerate(observations.unknowns) if each.group is None and each.name not in known]
    best: tuple[float, State] | None = None
    for start in initial_states(observations, fitted.state.values, ()):
        stations, points = start.stations.copy(), start.points.copy()
        for names, now, old_names, old in (
            (observations.station_names, stations, before.station_names, fitted.state.stations),
            (observations.point_names, points, before.point_names, fitted.state.points),
        ):
            for k, name in enumerate(names):
                if name in old_names:
                    now[k] = old[old_names.index(name)]
        state = replace(start, stations=stations, points=points)
        if own:
            state = fit(observations, state, own, replace(fitted.sigma, length_known=True, angle_known=True)).state
        equations = observations.equations(state)
        cost = float(((equations.e / fitted.sigma.of(equations.scale)) ** 2).sum())
        if best is None or cost < best[0]:
            best = (cost, state)
    assert best is not None
    return best[1], own
