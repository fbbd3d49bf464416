"""Which configurations to measure: those that determine the tool best, inside limits and without self-contact.

They are chosen among random ones by exchange after T. J. Mitchell, An algorithm for the construction of D-optimal
experimental designs, Technometrics 16(2), 1974 (DETMAX): in turns, the candidate that adds most to the determinant of
the information is taken in, and the configuration that adds least is dropped, on the identifiable parameters. Then
configurations are exchanged for those that make the predicted error of the tool least (I-optimality), and at last
each is moved, after R. K. Meyer, C. J. Nachtsheim, The coordinate-exchange algorithm for constructing exact
optimal experimental designs, Technometrics 37(1), 1995.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.arguments import whole_number
from dh2sim.calibrate.calibration import random_vectors
from dh2sim.calibrate.hayati_rows import fit_rows
from dh2sim.calibrate.identify import find_basis
from dh2sim.calibrate.measurements import OTHER_KINDS, Kind, noise_sigmas
from dh2sim.calibrate.parameters import Group, Parameter, RobotParameters, Values
from dh2sim.errors import CalibrationError
from dh2sim.kinematics.chain import serial_spec_of
from dh2sim.messages import counted, member
from dh2sim.model.build import build_model
from dh2sim.mujoco_warnings import mujoco_warnings
from dh2sim.robot.spec import RobotSpec, SpecLike
from dh2sim.typing import Array, read_only

if TYPE_CHECKING:
    from dh2sim.model.robot_model import RobotModel

CANDIDATES: Final = 1500
MOST: Final = 1000
"""Configurations of a plan: choosing takes time in proportion to their square."""
MOST_JOINTS: Final = 50
"""That move, of a robot that is planned for."""
_HOPELESS: Final = 200
"""Candidates in a row at which links touch each other."""
_EXCHANGES: Final = 20
"""For each configuration of the plan, at most."""
_PASSES: Final = 3
_STARTS: Final = 2
_STEPS: Final = tuple(0.2 * 0.76**k for k in range(12))
"""Standard deviations of the moves that are tried of a configuration, in parts of the range of its joints."""
_MOVES: Final = 64
"""Tried of each configuration at each of these."""
_MOVED: Final = 100
"""Configurations of the greatest plan that is refined so: for more there is nothing to gain."""
_RANDOM: Final = 101
"""Random choices that a plan is compared with."""
_UNSEEN: Final = 400
"""Configurations that errors are predicted at."""
_RIDGE: Final = 1e-10
"""Of the greatest information, for choices that are too few to tell everything by themselves."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """Configurations to measure, in an order of short ways."""

    q: Array
    """Joint vectors, rad and m, shape (N, n)."""
    kind: Kind
    parameters: int
    """Of the robot, that such measurements tell."""
    error: float
    """Predicted rms error of the tool inside the limits, by the sigma of a component: 0.5 is half as much."""
    random_error: float
    """Median of as many random configurations."""
    touching: int
    """Candidates that were left out since links touch each other."""
    noise: float
    """Sigma of a component, m."""
    note: str = ""

    def __repr__(self) -> str:
        return f"<Plan: {counted(len(self.q), 'configuration')}, {self.kind.value}s, error {self.error:.3g} sigma>"


def plan_measurements(
    robot: SpecLike,
    count: int,
    *,
    kind: Kind | str = Kind.POSITION,
    noise: float | tuple[float, float] = 1e-4,
    seed: int = 0,
) -> Plan:
    """Choose configurations to measure a robot at.

    Args:
        robot: A serial robot.
        count: How many to choose.
        kind: Of the measurements: 'pose', 'position' or 'distance' (from three points around the arm). Where tool0 is
            on the last axis, positions and distances are taken to be those of a point beside it, as a reflector is.
        noise: Sigma of a component, m, or m and rad.
        seed: Of the random candidates.

    Raises:
        CalibrationError: There are too few to tell the parameters, or the kind cannot be planned.
    """
    spec = serial_spec_of(robot)
    wanted = member(Kind, OTHER_KINDS.get(str(kind), str(kind)), "kind")
    if wanted is Kind.SOCKET:
        raise CalibrationError(
            "configurations for sockets cannot be chosen freely: the ball has to be in one; plan poses or positions"
        )
    count, seed = whole_number("count", count, least=1), whole_number("seed", seed)
    if count > MOST:
        raise CalibrationError(f"the number of configurations must be at most {MOST}, got {count}")
    length, angle = noise_sigmas(noise)
    joints = len(spec.moving_rows)
    if not joints:
        raise CalibrationError(f"{spec.name} has no joint that moves")
    if joints > MOST_JOINTS:
        raise CalibrationError(f"{joints} joints move; configurations are chosen for at most {MOST_JOINTS}")
    contact = _SelfContact(build_model(spec))
    q, touching = contact.free(max(CANDIDATES, 4 * count), np.random.default_rng(seed))
    design, note = _design(spec, q, wanted, (length, angle), seed)
    if count * design.equations < design.unknowns:
        least = math.ceil(design.unknowns / design.equations)
        raise CalibrationError(
            f"{count} configurations give {count * design.equations} equations, which cannot determine "
            f"{design.unknowns} parameters: at least {least} are needed, and more to estimate the noise"
        )
    rows, target = design.rows(q), design.target
    rng = np.random.default_rng(seed)
    errors = [_error(rows[rng.choice(len(q), count, replace=False)], target) for _ in range(_RANDOM)]
    best: tuple[float, NDArray[np.intp]] | None = None
    for _ in range(_STARTS):
        chosen = _refined(rows, _exchanged(rows, rng.choice(len(q), count, replace=False)), target)
        error = _error(rows[chosen], target)
        if best is None or error < best[0]:
            best = (error, chosen)
    assert best is not None
    chosen_q = q[best[1]]
    if count <= _MOVED:
        chosen_q = _moved(design, chosen_q, contact, rng)
    return Plan(
        q=read_only(_short_way(chosen_q, spec)),
        kind=wanted,
        parameters=design.parameters,
        error=_error(design.rows(chosen_q), target) / length,
        random_error=float(np.median(errors)) / length,
        touching=touching,
        noise=length,
        note=note,
    )


class _SelfContact:
    """Where links of a robot touch each other, by MuJoCo."""

    def __init__(self, model: RobotModel) -> None:
        """Compile the model."""
        import mujoco

        from dh2sim.engines.mujoco_model import compile_robot

        self.lower, self.upper = model.travel
        self._compiled, _ = compile_robot(model)
        self._data = mujoco.MjData(self._compiled)

    def at(self, q: Array) -> bool:
        """Return whether any links touch at a joint vector."""
        import mujoco

        self._data.qpos[:] = q
        with mujoco_warnings():  # of a great many contacts, which say no more than one does
            mujoco.mj_kinematics(self._compiled, self._data)
            mujoco.mj_collision(self._compiled, self._data)
        return bool(self._data.ncon)

    def free(self, count: int, rng: np.random.Generator) -> tuple[Array, int]:
        """Return random joint vectors inside the limits at which no links touch, and at how many others they do."""
        found: list[Array] = []
        touching = 0
        for _ in range(10 * count):
            q = rng.uniform(self.lower, self.upper)
            if self.at(q):
                touching += 1
                if touching == _HOPELESS and not found:
                    break
                continue
            found.append(q)
            if len(found) == count:
                break
        if len(found) < count // 10:
            raise CalibrationError("links touch each other at nearly all configurations inside the limits")
        return np.array(found), touching


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Design:
    """What measurements at any configurations determine, in coordinates in which candidates together determine 1."""

    setup: _Setup
    columns: NDArray[np.intp]
    """The identifiable unknowns."""
    whiten: Array
    """From them to the coordinates, shape (unknowns, unknowns)."""
    target: Array
    """Mean of JᵀJ of the tool's position inside the limits, by the coordinates, shape (unknowns, unknowns)."""
    equations: int
    """Of a configuration."""
    parameters: int
    """Of the robot, among the unknowns."""

    @property
    def unknowns(self) -> int:
        return len(self.columns)

    def rows(self, q: Array) -> Array:
        """Return the derivatives of what is measured, in sigmas, shape (N, equations, unknowns)."""
        return np.asarray(self.setup.rows(q)[:, :, self.columns] @ self.whiten)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Setup:
    """What is measured, and with which noise."""

    parameters: RobotParameters
    values: Values
    kind: Kind
    sigma: tuple[float, float]
    """m and rad."""
    points: Array | None
    """That distances lead to, in base_link, m, shape (S, 3)."""

    def rows(self, q: Array) -> Array:
        """Return derivatives by all parameters, and by the points behind them, in sigmas."""
        length, angle = self.sigma
        _, p, J = self.parameters.jacobian(self.values, q)
        if self.kind is Kind.POSE:
            return np.asarray(J / np.repeat([length, angle], 3)[:, None])
        if self.points is None:
            return np.asarray(J[:, :3] / length)
        gap = p[:, None] - self.points
        along = gap / np.linalg.norm(gap, axis=2)[:, :, None]
        robot = np.einsum("nsi,nik->nsk", along, J[:, :3])
        robot[:, :, :6] = 0.0  # where the arm is, nothing says
        own = np.zeros((len(q), len(self.points), 3 * len(self.points)))
        for s in range(len(self.points)):
            own[:, s, 3 * s : 3 * s + 3] = -along[:, s]
        return np.asarray(np.concatenate([robot, own], axis=2) / length)

    def identifiable(self, q: Array) -> tuple[int, ...]:
        """Return the columns that measurements at these configurations determine."""
        own = 0 if self.points is None else 3 * len(self.points)
        unknowns = [
            *self.parameters.parameters,
            *(Parameter(name=f"station {k}", group=None, is_angle=False) for k in range(own)),
        ]
        columns = [k for k, each in enumerate(unknowns) if self.points is None or each.group is not Group.BASE]
        return find_basis(self.rows(q).reshape(-1, len(unknowns)), unknowns, columns).kept


