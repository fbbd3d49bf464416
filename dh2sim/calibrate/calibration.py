"""``calibrate``: a robot's table fitted to measurements, with all that can be said of how far to trust it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Final, TypedDict

import numpy as np
from numpy.typing import NDArray

from dh2sim.calibrate.fit import NOISY, Fit, Sigma, fit, weighted_jacobian
from dh2sim.calibrate.hayati_rows import fit_rows
from dh2sim.calibrate.held_out import Errors, errors_of, held_out_errors
from dh2sim.calibrate.identify import find_basis
from dh2sim.calibrate.initial import initial_states
from dh2sim.calibrate.measurements import Kind, Measurements
from dh2sim.calibrate.observations import Observations, State
from dh2sim.calibrate.outliers import Outlier, chi2_spread, find_outliers
from dh2sim.calibrate.parameters import Group, RobotParameters, Values
from dh2sim.calibrate.result import Calibration, ParameterResult, ParameterStatus
from dh2sim.calibrate.unknowns import prior_of, requested_columns
from dh2sim.errors import CalibrationError
from dh2sim.kinematics.chain import SpecLike, serial_spec_of
from dh2sim.messages import counted, listed
from dh2sim.robot.spec import JointType, RobotSpec
from dh2sim.typing import Array

_USELESS: Final = 3.0
"""Times the error before it, by which a table may be worse known than it is corrected."""
_TRIES: Final = 300
"""Random configurations that the error of the tool is predicted at."""
_FAR: Final = 0.1
"""m, by which a base has been moved that is not only corrected."""
_VAGUE: Final = 3e-3
"""m or rad: a standard deviation that is greater than errors of most robots."""
_UNITS: Final = {"mm": 1e-3, "cm": 1e-2, "inches": 0.0254}
_SPREAD: Final = 0.01
"""m, over which the tool must move for a unit to show."""
_GROWTH: Final = 2.0
"""Times the size of its table, that no arm is built off."""
_COARSE: Final = 0.05
"""Of the arm's size, that no measurement is as uncertain as."""
_TWISTED: Final = 0.2
"""rad."""
_MOST_NAMED: Final = 6
"""Parameters in a message."""
_ADVICE: Final = (
    "Measure more, at configurations that are spread over the limits, fit fewer parameters (unknown), or say how far "
    "off they may be (prior)."
)


class CalibrationKeywords(TypedDict, total=False):
    """What may be said of a calibration."""

    unknown: Iterable[str] | None
    prior: Mapping[str, float] | None
    robust: bool
    noise: float | tuple[float, float] | None
    held_out: bool
    seed: int


