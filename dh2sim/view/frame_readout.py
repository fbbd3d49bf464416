"""Numbers that a page shows of a frame: its pose, tool0's Jacobian, and the same pose in MuJoCo."""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import Dh2simError
from dh2sim.export import Format, render
from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.forward import frame_pose, geometric_jacobian
from dh2sim.kinematics.singularity import VelocityEllipsoid, singular_values, velocity_ellipsoid
from dh2sim.kinematics.transforms import compose, invert, quaternion_from_rotation, rpy_from_rotation
from dh2sim.model.robot_model import RobotModel
from dh2sim.typing import Array, read_only
from dh2sim.view.robot_files import write_files
from dh2sim.view.state import ViewState

if TYPE_CHECKING:
    from dh2sim.engines.mujoco_engine import MujocoEngine


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrameReadout:
    """The pose of a frame in another one, and measures of tool0's Jacobian J."""

    T_reference_frame: Array
    """Pose of the frame in the reference frame, shape (4, 4)."""
    xyz: tuple[float, ...]
    """m."""
    rpy: tuple[float, ...]
    """rad."""
    quaternion: tuple[float, ...]
    """(w, x, y, z)."""
    jacobian: Array
    """J, shape (6, n)."""
    ellipsoid: VelocityEllipsoid
    """Of the linear part of J."""
    manipulability: float
    """sqrt(det(J Jᵀ)); for fewer than six joints, where that is zero, sqrt(det(Jᵀ J)).

    T. Yoshikawa, Manipulability of robotic mechanisms, Int. J. Robotics Research 4(2), 1985.
    """
    smallest_singular_value: float
    """Of J in m and rad: its distance to the nearest matrix of lower rank in the spectral norm; 0 at a singularity.

    G. H. Golub and C. F. Van Loan, Matrix Computations, 4th edition, section 2.4.
    """


def readout_of(state: ViewState) -> FrameReadout:
    """Return the readout of the frame that a state has chosen."""
    return _readout_of(state.model, state.reference, state.frame, state.q)


@lru_cache(maxsize=8)  # several parts of a page show the same state
def _readout_of(model: RobotModel, reference: str, frame: str, q: tuple[float, ...]) -> FrameReadout:
    chain = model.chain
    T = relative_pose(chain, reference, frame, q)
    J = geometric_jacobian(chain, q)
    values = singular_values(J).tolist()
    return FrameReadout(
        T_reference_frame=T,
        jacobian=read_only(J),
        ellipsoid=velocity_ellipsoid(J),
        xyz=tuple(T[:3, 3].tolist()),
        rpy=tuple(rpy_from_rotation(T).tolist()),
        quaternion=tuple(quaternion_from_rotation(T).tolist()),
        manipulability=math.prod(values) if values else 0.0,
        smallest_singular_value=min(values, default=0.0),
    )


def relative_pose(chain: KinematicChain, reference: str, frame: str, q: ArrayLike) -> Array:
    """Return the pose of a frame in another one, shape (4, 4).

    Args:
        chain: The robot.
        reference: One of ``frame_names``.
        frame: Likewise.
        q: Joint vector, rad and m, shape (n,).
    """
    T_base_frame = read_only(frame_pose(chain, frame, q))
    if reference == "base_link":
        return T_base_frame
    return read_only(compose(invert(read_only(frame_pose(chain, reference, q))), T_base_frame))


@dataclass(slots=True, eq=False)
class MujocoPose:
    """Computes poses with MuJoCo from the exported MJCF, which is compiled once for each robot; not thread-safe."""

    _model: RobotModel | None = None
    _engine: MujocoEngine | None = None
    problem: str = field(default="", init=False)
    """Why there is no pose; empty if there is one."""

    def pose(self, model: RobotModel, frame: str, q: tuple[float, ...]) -> Array | None:
        """Return a frame's pose in base_link, shape (4, 4); None if MuJoCo has none.

        Args:
            model: The robot.
            frame: ``dh_0`` … ``dh_n`` or ``tool0``, which alone are sites in the MJCF.
            q: Joint coordinates, rad and m.
        """
        if model is not self._model:
            self._model, self._engine, self.problem = model, None, ""
            try:
                self._engine = _compiled(model)
            except Dh2simError as error:
                self.problem = str(error)
        if self._engine is None or frame not in self._engine.frames:
            return None
        try:
            poses = self._engine.frame_poses(np.array([q], dtype=np.float64).reshape(1, -1))
        except Dh2simError as error:
            self.problem = str(error)
            return None
        return np.asarray(poses[0, self._engine.frames.index(frame)])


def _compiled(model: RobotModel) -> MujocoEngine:
    from dh2sim.engines.mujoco_engine import MujocoEngine

    with tempfile.TemporaryDirectory() as folder:
        write_files(render(model, [Format.MJCF]), Path(folder))
        names = [joint.name for joint in model.moving_joints]
        return MujocoEngine(Path(folder) / f"{model.name}.xml", names, len(model.joints))