def _design(spec: RobotSpec, q: Array, kind: Kind, sigma: tuple[float, float], seed: int) -> tuple[_Design, str]:
    """Return what measurements determine, by candidates, and a note of where the tool is taken to be."""
    parameters = RobotParameters(fit_rows(spec))
    setup = _Setup(
        parameters=parameters,
        values=parameters.start,
        kind=kind,
        sigma=sigma,
        points=_stations(parameters, q) if kind is Kind.DISTANCE else None,
    )
    kept, note = setup.identifiable(q), ""
    if kind is not Kind.POSE:
        beside = replace(setup, values=_beside(parameters, q))
        more = beside.identifiable(q)
        if len(more) > len(kept):
            note = (
                f"tool0 is on the last axis, where its position determines {len(more) - len(kept)} parameters less: "
                "the plan is for a point beside it, at "
                f"{', '.join(f'{value:.3g}' for value in beside.values.tool[:3, 3].tolist())} m in the last DH frame."
            )
            setup, kept = beside, more
    columns = np.array(kept, dtype=np.intp)
    rows = setup.rows(q)[:, :, columns]
    scale = np.linalg.norm(rows.reshape(-1, len(columns)), axis=0) / math.sqrt(len(q))
    _, S, Vt = np.linalg.svd((rows / scale).reshape(-1, len(columns)), full_matrices=False)
    whiten = (Vt.T / S * math.sqrt(len(q))) / scale[:, None]
    robot = columns[columns < len(parameters.parameters)]
    _, _, J = parameters.jacobian(setup.values, random_vectors(spec, q, _UNSEEN, seed + 1))
    unseen = J[:, :3][:, :, robot] @ whiten[: len(robot)]
    return _Design(
        setup=setup,
        columns=columns,
        whiten=whiten,
        target=np.einsum("nai,naj->ij", unseen, unseen) / _UNSEEN,
        equations=rows.shape[1],
        parameters=len(robot),
    ), note


