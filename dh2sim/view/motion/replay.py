"""The rollouts of a run, played back by time."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dh2sim.draw.motion import Motion
from dh2sim.errors import RunError, TrajectoryError
from dh2sim.kinematics.transforms import identity
from dh2sim.messages import listed
from dh2sim.model.mechanism import MechanismModel
from dh2sim.model.robot_model import RobotModel
from dh2sim.simulate.dataset_layout import FINISHED, NOT_RUN
from dh2sim.trajectory.files import SampledTrajectory, is_trajectory_file, read_trajectory
from dh2sim.typing import Array, read_only

if TYPE_CHECKING:
    from dh2sim.draw.rollout_data import RolloutData

CACHED = 8
"""Rollouts that stay in memory once they were read."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Recorded:
    """One rollout."""

    motion: Motion
    q: Array
    """Joint vectors in the order of the table, shape (N, n)."""
    base: Array | None
    """Poses of base_link in the world, shape (N, 4, 4); None if it does not move."""
    stopped: str


class Replay:
    """A run, opened by ``open_replay``. Rollouts are read when they are first used."""

    def __init__(self, path: Path, *, joints: tuple[str, ...], rollouts: tuple[int, ...], note: str) -> None:
        """Read nothing yet.

        Args:
            path: Of the run.
            joints: Names of the joints in the order of joint vectors.
            rollouts: Numbers of the rollouts that can be shown.
            note: A sentence if the run may be of another robot; else empty.
        """
        self.path = path
        self.joints = joints
        """Names of the joints in the order of a joint vector."""
        self.rollouts = rollouts
        """Numbers of the rollouts that have been run."""
        self.note = note
        """A sentence if the robot of the run may differ from the one that is shown; else empty."""
        self._recorded = functools.lru_cache(maxsize=CACHED)(self._read)

    def label(self, rollout: int) -> str:
        """Return what a rollout is called."""
        return f"Rollout {rollout}"

    def times(self, rollout: int) -> Array:
        """Return the recorded times, s, ascending, shape (N,).

        Raises:
            PictureError: The rollout does not exist or has not been run, or positions were not recorded.
            RunError: The run cannot be read. All methods raise these errors.
        """
        return self._recorded(rollout).motion.time

    def duration(self, rollout: int) -> float:
        """Return the last recorded time, s."""
        return float(self.times(rollout)[-1])

    def q_at(self, rollout: int, t: float) -> Array:
        """Return the joint positions recorded nearest to time ``t``, s; rad or m, shape (n,)."""
        recorded = self._recorded(rollout)
        return np.asarray(recorded.q[recorded.motion.nearest(t)])

    def positions(self, rollout: int) -> Array:
        """Return all recorded joint positions, rad and m, shape (N, n)."""
        return self._recorded(rollout).q

    def base_at(self, rollout: int, t: float) -> Array | None:
        """Return base_link's pose in the world nearest to time ``t``, s, shape (4, 4); None if it does not float."""
        recorded = self._recorded(rollout)
        return None if recorded.base is None else np.asarray(recorded.base[recorded.motion.nearest(t)])

    def stopped(self, rollout: int) -> str:
        """Return why a rollout stopped early, a sentence; empty if it did not."""
        return self._recorded(rollout).stopped

    def _read(self, rollout: int) -> _Recorded:
        from dh2sim.draw.motion import motion_of_run
        from dh2sim.draw.rollout_data import open_rollout

        data = open_rollout(self.path, rollout)
        data.require("qpos", what="a replay")
        motion = motion_of_run(data)
        names = data.names("joint")
        q = data.values("qpos")[:, [names.index(name) for name in self.joints]]
        base = _base_poses(motion) if motion.floats else None
        return _Recorded(motion=motion, q=read_only(q), base=base, stopped=_stop_reason(data))


class _TrajectoryReplay(Replay):
    """A trajectory file, which plays as the only rollout of a run does."""

    def __init__(self, path: Path, trajectory: SampledTrajectory) -> None:
        """Take the samples in the order of the robot's joints."""
        super().__init__(path, joints=trajectory.joints, rollouts=(0,), note="")
        self._trajectory = trajectory

    def label(self, rollout: int) -> str:  # noqa: ARG002 - there is one
        """Return what the file is called."""
        return "Trajectory"

    def _read(self, rollout: int) -> _Recorded:  # noqa: ARG002 - there is one
        trajectory = self._trajectory
        motion = Motion(model=None, qpos=trajectory.q, time=trajectory.time)
        return _Recorded(motion=motion, q=trajectory.q, base=None, stopped="")


def open_replay(path: Path, model: RobotModel | MechanismModel | None) -> Replay:
    """Open a run, finished or not, or a trajectory file.

    Args:
        path: Of the run or the file.
        model: The robot to show; None for the one that the run was made with.

    Raises:
        RunError: There is no run, it is damaged, none of its rollouts has been run, or it is of a robot with other
            joints.
        TrajectoryError: The file is not a trajectory, or one of a robot with other joints.
    """
    if is_trajectory_file(path):
        read = read_trajectory(path)
        if model is not None:
            read = trajectory_of(read, path, model)
        return _TrajectoryReplay(path, read)
    from dh2sim.simulate.store.reader import open_dataset, reading

    with open_dataset(path) as run:
        names = tuple(str(name) for name in run["joint"].values)
        with reading(path):
            status = np.asarray(run["status"].values) if "status" in run else np.full(run.sizes["rollout"], FINISHED)
        robot, digest = str(run.attrs.get("robot", "")), run.attrs.get("robot_file_sha256", "")
    rollouts = tuple(int(number) for number in np.flatnonzero(status != NOT_RUN))
    if not rollouts:
        raise RunError(f"'{path}': no rollout has been run yet")
    if model is None:
        return Replay(path, joints=names, rollouts=rollouts, note="")
    joints = tuple(joint.name for joint in model.moving_joints)
    if set(joints) != set(names):
        raise RunError(
            f"'{path}' is a run of {robot} with the joints {listed(names)}; {model.name} has {listed(joints)}"
        )
    source = model.spec.source_file
    same = source is not None and source.sha256 == digest
    note = (
        ""
        if same
        else f"The run was made with another version of {robot}'s file: the motion shown may differ from it."
    )
    return Replay(path, joints=joints, rollouts=rollouts, note=note)


def trajectory_of(read: SampledTrajectory, path: Path, model: RobotModel | MechanismModel) -> SampledTrajectory:
    """Return a trajectory with its joints in a robot's order.

    Raises:
        TrajectoryError: They are not the robot's; the text names the file.
    """
    try:
        return read.ordered([joint.name for joint in model.moving_joints])
    except TrajectoryError as error:
        raise TrajectoryError(f"'{path}' is not of {model.name}: {error}") from None


def _base_poses(motion: Motion) -> Array:
    """Return base_link's poses in the world, computed with the run's own model, shape (N, 4, 4)."""
    import mujoco

    data = mujoco.MjData(motion.model)
    poses = np.tile(identity(), (len(motion.qpos), 1, 1))
    link = motion.model.body("base_link").id
    for pose, qpos in zip(poses, motion.qpos, strict=True):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(motion.model, data)
        pose[:3, :3], pose[:3, 3] = data.xmat[link].reshape(3, 3), data.xpos[link]
    return read_only(poses)


def _stop_reason(rollout: RolloutData) -> str:
    """Return why a rollout stopped early, a sentence; empty if it did not."""
    if not rollout.reason:
        return ""
    return f"Rollout {rollout.number} stopped in time step {rollout.stop_step}: {rollout.reason.replace('_', ' ')}."
