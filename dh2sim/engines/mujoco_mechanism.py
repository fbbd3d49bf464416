"""MuJoCo on the files of a mechanism: all frames of its tree, and the rank and the gap of its loops."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np

from dh2sim.errors import EngineError
from dh2sim.mujoco_warnings import mujoco_warnings
from dh2sim.typing import Array

RANK_TOLERANCE = 1e-8
"""Of singular values of the constraints' Jacobian."""


class MujocoMechanism:
    """One compiled model file; DH frames are sites in an MJCF and bodies in a URDF."""

    def __init__(self, path: Path, *, compiled: mujoco.MjModel | None = None) -> None:
        """Compile a file.

        Args:
            path: An .xml (MJCF) or .urdf file.
            compiled: The model in the file, where it was compiled already.

        Raises:
            EngineError: MuJoCo refuses it.
        """
        try:
            self._model = mujoco.MjModel.from_xml_path(str(path)) if compiled is None else compiled
        except ValueError as error:
            raise EngineError(f"{path.name}: MuJoCo refuses the file: {' '.join(str(error).split())}") from error
        self._data = mujoco.MjData(self._model)
        self._urdf = path.suffix == ".urdf"

    def frame_poses(self, q: Mapping[str, float]) -> dict[str, Array]:
        """Return the poses of all bodies, and of the sites of an MJCF, by name, with joints where they are given."""
        model, data = self._model, self._data
        for name, value in q.items():
            data.qpos[model.joint(name).qposadr[0]] = value
        mujoco.mj_kinematics(model, data)
        found = [(model.body(k).name, data.body(k)) for k in range(model.nbody)]
        if not self._urdf:
            found += [(model.site(k).name, data.site(k)) for k in range(model.nsite)]
        poses = {}
        for name, of in found:
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = of.xmat.reshape(3, 3), of.xpos
            poses[name] = T
        return poses

    def loops_at_home(self) -> tuple[float, int]:
        """Return the greatest gap of the equality constraints at the first keyframe, and the freedoms they leave."""
        mujoco.mj_resetDataKeyframe(self._model, self._data, 0)
        mujoco.mj_forward(self._model, self._data)
        gap = self._gap()
        J = self._equality_jacobian()
        return gap, self._model.nv - int(np.linalg.matrix_rank(J, tol=RANK_TOLERANCE))

    def gap_in_motion(self, duration: float = 2.0) -> float:
        """Return the greatest gap, m or rad, from the first keyframe on, with the controls swinging by 0.3.

        It is infinite where the simulation is unstable, at which MuJoCo starts it again from zero.
        """
        model, data = self._model, self._data
        mujoco.mj_resetDataKeyframe(model, data, 0)
        home, gap = data.ctrl.copy(), 0.0
        with mujoco_warnings():
            while data.time < duration:
                data.ctrl[:] = home + 0.3 * np.sin(2 * np.pi * data.time)
                before = data.time
                mujoco.mj_step(model, data)
                if data.time <= before:
                    return float("inf")
                gap = max(gap, self._gap())
        return gap

    def _equalities(self) -> np.ndarray:
        return np.flatnonzero(self._data.efc_type == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY))

    def _gap(self) -> float:
        return float(np.abs(self._data.efc_pos[self._equalities()]).max(initial=0.0))

    def _equality_jacobian(self) -> Array:
        model, data = self._model, self._data
        J = np.zeros((data.nefc, model.nv))
        if mujoco.mj_isSparse(model):
            mujoco.mju_sparse2dense(J, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
        else:
            J[:] = data.efc_J.reshape(data.nefc, model.nv)
        return np.asarray(J[self._equalities()])