def _stations(parameters: RobotParameters, q: Array) -> Array:
    """Return three fixed points around the arm, beyond where the tool gets, shape (3, 3)."""
    _, p = parameters.tool_poses(parameters.start, q)
    middle, reach = p.mean(axis=0), float(np.linalg.norm(p - p.mean(axis=0), axis=1).max())
    turns = np.radians([10.0, 130.0, 250.0])
    around = np.stack([np.cos(turns), np.sin(turns), np.array([0.3, -0.2, 0.5])], axis=1)
    return np.asarray(middle + 1.3 * reach * around)


def _beside(parameters: RobotParameters, q: Array) -> Values:
    """Return values with tool0 beside where it is, by a tenth of the arm's size."""
    values = parameters.start
    _, p = parameters.tool_poses(values, q)
    tool = values.tool.copy()
    tool[:3, 3] += 0.1 * float(np.linalg.norm(p - p.mean(axis=0), axis=1).max()) * np.array([0.5, 0.3, 1.0])
    return replace(values, tool=tool)


def _information(rows: Array) -> Array:
    G = np.einsum("nki,nkj->ij", rows, rows)
    return np.asarray(G + _RIDGE * np.trace(G) / len(G) * np.eye(len(G)))


def _error(rows: Array, target: Array) -> float:
    """Return the predicted rms error of the tool, m."""
    return math.sqrt(float(np.trace(np.linalg.solve(_information(rows), target))))