def calibrate(
    robot: SpecLike,
    measured: Measurements,
    *,
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
        measured: As ``measurements`` makes them of arrays, and ``read_measurements`` of a file.
        unknown: Groups of parameters to fit (base, tool, a, alpha, d, theta, beta), rows, or single parameters such
            as ``joint_2.theta``; by default all.
        prior: Standard deviations of what the robot file says: ``length`` (m) and ``angle`` (rad) of the table's
            numbers, or by group or parameter. Parameters that measurements do not tell stay near it.
        robust: Whether rows that are far off are found by a robust fit and left out.
        noise: Standard deviation of a component of the measurements, m, or m and rad; by default it is estimated.
        held_out: Whether to find errors at measurements that the fit has not seen.
        seed: Of random configurations and folds.

    Raises:
        CalibrationError: The measurements cannot tell what is asked of them; the text says why.
    """
    spec = serial_spec_of(robot)
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
    length, angle = noise if isinstance(noise, tuple) else (noise, noise)
    for value in (length, angle):
        if not (math.isfinite(value) and value > 0.0):
            raise CalibrationError(f"noise must be a positive number, got {value!r}")
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
        self.notes: list[str] = []
        self._require_metres()
        self._hold_what_has_no_reference()
        self.free = {k for k in self.free if k not in self.held}
        self.groups = {self.parameters[k].group for k in self.free} - {None}
        self.prior_given = dict(prior or {})
        self.prior = prior_of(self.robot, self.prior_given, self.free, Observations(self.robot, measured))

    def _require_metres(self) -> None:
        """Raise an error if positions are spread as many times wider than the table's as a unit is."""
        measured = self.measured
        if measured.kind not in (Kind.POSE, Kind.POSITION) or measured.position is None:
            return
        _, p = self.robot.tool_poses(self.robot.start, measured.q)
        expected, found = (float(np.sqrt(np.var(points, axis=0).sum())) for points in (p, measured.position))
        for unit, size in _UNITS.items():
            for times, given, meant in ((1.0 / size, unit, "m"), (size, "m", unit)):
                if abs(found - times * expected) < 0.1 * times * expected and expected > _SPREAD:
                    raise CalibrationError(
                        f"{self._what(measured)}: positions are spread over {found:.3g} m, where the table says "
                        f"{expected:.3g} m: they look like {given} taken for {meant}"
                    )

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
        self._require_enough(observations, before.state, columns)
        sigma = replace(self.sigma, length=before.sigma.length, angle=before.sigma.angle)
        whole = fit(observations, before.state, columns, sigma, prior=self.prior, robust=self.robust)
        self._require_useful(before, whole)
        if not whole.settled:
            raise CalibrationError(
                f"{self._what(measured)}: the fit does not settle after {counted(whole.iterations, 'step')}: the "
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

    def _what(self, measured: Measurements) -> str:
        where = f"{measured.file}: " if measured.file else ""
        rows = counted(
            len(measured),
            {Kind.POSE: "pose", Kind.POSITION: "position", Kind.DISTANCE: "distance"}.get(measured.kind, "row"),
        )
        if measured.groups is None:
            return f"{where}{rows}"
        return f"{where}{rows} of {counted(len(set(measured.groups)), measured.group_name or 'group')}"

    def _require_enough(self, observations: Observations, state: State, columns: Sequence[int]) -> None:
        """Raise an error if the measurements cannot tell parameters that others of their kind could."""
        if self.prior is not None:
            return
        measured, robot = observations.measured, len(self.parameters)
        J = weighted_jacobian(observations, state, self.sigma)
        basis = find_basis(J, observations.unknowns, columns)
        could = self.possible(observations, state, self.sigma)
        mine = {k for k in basis.kept if k < robot}
        count = f"{len(could)} parameters of the robot" + (
            f" and {len(observations.unknowns) - robot} of the measurement"
            if len(observations.unknowns) > robot
            else ""
        )
        if len(J) < len(could) + len(basis.kept) - len(mine):
            raise CalibrationError(
                f"{self._what(measured)} cannot fix {count}: they are only {counted(len(J), 'equation')}. {_ADVICE}"
            )
        if len(mine) >= len(could):
            return
        missing = [self.parameters[k].name for k in sorted(could - mine)]
        still = _still_joints(self.robot.spec, measured.q)
        if len(still) == self.robot.n:
            why = " No joint moves."
        else:
            why = f" {listed(still)} {'does' if len(still) == 1 else 'do'} not move." if still else ""
        raise CalibrationError(
            f"{self._what(measured)} cannot fix {count}: they determine only {len(mine)} of them, not "
            f"{_some(missing)}.{why} {_ADVICE}"
        )

    def _require_useful(self, before: Fit, whole: Fit) -> None:
        """Raise an error if the fit is worth less than the table as it was."""
        if self.prior is not None:
            return
        measured = whole.observations.measured
        q = random_vectors(self.robot.spec, self.measured.q, _TRIES, self.seed)
        start = self.robot.start
        extent = _extent(self.robot, start, q, tool=False)
        found = _extent(self.robot, whole.state.values, q, tool=False)  # a tool may be any other than the table's
        size = max(extent, _extent(self.robot, start, q, tool=True))
        if size > _SPREAD and not (1.0 / _GROWTH - 1.0) * size < found - extent < (_GROWTH - 1.0) * size:
            raise CalibrationError(
                f"{self._what(measured)}: they would make the arm {found / max(extent, 1e-12):.4g} times as large as "
                "its table says: lengths are in another unit, or the robot is not the one that was measured"
            )
        if size > _SPREAD and whole.sigma.length > _COARSE * size and not whole.sigma.length_known:
            raise CalibrationError(
                f"{self._what(measured)}: what is left is {1e3 * whole.sigma.length:.3g} mm a component, of an arm "
                f"that gets around by {1e3 * size:.3g} mm: columns or rows are exchanged, a sign is wrong, or the "
                "robot is not the one that was measured"
            )
        known = self._predicted(whole, q).length
        was = errors_of(before.observations, before.state).length
        if known > _USELESS * max(was, 3.0 * whole.sigma.length):
            count = counted(sum(k < len(self.parameters) for k in whole.basis.kept), "parameter")
            raise CalibrationError(
                f"{self._what(measured)} cannot fix {count}: the tool would be known to {1e3 * known:.3g} mm inside "
                f"the limits, and is {1e3 * was:.3g} mm off as it is. {_ADVICE}"
            )

    def possible(self, observations: Observations, state: State, sigma: Sigma) -> set[int]:
        """Return the parameters that as many measurements could tell, at configurations all over the limits."""
        columns = self._columns(observations)
        count = max(200, 4 * len(columns))
        anywhere = observations.with_random_rows(random_vectors(self.robot.spec, self.measured.q, count, self.seed))
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
        q = random_vectors(self.robot.spec, measured.q, _TRIES, self.seed)
        J = weighted_jacobian(observations, state, whole.sigma.at_most(NOISY))
        alone = find_basis(J, observations.unknowns, self._columns(observations), scale=1.0)
        outliers = find_outliers(whole, dropped, robust=self.robust)
        results = self._parameters(whole, values)
        notes = [*self.notes, *self._remarks(whole, outliers)]
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

    def _remarks(self, whole: Fit, outliers: Sequence[Outlier]) -> list[str]:
        notes = []
        spread, per_dof = chi2_spread(whole.dof), whole.chi2_per_dof
        if whole.sigma.length_known and whole.dof > 0 and abs(per_dof - 1.0) > 4.0 * spread:
            notes.append(
                f"What is left is {math.sqrt(per_dof):.3g} times the noise that was given: "
                + (
                    "there is more than noise and the table's numbers (backlash, bending, outliers), or the noise is "
                    "greater. The standard deviations do not account for that."
                    if per_dof > 1.0
                    else "the noise is less."
                )
            )
        if whole.dof < 10:
            notes.append(
                f"There are only {whole.dof} more equations than parameters: what is left says little about the "
                "noise."
            )
        away = float(np.linalg.norm(whole.state.values.base[:3, 3] - self.robot.spec.base.pose.xyz))
        if away > _FAR:
            notes.append(
                f"base_link is the frame of the measurements now, {away:.3g} m from where it was; with a station "
                "for each row it would stay. Gravity in the robot file is as it was: check it if the frame is not "
                "level."
            )
        vague = [
            self.parameters[column].name
            for k, column in enumerate(whole.basis.kept)
            if column < len(self.parameters) and math.sqrt(whole.covariance[k, k]) > _VAGUE
        ]
        if vague:
            notes.append(
                f"{listed(vague)} {'is' if len(vague) == 1 else 'are'} determined to no better than "
                f"{1e3 * _VAGUE:g} mm or mrad: only together do these numbers mean anything. A prior keeps them near "
                "the robot file's."
            )
        change = self.robot.change(whole.state.values, self.robot.start)
        twisted = [
            parameter.name
            for k, parameter in enumerate(self.parameters)
            if parameter.group in (Group.ALPHA, Group.BETA) and abs(change[k]) > _TWISTED
        ]
        if twisted:
            notes.append(
                f"{listed(twisted)} changed by more than any arm is built off: columns may be exchanged, a joint may "
                "turn the other way, or the robot is not the one that was measured."
            )
        copies = _copies(whole.observations.measured)
        if copies:
            notes.append(
                f"{counted(copies, 'row')} {'is an exact copy' if copies == 1 else 'are exact copies'} of another: "
                "remove what was not measured again, since each row counts."
            )
        if outliers and not self.robust:
            notes.append("There are outliers; a robust fit leaves them out.")
        return notes


def _misfit(observations: Observations, state: State) -> float:
    """Return how bad a start is; rows that are far off do not decide."""
    size = np.abs(observations.equations(state).e)
    return float(np.minimum(size, 10.0 * np.median(size) + 1e-12).sum())


def _copies(measured: Measurements) -> int:
    """Return how many rows are exact copies of rows before them, in what was measured and where."""
    count = len(measured)
    given = (measured.q, measured.position, measured.rotation, measured.distance)
    numbers = np.concatenate([each.reshape(count, -1) for each in given if each is not None], axis=1)
    names = (
        texts or ("",) * count
        for texts in (measured.station, measured.placement, measured.socket, measured.to, measured.pair)
    )
    return count - len(set(zip((row.tobytes() for row in numbers), *names, strict=True)))


def _extent(robot: RobotParameters, values: Values, q: Array, *, tool: bool) -> float:
    """Return how far the last DH frame, or tool0, gets around: the rms distance from its mean position, m."""
    _, p = robot.tool_poses(values if tool else replace(values, tool=np.eye(4)), q)
    return float(np.sqrt(((p - p.mean(axis=0)) ** 2).sum(axis=1).mean()))


def _some(names: Sequence[str]) -> str:
    if len(names) <= _MOST_NAMED + 1:
        return listed(names)
    return f"{listed(names[:_MOST_NAMED])} and {len(names) - _MOST_NAMED} others"


def _still_joints(spec: RobotSpec, q: Array) -> list[str]:
    names = [row.name for row in spec.moving_rows]
    return [name for name, spread in zip(names, np.ptp(q, axis=0).tolist(), strict=True) if spread < 1e-3]


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
