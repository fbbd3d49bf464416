"""Which configurations to measure: those that tell the parameters best, chosen among random ones.

Exchange after T. J. Mitchell, An algorithm for the construction of D-optimal experimental designs, Technometrics
16(2), 1974 (DETMAX): in turns, the candidate that adds most to the determinant of the information is taken in, and
the configuration that adds least is dropped, on the parameters that measurements can tell. Then configurations are
exchanged for those that make the predicted error of the tool least.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dh2sim.calibrate.calibration import random_vectors
from dh2sim.calibrate.hayati_rows import fit_rows
from dh2sim.calibrate.identify import find_basis
from dh2sim.calibrate.measurements import OTHER_KINDS, Kind
from dh2sim.calibrate.parameters import Group, Parameter, RobotParameters, Values
from dh2sim.errors import CalibrationError
from dh2sim.kinematics.chain import SpecLike, serial_spec_of
from dh2sim.messages import member
from dh2sim.model.build import build_model
from dh2sim.mujoco_warnings import mujoco_warnings
from dh2sim.typing import Array, read_only

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


def plan_measurements(
    robot: SpecLike,
    count: int,
    *,
    kind: Kind | str = Kind.POSITION,
    noise: float | tuple[float, float] = 1e-4,
    stations: ArrayLike | None = None,
    seed: int = 0,
) -> Plan:
    """Choose configurations to measure a robot at.

    Args:
        robot: A serial robot.
        count: How many to choose.
        kind: Of the measurements: 'pose', 'position' or 'distance' (from points around the arm, unless ``stations``
            names them). Where tool0 is on the last axis, positions and distances are taken to be those of a point
            beside it, as a reflector is.
        noise: Sigma of a component, m, or m and rad.
        stations: Fixed points that distances lead to, in base_link, m, shape (S, 3).
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
    if count < 1:
        raise CalibrationError(f"the number of configurations must be at least 1, got {count}")
    if count > MOST:
        raise CalibrationError(f"the number of configurations must be at most {MOST}, got {count}")
    length, angle = noise if isinstance(noise, tuple) else (noise, noise)
    joints = len(spec.moving_rows)
    if joints > MOST_JOINTS:
        raise CalibrationError(f"{joints} joints move; configurations are chosen for at most {MOST_JOINTS}")
    parameters = RobotParameters(fit_rows(spec))
    q, touching = _candidates(spec, max(CANDIDATES, 4 * count), seed)
    points = _stations(parameters, q, stations) if wanted is Kind.DISTANCE else None
    values, note = parameters.start, ""
    rows = _rows(parameters, values, q, wanted, length, angle, points)
    told = _told(parameters, rows, points)
    if wanted is not Kind.POSE:
        beside = _beside(parameters, q)
        others = _rows(parameters, beside, q, wanted, length, angle, points)
        more = _told(parameters, others, points)
        if len(more) > len(told):
            note = (
                f"tool0 is on the last axis, where its position tells {len(more) - len(told)} parameters less: "
                "the plan is for a point beside it, at "
                f"{', '.join(f'{value:.3g}' for value in beside.tool[:3, 3].tolist())} m in the last DH frame."
            )
            values, rows, told = beside, others, more
    columns = np.array(told, dtype=np.intp)
    robot_columns = columns[columns < len(parameters.parameters)]
    per = rows.shape[1]
    if count * per < len(columns):
        least = math.ceil(len(columns) / per)
        raise CalibrationError(
            f"{count} configurations give {count * per} equations, which cannot tell {len(columns)} parameters: at "
            f"least {least} are needed, and more to find out the noise"
        )
    rows = rows[:, :, columns]
    scale = np.linalg.norm(rows.reshape(-1, len(columns)), axis=0) / math.sqrt(len(q))
    rows = rows / scale
    _, S, Vt = np.linalg.svd(rows.reshape(-1, len(columns)), full_matrices=False)
    whiten = Vt.T / S * math.sqrt(len(q))
    rows = rows @ whiten
    unseen = random_vectors(spec, q, _UNSEEN, seed + 1)
    _, _, J = parameters.jacobian(values, unseen)
    seen = np.zeros((_UNSEEN, 3, len(columns)))
    seen[:, :, : len(robot_columns)] = J[:, :3][:, :, robot_columns]
    seen = seen / scale @ whiten
    target = np.einsum("nai,naj->ij", seen, seen) / _UNSEEN
    rng = np.random.default_rng(seed)
    errors = [_error(rows, rng.choice(len(q), count, replace=False), target) for _ in range(_RANDOM)]
    best: tuple[float, NDArray[np.intp]] | None = None
    for _ in range(_STARTS):
        chosen = _refined(rows, _exchanged(rows, rng.choice(len(q), count, replace=False)), target)
        error = _error(rows, chosen, target)
        if best is None or error < best[0]:
            best = (error, chosen)
    assert best is not None
    return Plan(
        q=read_only(_short_way(q[best[1]], spec)),
        kind=wanted,
        parameters=len(robot_columns),
        error=best[0] / length,
        random_error=float(np.median(errors)) / length,
        touching=touching,
        noise=length,
        note=note,
    )