def _exchanged(rows: Array, chosen: NDArray[np.intp]) -> NDArray[np.intp]:
    """Exchange configurations one by one, as long as that raises the determinant of the information."""
    taken = chosen.tolist()
    one = np.eye(rows.shape[1])
    for _ in range(_EXCHANGES * len(taken)):
        G = _information(rows[taken])
        half = rows @ np.linalg.cholesky(np.linalg.inv(G))
        gain = np.linalg.slogdet(one + half @ half.transpose(0, 2, 1))[1]
        gain[taken] = -np.inf
        new = int(gain.argmax())
        G = G + rows[new].T @ rows[new]
        more = [*taken, new]
        half = rows[more] @ np.linalg.cholesky(np.linalg.inv(G))
        loss = np.linalg.slogdet(one - half @ half.transpose(0, 2, 1) * (1.0 - 1e-12))[1]
        drop = int(loss.argmax())
        if drop == len(taken):
            break
        taken = [each for k, each in enumerate(more) if k != drop]
    return np.array(taken, dtype=np.intp)


def _gain(rows: Array, rest: Array, target: Array) -> Array:
    """Return by how much each of ``rows`` lowers the predicted variance of the tool, beside configurations taken.

    Args:
        rows: Of one configuration each, shape (N, equations, unknowns).
        rest: Of those taken, shape (M, equations, unknowns).
        target: Of the design.
    """
    half = rows @ np.linalg.inv(_information(rest))
    inside = np.eye(rows.shape[1]) + half @ rows.transpose(0, 2, 1)
    return np.asarray(np.trace(np.linalg.solve(inside, half @ target @ half.transpose(0, 2, 1)), axis1=1, axis2=2))


def _refined(rows: Array, chosen: NDArray[np.intp], target: Array) -> NDArray[np.intp]:
    """Exchange configurations in turns for whichever makes the predicted error least, as long as it becomes less."""
    taken = chosen.tolist()
    error = _error(rows[taken], target)
    for _ in range(_PASSES):
        before = error
        for k in range(len(taken)):
            rest = [each for j, each in enumerate(taken) if j != k]
            gain = _gain(rows, rows[rest], target)
            gain[rest] = -np.inf
            taken[k] = int(gain.argmax())
        error = _error(rows[taken], target)
        if error > before * (1.0 - 1e-3):
            break
    return np.array(taken, dtype=np.intp)


def _moved(design: _Design, q: Array, contact: _SelfContact, rng: np.random.Generator) -> Array:
    """Move configurations in turns, by random steps that become smaller, to where the predicted error is least."""
    q = q.copy()
    rows = design.rows(q)
    for step in _STEPS:
        for k in range(len(q)):
            moves = step * rng.normal(size=(_MOVES, q.shape[1])) * (rng.random((_MOVES, q.shape[1])) < 0.5)
            near = np.clip(q[k] + moves * (contact.upper - contact.lower), contact.lower, contact.upper)
            new = design.rows(near)
            gain = _gain(np.concatenate([rows[k : k + 1], new]), np.delete(rows, k, axis=0), design.target)
            for best in np.argsort(-gain[1:], kind="stable").tolist():
                if gain[1 + best] <= gain[0]:
                    break
                if not contact.at(near[best]):
                    q[k], rows[k] = near[best], new[best]
                    break
    return q


def _short_way(q: Array, spec: SpecLike) -> Array:
    """Return joint vectors in an order in which each is near the one before, from the one nearest to home."""
    robot = serial_spec_of(spec)
    spread = np.maximum(np.ptp(q, axis=0), 1e-9)
    place = robot.named_configurations["home"] / spread
    left, order = list(range(len(q))), []
    while left:
        nearest = min(left, key=lambda k: float(np.abs(q[k] / spread - place).max()))
        left.remove(nearest)
        order.append(nearest)
        place = q[nearest] / spread
    return q[order]
