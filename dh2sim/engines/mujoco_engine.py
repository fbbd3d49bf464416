"""MuJoCo on an MJCF or a URDF file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
from mujoco.batch import Batch

from dh2sim.engines.engine import DynamicTerms, present_frames, require_joints
from dh2sim.errors import EngineError
from dh2sim.model.mass import MassProperties
from dh2sim.typing import Array, read_only

BLOCK_BYTES = 2**22
"""Of poses that are computed in one batch."""


class MujocoEngine:
    """One compiled model file; DH frames are sites in an MJCF and bodies in a URDF."""

    inertia_rounding = 0.0

    def __init__(
        self, path: Path, joints: Sequence[str], rows: int, *, compiled: mujoco.MjModel | None = None
    ) -> None:
        """Compile a file.

        Args:
            path: An .xml (MJCF) or .urdf file.
            joints: Names of the moving joints, in the order of a joint vector.
            rows: Number of rows of the table.
            compiled: The model in the file, where it was compiled already.

        Raises:
            EngineError: MuJoCo refuses the file, or frames or joints are missing.
        """
        self._path = path
        urdf = path.suffix == ".urdf"
        self.name = "mujoco-urdf" if urdf else "mujoco-mjcf"
        self._kind = "body" if urdf else "site"
        try:
            self._model = mujoco.MjModel.from_xml_path(str(path)) if compiled is None else compiled
        except ValueError as error:
            raise EngineError(f"{path}: MuJoCo refuses the file: {' '.join(str(error).split())}") from error
        model = self._model
        # only smooth dynamics is compared, and contacts would cost time
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        names = [model.joint(i).name for i in range(model.njnt)]
        require_joints(str(path), names, joints)
        if model.nq != model.njnt:
            raise EngineError(f"{path}: a joint is neither a hinge nor a slide")
        self._dofs = np.array([names.index(name) for name in joints], dtype=int)
        bodies = [model.body(i).name for i in range(model.nbody)]
        sites = [model.site(i).name for i in range(model.nsite)]
        found = bodies if urdf else sites
        self.frames = present_frames(str(path), found, rows, dh_frames_required=not urdf)
        self._ids = np.array([found.index(name) for name in self.frames], dtype=int)

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model, contacts disabled."""
        return self._model

    def frame_poses(self, q: Array) -> Array:
        """Return the poses of ``frames`` in the world, which is base_link; see ``PoseEngine``.

        Raises:
            EngineError: A coordinate is NaN or so large that MuJoCo would silently replace it.
        """
        if not (np.abs(q) <= mujoco.mjMAXVAL).all():
            raise EngineError(f"{self._path}: MuJoCo takes joint coordinates up to {mujoco.mjMAXVAL!r} only")
        poses = np.zeros((len(q), len(self._ids), 4, 4))
        poses[:, :, 3, 3] = 1.0
        if len(q) == 0:
            return poses
        count = self._model.nbody if self._kind == "body" else self._model.nsite
        block = min(len(q), max(1, BLOCK_BYTES // (96 * count)))
        batch = Batch(self._model, block, nthread=1)
        qpos = batch.bind("qpos") if self._model.nq else None
        position = batch.bind("xpos" if self._kind == "body" else "site_xpos")
        rotation = batch.bind("xmat" if self._kind == "body" else "site_xmat")
        for start in range(0, len(q), block):
            part = q[start : start + block]
            ids = np.arange(len(part), dtype=np.int32)
            if qpos is not None:
                qpos[: len(part), self._dofs] = part
            batch.forward(ids, stage=int(mujoco.mjtStage.mjSTAGE_POS))
            out = poses[start : start + block]
            out[:, :, :3, 3] = position[: len(part), self._ids]
            out[:, :, :3, :3] = rotation[: len(part), self._ids].reshape(len(part), -1, 3, 3)
        return poses

    def mass_properties(self, body: str) -> MassProperties:
        """Return the mass properties of a body in its own frame.

        Raises:
            EngineError: The body is unknown.
        """
        number = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_BODY, body)
        if number < 0:
            raise EngineError(f"{self._path}: body not found: {body}")
        principal = np.zeros(9)
        mujoco.mju_quat2Mat(principal, self._model.body_iquat[number])
        R = principal.reshape(3, 3)
        return MassProperties(
            mass=float(self._model.body_mass[number]),
            com=read_only(self._model.body_ipos[number]),
            inertia=read_only(R @ np.diag(self._model.body_inertia[number]) @ R.T),
        )

    def jacobian(self, q: Array) -> Array:
        """Return the geometric Jacobian of tool0; see ``DynamicsEngine``."""
        data = mujoco.MjData(self._model)
        result = np.zeros((len(q), 6, len(self._dofs)))
        linear, angular = np.zeros((3, self._model.nv)), np.zeros((3, self._model.nv))
        tool = int(self._ids[-1])
        jac = mujoco.mj_jacBody if self._kind == "body" else mujoco.mj_jacSite
        for k, row in enumerate(q):
            data.qpos[self._dofs] = row
            mujoco.mj_kinematics(self._model, data)
            mujoco.mj_comPos(self._model, data)
            jac(self._model, data, linear, angular, tool)
            result[k, :3], result[k, 3:] = linear[:, self._dofs], angular[:, self._dofs]
        return result

    def dynamic_terms(self, q: Array, velocity: Array, gravity: Array) -> DynamicTerms:
        """Return mass matrix (without armature), bias and gravity terms; see ``DynamicsEngine``."""
        model = self._model
        model.opt.gravity[:] = gravity
        # set to zero rather than subtracted from the result, which would lose digits
        model.dof_armature[:] = 0.0
        data = mujoco.MjData(model)
        mujoco.mj_setConst(model, data)  # MuJoCo computes the inertia of bodies that spin in place in advance
        keep_centers_of_mass(model)
        n = len(self._dofs)
        mass, bias, load = np.zeros((len(q), n, n)), np.zeros((len(q), n)), np.zeros((len(q), n))
        full = np.zeros((model.nv, model.nv))
        order = np.ix_(self._dofs, self._dofs)
        for k in range(len(q)):
            data.qpos[self._dofs] = q[k]
            data.qvel[:] = 0.0
            # not mj_forward, which factors the matrix
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_makeM(model, data)
            mujoco.mj_fullM(model, data, full)
            mass[k] = full[order]
            load[k] = self._bias(data)
            data.qvel[self._dofs] = velocity[k]
            bias[k] = self._bias(data)
        return DynamicTerms(mass_matrix=mass, bias=bias, gravity=load)

    def _bias(self, data: mujoco.MjData) -> Array:
        """Return Coriolis, centrifugal and gravity terms in a state whose positions are done, shape (n,)."""
        forces = np.zeros(self._model.nv)
        mujoco.mj_comVel(self._model, data)
        mujoco.mj_rne(self._model, data, 0, forces)
        return np.asarray(forces[self._dofs])


def keep_centers_of_mass(model: mujoco.MjModel) -> None:
    """Let MuJoCo compute with the centres of mass of the model file.

    Otherwise it takes one that is within 1 µm of its body's origin for the origin, a shortcut whose error is larger
    than the tolerances of ours, and has computed the inertia of a body that turns alone in advance with it.
    ``mj_setConst`` introduces both again.
    """
    model.dof_simplenum[:] = 0
    model.body_sameframe[:] = int(mujoco.mjtSameFrame.mjSAMEFRAME_NONE)
