"""pinocchio on a URDF file; an optional engine."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dh2sim.engines.engine import DynamicTerms, present_frames, require_joints
from dh2sim.errors import EngineCapacityError, EngineError
from dh2sim.typing import Array

MAX_JOINTS = 240
"""pinocchio's work space has four tensors of second derivatives, n³ doubles each: 0.44 GB for 240 joints."""


class PinocchioEngine:
    """One URDF file, read by pinocchio."""

    name = "pinocchio"
    inertia_rounding = 0.0

    def __init__(self, path: Path, joints: Sequence[str], rows: int | Sequence[str]) -> None:
        """Read a file.

        Args:
            path: A .urdf file.
            joints: Names of the moving joints, in the order of a joint vector.
            rows: Number of rows of the table, or the names of a mechanism's frames.

        Raises:
            ImportError: pinocchio is not installed.
            EngineCapacityError: The robot has more than ``MAX_JOINTS`` moving joints.
            EngineError: pinocchio refuses the file, or frames or joints are missing.
        """
        import pinocchio

        if not hasattr(pinocchio, "buildModelFromUrdf"):
            raise ImportError("another package of that name is installed; this one is installed by 'pip install pin'")
        self._pin: Any = pinocchio
        try:
            self._model: Any = pinocchio.buildModelFromUrdf(str(path))
        except (ValueError, RuntimeError) as error:
            raise EngineError(f"{path}: pinocchio refuses the file: {' '.join(str(error).split())}") from error
        model = self._model
        if model.nv > MAX_JOINTS:
            needed = 4 * 8 * model.nv**3 / 1e9
            raise EngineCapacityError(
                f"pinocchio needs {needed:.1f} GB for {model.nv} joints; at most {MAX_JOINTS} are allowed"
            )
        self._data: Any = model.createData()
        found = list(model.names)[1:]  # the first one is the world
        require_joints(str(path), found, joints)
        self._joints = [model.joints[1 + found.index(name)] for name in joints]
        self._dofs = np.array([joint.idx_v for joint in self._joints], dtype=int)
        links = [frame.name for frame in model.frames if frame.type == pinocchio.FrameType.BODY]
        self.frames = present_frames(str(path), links, rows, dh_frames_required=False)
        # a joint may have the name of a link
        self._ids = [model.getFrameId(name, pinocchio.FrameType.BODY) for name in self.frames]

    def frame_poses(self, q: Array) -> Array:
        """Return the poses of ``frames`` in base_link; see ``PoseEngine``."""
        poses = np.empty((len(q), len(self._ids), 4, 4))
        for k, row in enumerate(q):
            self._pin.framesForwardKinematics(self._model, self._data, self._configuration(row))
            for i, frame in enumerate(self._ids):
                poses[k, i] = self._data.oMf[frame].homogeneous
        return poses

    def jacobian(self, q: Array) -> Array:
        """Return the geometric Jacobian of tool0; see ``DynamicsEngine``."""
        result = np.empty((len(q), 6, len(self._dofs)))
        for k, row in enumerate(q):
            jacobian = self._pin.computeFrameJacobian(
                self._model,
                self._data,
                self._configuration(row),
                self._ids[-1],
                self._pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
            )
            result[k] = np.reshape(jacobian, (6, -1))[:, self._dofs]  # a single column comes as a flat array
        return result

    def dynamic_terms(self, q: Array, velocity: Array, gravity: Array) -> DynamicTerms:
        """Return mass matrix, bias and gravity terms; see ``DynamicsEngine``."""
        pin, model, data = self._pin, self._model, self._data
        model.gravity.linear = np.array(gravity)
        n = len(self._dofs)
        mass, bias, load = np.zeros((len(q), n, n)), np.zeros((len(q), n)), np.zeros((len(q), n))
        order = np.ix_(self._dofs, self._dofs)
        for k in range(len(q)):
            configuration, speed = self._configuration(q[k]), np.zeros(model.nv)
            speed[self._dofs] = velocity[k]
            upper = np.triu(pin.crba(model, data, configuration))
            mass[k] = (upper + np.triu(upper, 1).T)[order]
            bias[k] = pin.nonLinearEffects(model, data, configuration, speed)[self._dofs]
            load[k] = pin.computeGeneralizedGravity(model, data, configuration)[self._dofs]
        return DynamicTerms(mass_matrix=mass, bias=bias, gravity=load)

    def _configuration(self, row: Array) -> Array:
        """Return pinocchio's own vector: a continuous joint is stored as cosine and sine."""
        configuration = np.zeros(self._model.nq)
        for joint, value in zip(self._joints, row, strict=True):
            if joint.nq == 2:
                configuration[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
            else:
                configuration[joint.idx_q] = value
        return configuration
