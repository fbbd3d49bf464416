"""Mass, centre of mass and inertia of the links of an MJCF's arm, with those of all bodies that are fixed to them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dh2sim.formats.from_mjcf.compile import Compiled
from dh2sim.formats.from_mjcf.tree import MjcfBody, MjcfTree, pose
from dh2sim.formats.notes import Notes
from dh2sim.formats.serial_robot import Inertial
from dh2sim.kinematics.tensors import rotate_tensor
from dh2sim.model.mass import MassProperties, combine, in_frame, is_possible
from dh2sim.typing import read_only

if TYPE_CHECKING:
    import mujoco


def read_mass(compiled: Compiled, tree: MjcfTree, body: MjcfBody, name: str, notes: Notes) -> Inertial:
    """Return the mass properties of a body and of all that is fixed to it, in the body's frame, as compiled.

    Args:
        compiled: The model.
        tree: Its bodies.
        body: A link of the arm.
        name: Of the link.
        notes: Takes what is not known.
    """
    model = compiled.model
    parts = tree.rigid(body.id)
    if any(model.body_gravcomp[part] for part in parts):
        notes.group("Compensation of gravity is not carried over, of links {}.", name)
    if compiled.unknown_masses.intersection(parts):
        notes.group("The mass is not known, as it would come from shapes that are missing, of links {}.", name)
        return Inertial()
    known = [_in_link(model, tree, body, part) for part in parts if model.body_mass[part] > 0.0]
    if not known:
        notes.group("The file gives no mass for links {}.", name)
        return Inertial()
    whole = known[0] if len(known) == 1 else combine(known)
    if not is_finite(whole):
        notes.group("Masses that cannot be used are left out, of links {}.", name)
        return Inertial()
    if not is_possible(whole.inertia):
        notes.group("An inertia that no body has is left out, of links {}.", name)
        return Inertial(mass=whole.mass, com=whole.com)
    return Inertial(mass=whole.mass, com=whole.com, inertia=whole.inertia)


def is_finite(body: MassProperties) -> bool:
    """Whether all numbers are finite."""
    return bool(np.isfinite([body.mass, *body.com, *body.inertia.ravel()]).all())


def _in_link(model: mujoco.MjModel, tree: MjcfTree, link: MjcfBody, part: int) -> MassProperties:
    T = pose(model.body_ipos[part], model.body_iquat[part])
    own = MassProperties(
        mass=float(model.body_mass[part]),
        com=read_only(T[:3, 3]),
        inertia=rotate_tensor(T, read_only(np.diag(model.body_inertia[part]))),
    )
    return own if part == link.id else in_frame(tree.drawn_pose(link.id, part), own)


def weight_of(compiled: Compiled, tree: MjcfTree, bodies: tuple[int, ...]) -> str:
    """Return words for some bodies and their mass, such as ``body 'finger' (0.1 kg)``."""
    mass = sum(float(compiled.model.body_mass[body]) for body in bodies)
    label = tree.bodies[bodies[0]].label
    first = label if label.startswith("body ") else f"body {label}"
    what = first if len(bodies) == 1 else f"{len(bodies)} bodies from {label} on"
    if compiled.unknown_masses.intersection(bodies):
        return f"{what} (mass not known)"
    return f"{what} ({mass:.6g} kg)" if mass > 0.0 else what