def _candidates(spec: SpecLike, count: int, seed: int) -> tuple[Array, int]:
    """Return random joint vectors inside the limits at which no links touch, and how many did."""
    import mujoco

    from dh2sim.engines.mujoco_model import compile_robot

    model = build_model(spec)
    lower, upper = model.travel
    compiled, _ = compile_robot(model)
    data = mujoco.MjData(compiled)
    rng = np.random.default_rng(seed)
    found: list[Array] = []
    touching = 0
    for _ in range(10 * count):
        q = rng.uniform(lower, upper)
        data.qpos[:] = q
        with mujoco_warnings():  # of a great many contacts, which say no more than one does
            mujoco.mj_kinematics(compiled, data)
            mujoco.mj_collision(compiled, data)
        if data.ncon:
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


def _stations(parameters: RobotParameters, q: Array, given: ArrayLike | None) -> Array:
    """Return fixed points: as given, or three around the arm, beyond where the tool gets."""
    if given is not None:
        points = np.asarray(given, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise CalibrationError(f"stations must be points of shape (S, 3), got shape {points.shape}")
        return points
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


def _rows(
    parameters: RobotParameters,
    values: Values,
    q: Array,
    kind: Kind,
    length: float,
    angle: float,
    points: Array | None,
) -> Array:
    """Return what is measured at each candidate, in sigmas, by all parameters, and by the stations behind them."""
    _, p, J = parameters.jacobian(values, q)
    if kind is Kind.POSE:
        return np.asarray(J / np.repeat([length, angle], 3)[:, None])
    if kind is Kind.POSITION or points is None:
        return np.asarray(J[:, :3] / length)
    gap = p[:, None] - points
    along = gap / np.linalg.norm(gap, axis=2)[:, :, None]
    robot = np.einsum("nsi,nik->nsk", along, J[:, :3])
    robot[:, :, :6] = 0.0  # where the arm is, nothing says
    own = np.zeros((len(q), len(points), 3 * len(points)))
    for s in range(len(points)):
        own[:, s, 3 * s : 3 * s + 3] = -along[:, s]
    return np.asarray(np.concatenate([robot, own], axis=2) / length)


def _told(parameters: RobotParameters, rows: Array, points: Array | None) -> tuple[int, ...]:
    own = 0 if points is None else 3 * len(points)
    unknowns = [
        *parameters.parameters,
        *(Parameter(name=f"station {k}", group=None, is_angle=False) for k in range(own)),
    ]
    columns = [k for k, each in enumerate(unknowns) if points is None or each.group is not Group.BASE]
    return find_basis(rows.reshape(-1, rows.shape[2]), unknowns, columns).kept


def _information(rows: Array, chosen: NDArray[np.intp]) -> Array:
    G = np.einsum("nki,nkj->ij", rows[chosen], rows[chosen])
    return np.asarray(G + _RIDGE * np.trace(G) / len(G) * np.eye(len(G)))


def _error(rows: Array, chosen: NDArray[np.intp], target: Array) -> float:
    """Return the predicted rms error of the tool, m."""
    return math.sqrt(float(np.trace(np.linalg.solve(_information(rows, chosen), target))))


def _exchanged(rows: Array, chosen: NDArray[np.intp]) -> NDArray[np.intp]:
    """Exchange configurations one by one, as long as that raises the determinant of the information."""
    taken = chosen.tolist()
    one = np.eye(rows.shape[1])
    for _ in range(_EXCHANGES * len(taken)):
        G = _information(rows, np.array(taken))
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


def _refined(rows: Array, chosen: NDArray[np.intp], target: Array) -> NDArray[np.intp]:
    """Exchange configurations in turns for whichever makes the predicted error least, as long as it becomes less."""
    taken = chosen.tolist()
    one = np.eye(rows.shape[1])
    error = _error(rows, chosen, target)
    for _ in range(_PASSES):
        before = error
        for k in range(len(taken)):
            rest = [each for j, each in enumerate(taken) if j != k]
            C = np.linalg.inv(_information(rows, np.array(rest, dtype=np.intp)))
            half = rows @ C
            inside = one + half @ rows.transpose(0, 2, 1)
            less = np.trace(np.linalg.solve(inside, half @ target @ half.transpose(0, 2, 1)), axis1=1, axis2=2)
            less[rest] = -np.inf
            taken[k] = int(less.argmax())
        error = _error(rows, np.array(taken), target)
        if error > before * (1.0 - 1e-3):
            break
    return np.array(taken, dtype=np.intp)


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
