"""Measures of a robot: how far, how much, how well and how heavy.

They look at one set of configurations, the same shares of the joints' ranges for every design, so that designs can be
compared. All are the better the greater they are.
"""

from __future__ import annotations

import importlib
import numbers
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, Final

import numpy as np

from dh2sim.errors import Dh2simError, MeasureError, SettingsError
from dh2sim.kinematics.forward import geometric_jacobian, joint_poses
from dh2sim.kinematics.sampling import scattered_configurations
from dh2sim.kinematics.singularity import manipulability
from dh2sim.messages import did_you_mean, listed
from dh2sim.model.robot_model import RobotModel
from dh2sim.simulate.controllers.user_code import from_here, shown_path, what_and_where
from dh2sim.typing import Array
from dh2sim.workspace.extremes import distance_from, extreme_of
from dh2sim.workspace.point import PointMap

Columns = Mapping[str, float]


class Sampled:
    """A robot, and what follows from its configurations of the sample; computed when it is first asked for."""

    def __init__(self, model: RobotModel, samples: int, voxel: float) -> None:
        """Take a robot.

        Args:
            model: The robot.
            samples: Number of configurations.
            voxel: Edge of the voxels, m.
        """
        self.model, self.samples, self.voxel = model, samples, voxel

    @cached_property
    def q(self) -> Array:
        """Configurations between the limits, ±π where there are none, rad and m, shape (samples, n)."""
        return scattered_configurations(*self.model.travel, self.samples)

    @cached_property
    def frames(self) -> Array:
        """Poses of the joint frames in base_link, shape (samples, rows, 4, 4)."""
        return joint_poses(self.model.chain, self.q)

    @cached_property
    def jacobian(self) -> Array:
        """Of tool0, shape (samples, 6, n)."""
        return geometric_jacobian(self.model.chain, self.q)

    @cached_property
    def tool(self) -> Array:
        """Positions of tool0 in base_link, m, shape (samples, 3)."""
        T = self.model.joints[-1].T_joint_dh @ self.model.chain.T_dhn_tool0
        last = self.frames[:, -1]
        return np.asarray((last[:, :3, :3] * T[:3, 3]).sum(axis=-1) + last[:, :3, 3])


def reach(robot: Sampled) -> Columns:
    """How far tool0 gets from the origin of base_link: max |p(q)| inside the limits, m.

    The best configurations of the sample are improved by Newton steps on |p|², as ``dh2sim workspace`` does.
    """
    model = robot.model
    travel = [joint.travel for joint in model.moving_joints]
    point = PointMap(model.chain, "tool0", travel, model.home, max(model.reach, 1e-9))
    if not point.joints:
        return {"reach": float(np.linalg.norm(robot.tool[0]))}
    q = robot.q[:, list(point.joints)]
    found = extreme_of(
        point, distance_from(np.zeros(3)), q, point.positions(q), lambda place: float(np.linalg.norm(place))
    )
    return {"reach": found.value}


def workspace(robot: Sampled) -> Columns:
    """How much tool0 reaches: the voxels that the sample hits, times their volume, m³.

    A lower bound, which rises with the sample; of a planar arm one layer of voxels.
    """
    cells = np.floor(robot.tool / robot.voxel).astype(np.int64)
    return {"workspace": len(np.unique(cells, axis=0)) * robot.voxel**3}


def dexterous(robot: Sampled) -> Columns:
    """How well tool0 moves: Yoshikawa's manipulability, mean and best over the sample.

    w = sqrt(det J Jᵀ), the product of the singular values of the geometric Jacobian; sqrt(det Jᵀ J) with fewer than
    six joints. Source: T. Yoshikawa, Manipulability of robotic mechanisms, Int. J. Robotics Research 4(2), 1985.
    """
    w = manipulability(robot.jacobian)
    return {"manipulability_mean": float(w.mean()), "manipulability_best": float(w.max())}


def payload(robot: Sampled) -> Columns:
    """How much it carries: the greatest mass at tool0 that all joints hold still, kg.

    At each configuration the largest m with |tau_own + m tau_1| <= effort at every joint, where tau_own holds the
    robot's own weight and tau_1 = -J_vᵀ g a kilogram at tool0, from the principle of virtual work (Spong, Hutchinson,
    Vidyasagar, Robot Modeling and Control, 2006, section 4.10). ``payload`` is the least of the sample, 0 where the
    robot cannot hold itself; ``payload_median`` half of it is better than.
    """
    own, one = gravity_torques(robot.model, robot.frames, robot.q), unit_torques(robot)
    effort = np.array([joint.effort for joint in robot.model.moving_joints])
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(one > 0.0, (effort - own) / one, (-effort - own) / one)
    room = np.where(np.abs(one) > 1e-12 * max(1.0, robot.model.reach), room, np.inf)
    most = np.where((np.abs(own) <= effort).all(axis=1), room.min(axis=1, initial=np.inf), 0.0)
    return {"payload": float(most.min()), "payload_median": float(np.median(most))}


