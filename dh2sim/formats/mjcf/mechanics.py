"""Mass matrix and gravity forces of an arm, by MuJoCo from the model that it compiled of an MJCF."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

import numpy as np

from dh2sim.formats.mjcf.chain import Selection
from dh2sim.formats.mjcf.compile import Compiled
from dh2sim.formats.serial_robot import Mechanics
from dh2sim.typing import Array

if TYPE_CHECKING:
    import mujoco


def mjcf_mechanics(compiled: Compiled, selection: Selection) -> Mechanics | None:
    """Return the mass matrices and gravity forces of an arm as functions of its coordinates.

    Coordinates count as in the file's ``qpos``. What joints carry that are not on the arm is left out, and so is the
    inertia of rotors. None where masses are unknown, for want of the meshes that they come from.
    """
    if compiled.unknown_masses:
        return None
    import mujoco

    model = copy.copy(compiled.model)
    for body in sorted(_hung(model, selection)):
        model.body_mass[body] = 0.0
        model.body_inertia[body] = 0.0
    model.dof_armature[:] = 0.0
    model.dof_simplenum[:] = 0  # or else inertia that was computed with the rotor's would be used of some joints
    data = mujoco.MjData(model)
    # or else a centre of mass within 1e-6 m of its body's origin would be taken to be there
    model.body_sameframe[:] = int(mujoco.mjtSameFrame.mjSAMEFRAME_NONE)
    coordinates = [int(model.jnt_qposadr[joint.id]) for joint in selection.joints]
    dofs = [int(model.jnt_dofadr[joint.id]) for joint in selection.joints]

    def terms(q: Array) -> tuple[Array, Array]:
        mass, load = np.zeros((len(q), len(dofs), len(dofs))), np.zeros((len(q), len(dofs)))
        full, forces = np.zeros((model.nv, model.nv)), np.zeros(model.nv)
        for k, row in enumerate(q):
            data.qpos[:] = model.qpos0
            data.qpos[coordinates] = row
            # not mj_forward, which factors the matrix, and logs a warning where a body without mass makes it singular
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_makeM(model, data)
            mujoco.mj_comVel(model, data)
            mujoco.mj_fullM(model, data, full)
            mujoco.mj_rne(model, data, 0, forces)
            mass[k], load[k] = full[np.ix_(dofs, dofs)], forces[dofs]
        return mass, load

    return terms


def _hung(model: mujoco.MjModel, selection: Selection) -> set[int]:
    """Return the bodies that the arm carries by joints which are not its own."""
    arm = {joint.id for joint in selection.joints}
    on_arm = {joint.body for joint in selection.joints}
    hung: set[int] = set()
    for body in range(1, model.nbody):  # parents come first
        parent, first = int(model.body_parentid[body]), int(model.body_jntadr[body])
        own = set(range(first, first + int(model.body_jntnum[body]))) - arm if first >= 0 else set()
        if parent in hung or (own and parent in on_arm):
            hung.add(body)
        elif parent in on_arm:
            on_arm.add(body)
    return hung
