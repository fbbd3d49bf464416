"""``calibrate_robot``: a robot's table fitted to measurements, with all that can be said of how far to trust it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from os import PathLike
from typing import Final, TypedDict

import numpy as np
from numpy.typing import NDArray

from dh2sim.calibrate.data_file import read_measurements
from dh2sim.calibrate.fit import NOISY, Fit, Sigma, fit, weighted_jacobian
from dh2sim.calibrate.hayati_rows import fit_rows
from dh2sim.calibrate.held_out import Errors, errors_of, held_out_errors
from dh2sim.calibrate.identify import find_basis
from dh2sim.calibrate.initial import initial_states
from dh2sim.calibrate.measurements import Kind, Measurements, noise_sigmas
from dh2sim.calibrate.observations import Observations, State
from dh2sim.calibrate.outliers import find_outliers
from dh2sim.calibrate.parameters import Group, RobotParameters, Values
from dh2sim.calibrate.plausibility import (
    described,
    remarks,
    require_enough,
    require_improvement,
    require_metres,
    require_size,
)
from dh2sim.calibrate.result import Calibration, ParameterResult, ParameterStatus
from dh2sim.calibrate.unknowns import prior_of, requested_columns
from dh2sim.errors import ArgumentError, CalibrationError
from dh2sim.kinematics.chain import serial_spec_of
from dh2sim.messages import counted
from dh2sim.robot.row import JointType
from dh2sim.robot.spec import RobotSpec, SpecLike
from dh2sim.typing import Array

_TRIES: Final = 300
"""Random configurations that the error of the tool is predicted at."""


class CalibrationKeywords(TypedDict, total=False):
    """What may be said of a calibration."""

    kind: Kind | str | None
    groups: str | None
    unknown: Iterable[str] | None
    prior: Mapping[str, float] | None
    robust: bool
    noise: float | tuple[float, float] | None
    held_out: bool
    seed: int


def calibrate_robot(
    robot: SpecLike,
    data: Measurements | str | PathLike[str],
    *,
    kind: Kind | str | None = None,
    groups: str | None = None,
    unknown: Iterable[str] | None = None,
    prior: Mapping[str, float] | None = None,
    robust: bool = False,
    noise: float | tuple[float, float] | None = None,
    held_out: bool = True,
    seed: int = 0,
) -> Calibration:
    """Fit a robot's table, base and tool to measurements.

    Args:
        robot: A serial robot, as its maker describes it.
        data: A CSV file, as ``docs/calibration.md`` describes it; or what ``measurements`` makes of arrays, or
            ``run_measurements`` of a run.
        kind: What a file contains, 'pose', 'position', 'distance' or 'socket'; by default seen by its columns.
        groups: Column of a file; rows with the same value are held out together.
        unknown: Groups of parameters to fit (base, tool, a, alpha, d, theta, beta), rows, or single parameters such
            as ``joint_2.theta``; by default all.
        prior: Standard deviations of what the robot file says: ``length`` (m) and ``angle`` (rad) of the table's
            numbers, or by group or parameter. Parameters that measurements do not tell stay near it.
        robust: Whether rows that are far off are found by a robust fit and left out.
        noise: Standard deviation of a component of the measurements, m, or m and rad; by default it is estimated.
        held_out: Whether to find errors at measurements that the fit has not seen.
        seed: Of random configurations and folds.

    Raises:
        MeasurementFileError: The file is wrong; the text says what and where.
        CalibrationError: The measurements cannot tell what is asked of them; the text says why.
    """
    spec = serial_spec_of(robot)
    measured = read_measurements(data, spec, kind=kind, groups=groups) if isinstance(data, str | PathLike) else data
    if not isinstance(measured, Measurements):
        raise ArgumentError(f"data must be measurements or the path of a file, got {type(data).__name__}")
    sigma = _sigma(noise)
    task = _Task(spec, measured, unknown, prior, robust=robust, sigma=sigma, seed=seed)
    before, whole = task.solve(measured)
    dropped: NDArray[np.intp] = np.zeros(0, dtype=np.intp)
    if robust:
        whole, dropped = task.without_outliers(whole)
    result = task.result(before, whole, dropped)
    if not held_out:
        return result
    kept = np.setdiff1d(np.arange(len(measured)), dropped)

    def refit(rows: Measurements) -> tuple[Fit, Fit, RobotParameters]:
        nominal, fitted = task.solve(rows)
        return nominal, fitted, task.robot

    return replace(result, held_out=held_out_errors(measured.rows(kept), refit, seed=seed))


def _sigma(noise: float | tuple[float, float] | None) -> Sigma:
    if noise is None:
        return Sigma(length=1e-3, angle=1e-3, length_known=False, angle_known=False)
    length, angle = noise_sigmas(noise)
    return Sigma(length=length, angle=angle)


class _Task:
    """What is to be fitted, and to which measurements."""

    def __init__(
        self,
        spec: RobotSpec,
        measured: Measurements,
        unknown: Iterable[str] | None,
        prior: Mapping[str, float] | None,
        *,
        robust: bool,
        sigma: Sigma,
        seed: int,
    ) -> None:
        self.original = spec
        self.measured = measured
        self.robust = robust
        self.sigma = sigma
        self.seed = seed
        self.robot = RobotParameters(fit_rows(spec))
        self.parameters = self.robot.parameters
        self.free = requested_columns(self.robot, unknown)
        self.held: dict[int, str] = dict.fromkeys(
            (k for k in range(len(self.parameters)) if k not in self.free), "not among the unknown"
        )
        self.notes = list(measured.notes)
        require_metres(self.robot, measured)
        self._hold_what_has_no_reference()
        self.free = {k for k in self.free if k not in self.held}
        self.groups = {self.parameters[k].group for k in self.free} - {None}
        self.prior_given = dict(prior or {})
        self.prior = prior_of(self.robot, self.prior_given, self.free, Observations(self.robot, measured))

    def _hold_what_has_no_reference(self) -> None:
        """Hold what places the arm as a whole, where nothing that was measured says where it is."""
        measured = self.measured
        base = [k for k, parameter in enumerate(self.parameters) if parameter.group is Group.BASE]
        if not measured.has_base:
            why = (
                "the stations' poses take its place"
                if measured.kind in (Kind.POSE, Kind.POSITION)
                else ("nothing that was measured says where base_link is")
            )
            self.held |= {k: why for k in base if k in self.free}
        if measured.kind is not Kind.SOCKET:
            return
        first = self.robot.before_first_motion()
        self.held |= {k: "it moves the arm with all sockets" for k in first if k in self.free}
        known = measured.distance is not None and np.isfinite(measured.distance).any()
        lengths = [
            k
            for k in self.free
            if k not in self.held and not self.parameters[k].is_angle and self.parameters[k].row >= 0
        ]
        slides = any(row.type is JointType.PRISMATIC for row in self.robot.spec.rows)
        tool = {k for k in self.free if self.parameters[k].group is Group.TOOL}
        if known or slides or not (lengths and tool):
            return
        start = self.robot.start
        sizes = {k: abs(start.rows[self.parameters[k].row][str(self.parameters[k].group)]) for k in lengths}
        longest = max(sizes, key=lambda k: sizes[k])
        every = {
            k
            for k, parameter in enumerate(self.parameters)
            if parameter.row >= 0
            and not parameter.is_angle
            and k not in first
            and start.rows[parameter.row][str(parameter.group)] != 0.0
        }
        if sizes[longest] > 0.0 and every <= set(lengths):
            self.held[longest] = "the scale: no distance between sockets is known"
            self.notes.append(
                "No distance between sockets is known, so lengths can only be determined relative to "
                f"{self.parameters[longest].name}, which is held at {sizes[longest]:g} m."
            )

    # -------------------------------------------------------------------- fits

    def solve(self, measured: Measurements) -> tuple[Fit, Fit]:
        """Fit base, tool and what belongs to the measurement, then everything.

        Raises:
            CalibrationError: The measurements cannot tell it.
        """
        observations = Observations(self.robot, measured)
        setup = [
            k
            for k, parameter in enumerate(observations.unknowns)
            if parameter.group is None or (k in self.free and parameter.group in (Group.BASE, Group.TOOL))
        ]
        groups = {group for group in self.groups if group is not None}
        starts = initial_states(observations, self.robot.start, groups)
        starts.sort(key=lambda state: _misfit(observations, state))
        before = fit(observations, starts[0], setup, self.sigma, robust=self.robust)
        columns = self._columns(observations)
        if self.prior is None:
            J = weighted_jacobian(observations, before.state, self.sigma)
            require_enough(observations, J, columns, self.possible(observations, before.state, self.sigma))
        sigma = replace(self.sigma, length=before.sigma.length, angle=before.sigma.angle)
        whole = fit(observations, before.state, columns, sigma, prior=self.prior, robust=self.robust)
        if self.prior is None:
            q = self._random_vectors(_TRIES)
            require_size(whole, q)
            require_improvement(before, whole, self._predicted(whole, q).length)
        if not whole.settled:
            raise CalibrationError(
                f"{described(measured)}: the fit does not settle after {counted(whole.iterations, 'step')}: the "
                "robot is not the one that was measured, joint coordinates are in other units or of another order, "
                "or a prior is needed"
            )
        return before, whole

    def _columns(self, observations: Observations) -> list[int]:
        return [k for k, each in enumerate(observations.unknowns) if each.group is None or k in self.free]

    def without_outliers(self, whole: Fit) -> tuple[Fit, NDArray[np.intp]]:
        """Return the least-squares fit without the rows that a robust fit finds far off, and those rows."""
        dropped: NDArray[np.intp] = np.zeros(0, dtype=np.intp)
        for _ in range(10):
            found = np.array([outlier.row for outlier in find_outliers(whole, (), robust=True)], dtype=np.intp)
            if np.array_equal(found, dropped) and whole.weight.min(initial=1.0) in (0.0, 1.0):
                break
            dropped = found
            weight = np.where(np.isin(whole.equations.row, dropped), 0.0, 1.0)
            whole = fit(
                whole.observations,
                whole.state,
                self._columns(whole.observations),
                whole.sigma,
                prior=self.prior,
                weight=weight,
            )
        return whole, dropped

    def _random_vectors(self, count: int) -> Array:
        return random_vectors(self.robot.spec, self.measured.q, count, self.seed)

    def possible(self, observations: Observations, state: State, sigma: Sigma) -> set[int]:
        """Return the parameters that as many measurements could tell, at configurations all over the limits."""
        columns = self._columns(observations)
        count = max(200, 4 * len(columns))
        anywhere = observations.with_random_rows(self._random_vectors(count))
        points = len(anywhere.point_names)
        there = replace(state, points=state.points[:points] if points <= len(state.points) else state.points)
        J = weighted_jacobian(anywhere, there, sigma.at_most(NOISY))
        names = {parameter.name for parameter in observations.unknowns}
        extra = [
            k
            for k, parameter in enumerate(anywhere.unknowns)
            if parameter.group is None or parameter.name not in names
        ]
        mine = [*sorted(self.free), *extra]
        scale = math.sqrt(min(1.0, len(observations.measured) / len(anywhere.measured)))
        basis = find_basis(J, anywhere.unknowns, mine, scale=scale)
        return {k for k in basis.kept if k < len(self.parameters)}

    # -------------------------------------------------------------------- the result

    def result(self, before: Fit, whole: Fit, dropped: NDArray[np.intp]) -> Calibration:
        """Return all that can be said.

        Raises:
            CalibrationError: The fit is worth less than the table as it was.
        """
        observations = whole.observations
        values = self.robot.rounded(whole.state.values)
        state = replace(whole.state, values=values)
        measured = self.measured
        errors = errors_of(observations, state)
        errors_before = errors_of(observations, before.state)
        q = self._random_vectors(_TRIES)
        J = weighted_jacobian(observations, state, whole.sigma.at_most(NOISY))
        alone = find_basis(J, observations.unknowns, self._columns(observations), scale=1.0)
        outliers = find_outliers(whole, dropped, robust=self.robust)
        results = self._parameters(whole, values)
        notes = [*self.notes, *remarks(whole, outliers, robust=self.robust)]
        return Calibration(
            robot=self.robot.robot(values),
            nominal=self.robot.spec,
            original=self.original,
            measured=measured,
            parameters=results,
            fit=replace(whole, state=state),
            before=before,
            errors_before=errors_before,
            errors=errors,
            identifiable=sum(k < len(self.parameters) for k in alone.kept),
            possible=len(self.possible(observations, state, whole.sigma)),
            outliers=outliers,
            held_out=None,
            predicted=self._predicted(whole, q),
            moved=self._moved(before.state.values, values, q),
            notes=tuple(notes),
            robust=self.robust,
            prior=self.prior_given,
        )

    def _parameters(self, whole: Fit, values: Values) -> tuple[ParameterResult, ...]:
        start = self.robot.start
        changes = self.robot.change(values, start)
        sigma = dict(zip(whole.basis.kept, np.sqrt(np.diag(whole.covariance)).tolist(), strict=True))
        found = []
        for k, parameter in enumerate(self.parameters):
            assert parameter.group is not None
            own = None if parameter.row < 0 else start.rows[parameter.row][parameter.group.value]
            now = None if parameter.row < 0 else values.rows[parameter.row][parameter.group.value]
            into = whole.basis.folded.get(k, ())
            if k in self.held:
                status = ParameterStatus.HELD
            elif k in sigma:
                status = ParameterStatus.FITTED
            else:
                status = ParameterStatus.FOLDED if into else ParameterStatus.UNSEEN
            found.append(
                ParameterResult(
                    name=parameter.name,
                    group=parameter.group,
                    is_angle=parameter.is_angle,
                    status=status,
                    nominal=own,
                    value=now,
                    change=float(changes[k]),
                    sigma=sigma.get(k),
                    into=tuple(whole.observations.unknowns[column].name for column in into),
                    reason=self.held.get(k, ""),
                )
            )
        return tuple(found)

    def _predicted(self, whole: Fit, q: Array) -> Errors:
        _, _, J = self.robot.jacobian(whole.state.values, q)
        columns = [k for k in whole.basis.kept if k < len(self.parameters)]
        covariance = whole.covariance[: len(columns), : len(columns)]
        variance = np.einsum("nai,ij,naj->na", J[:, :, columns], covariance, J[:, :, columns])
        return Errors(
            length=float(np.sqrt(variance[:, :3].sum(axis=1).mean())),
            angle=float(np.sqrt(variance[:, 3:].sum(axis=1).mean())),
        )

    def _moved(self, before: Values, after: Values, q: Array) -> Errors:
        (R, p), (R_after, p_after) = (self.robot.tool_poses(values, q) for values in (before, after))
        turn = np.clip((np.einsum("nij,nij->n", R, R_after) - 1.0) / 2.0, -1.0, 1.0)
        return Errors(
            length=float(np.sqrt(((p_after - p) ** 2).sum(axis=1).mean())),
            angle=float(np.sqrt((np.arccos(turn) ** 2).mean())),
        )


def _misfit(observations: Observations, state: State) -> float:
    """Return how bad a start is; rows that are far off do not decide."""
    size = np.abs(observations.equations(state).e)
    return float(np.minimum(size, 10.0 * np.median(size) + 1e-12).sum())


def random_vectors(spec: RobotSpec, q: Array, count: int, seed: int) -> Array:
    """Return random joint vectors inside the limits; where there are none, all around or where ``q`` was.

    Args:
        spec: The robot.
        q: Joint vectors that are known, shape (N, n).
        count: How many.
        seed: Of the random number generator.
    """
    low, high = [], []
    for k, row in enumerate(spec.moving_rows):
        least, most = float(q[:, k].min()), float(q[:, k].max())
        if row.limits.position is not None:
            lower, upper = row.limits.position
        else:
            lower, upper = (-math.pi, math.pi) if row.type.turns else (least, most if most > least else least + 1.0)
        low.append(lower)
        high.append(upper)
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))