def gravity_torques(model: RobotModel, frames: Array, q: Array) -> Array:
    """Return what the joints exert to hold the robot's own weight, N·m or N, shape (samples, n).

    Args:
        model: The robot.
        frames: Poses of the joint frames in base_link, shape (samples, rows, 4, 4).
        q: Joint vectors, shape (samples, n).
    """
    weights, points = [], []
    for i, body in enumerate(model.bodies):
        if body is not None:
            weights.append((i, body.mass))
            T = frames[:, i]
            points.append((T[:, :3, :3] * body.com).sum(axis=-1) + T[:, :3, 3])
    torques = np.zeros(q.shape)
    column = 0
    for j, joint in enumerate(model.joints):
        if not joint.type.moves:
            continue
        axis, origin = joint.sign * frames[:, j, :3, 2], frames[:, j, :3, 3]
        for (i, mass), point in zip(weights, points, strict=True):
            if i >= j:
                motion = np.cross(axis, point - origin) if joint.type.turns else axis
                torques[:, column] -= mass * (motion * model.spec.gravity).sum(axis=-1)
        column += 1
    return torques


def unit_torques(robot: Sampled) -> Array:
    """Return what the joints exert to hold a kilogram at tool0, N·m or N, shape (samples, n)."""
    return np.asarray(-(robot.jacobian[:, :3] * robot.model.spec.gravity[:, None]).sum(axis=1))


MEASURES: Final[Mapping[str, Callable[[Sampled], Columns]]] = {
    "workspace": workspace,
    "manipulability": dexterous,
    "reach": reach,
    "payload": payload,
}
"""By the name that they are asked for by."""
UNITS: Final = {"reach": "m", "workspace": "m3", "payload": "kg", "payload_median": "kg"}
"""Of columns; manipulability has that of the product of the singular values."""


def check_measures(names: Sequence[str]) -> None:
    """Check that there are these measures, and import those of users.

    Raises:
        SettingsError: There is no such measure, or none is asked for, or one twice.
        MeasureError: A user's module or function cannot be used.
    """
    problems = []
    for name in names:
        if name not in MEASURES and ":" not in name:
            guess = did_you_mean(name, MEASURES)
            known = f"Measures: {listed(MEASURES)}, or module:function of your own"
            problems.append(("measure", f"must not contain '{name}'.{guess} {known}"))
        elif list(names).count(name) > 1 and ("measure", f"must contain '{name}' once") not in problems:
            problems.append(("measure", f"must contain '{name}' once"))
    if not names:
        problems.append(("measure", f"must not be empty. Measures: {listed(MEASURES)}, or module:function"))
    if problems:
        raise SettingsError(problems)
    for name in names:
        if name not in MEASURES:
            load_function(name)


def load_function(name: str) -> Callable[[Any], object]:
    """Import the function of a measure ``module:function``, looking in the current folder first.

    Raises:
        MeasureError: It cannot be imported, or is not a function.
    """
    module_name, _, function_name = name.partition(":")
    try:
        with from_here():
            module = importlib.import_module(module_name)
    except Dh2simError:
        raise
    except (Exception, SystemExit) as error:
        raise MeasureError(f"measure '{name}': {what_and_where(error)}") from error
    found = getattr(module, function_name, None)
    if not callable(found):
        where = f"module '{module_name}'"
        if getattr(module, "__file__", None):
            where += f" ({shown_path(str(module.__file__))})"
        known = [key for key, value in vars(module).items() if callable(value) and not key.startswith("_")]
        guess = did_you_mean(function_name, known)
        raise MeasureError(f"measure '{name}': {where} has no function '{function_name}'.{guess}")
    return found  # type: ignore[no-any-return]


def measure(
    names: Sequence[str], sampled: Sampled, wrap: Callable[[RobotModel], object] = lambda model: model
) -> dict[str, float]:
    """Return the values of measures, by column.

    Args:
        names: Of the measures.
        sampled: The robot.
        wrap: Makes what functions of users are given.

    Raises:
        MeasureError: A function of a user fails, or returns something else than a number or numbers by name.
    """
    columns: dict[str, float] = {}
    for name in names:
        found: Mapping[str, float]
        if name in MEASURES:
            found = MEASURES[name](sampled)
        else:
            found = _of_user(name, wrap(sampled.model))
        taken = [column for column in found if column in columns]
        if taken:
            raise MeasureError(f"measure '{name}': its column '{taken[0]}' is that of another measure")
        columns |= found
    return columns


def _of_user(name: str, robot: object) -> dict[str, float]:
    function = load_function(name)
    try:
        found = function(robot)
    except Dh2simError:
        raise
    except (Exception, SystemExit) as error:
        raise MeasureError(f"measure '{name}': {what_and_where(error)}") from error
    values: Mapping[Any, Any] = found if isinstance(found, Mapping) else {name.partition(":")[2]: found}
    for key, value in values.items():
        if not isinstance(key, str) or not isinstance(value, numbers.Real):
            of = f" for {key!r}" if isinstance(found, Mapping) else ""
            raise MeasureError(f"measure '{name}': must return a number, or numbers by name, got {value!r}{of}")
    return {key: float(value) for key, value in values.items()}
