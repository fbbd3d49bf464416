"""Planning of trajectories, of serial robots and of mechanisms."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Unpack

from dh2sim.model.mechanism import MechanismModel, written_model
from dh2sim.progress import Stage, silent
from dh2sim.robot.spec import SpecLike
from dh2sim.trajectory.mechanism import plan_mechanism_trajectory
from dh2sim.trajectory.options import TrajectoryKeywords, TrajectoryOptions
from dh2sim.trajectory.serial import plan_serial_trajectory
from dh2sim.trajectory.trajectory import Trajectory


def plan_trajectory(
    robot: SpecLike, waypoints: Iterable[Any], *, stage: Stage = silent, **options: Unpack[TrajectoryKeywords]
) -> Trajectory:
    """Return the trajectory through waypoints, from rest to rest.

    Every motion starts and stops at rest, but those to a waypoint with ``stop: False``: these pass it, at its exact
    joint vector, on a cubic spline of the joints. The joints of a motion start and stop together. Joint vectors are
    taken as they are: no joint takes a shorter way round.

    Args:
        robot: The robot, in any form.
        waypoints: At least two, the first of which is where the motion starts: names of configurations, joint
            vectors (n,), poses of tool0 in base_link (4, 4), or mappings with the keys of a waypoint file, in rad
            and m. Of a mechanism, coordinates of the driven joints.
        stage: Shows the progress of what takes long.
        **options: ``kind``: 'joint' (default), 'line' or 'arc', of motions whose waypoints do not say; with 'arc',
            every second waypoint is the point that an arc goes through, unless one has ``via`` or ``centre``.
            ``profile``: 'quintic' (default), 'trapezoid', 'jerk' or 'optimal', which keeps limits of torque.
            ``duration``: of the whole, s; by default as short as limits allow. ``limits``: in place of the robot's
            own, see :func:`requested_limits`. ``through``: whether to pass singularities slowly. ``free``: 'rotation'
            or 'roll', what lines and arcs leave open of the orientation; by default what the robot cannot hold.

    Raises:
        SettingsError: Waypoints or options are wrong; the error holds everything that is.
        TrajectoryError: There is no such trajectory; the text says at which waypoint, where and why.
    """
    model = written_model(robot)
    if isinstance(model, MechanismModel):
        return plan_mechanism_trajectory(model, waypoints, stage=stage, **options)
    return plan_serial_trajectory(model, waypoints, TrajectoryOptions.of(options), stage)
