"""Mass, centre of mass and inertia of the links of a URDF's arm, with those of all links that are fixed to them."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from dh2sim.formats.from_urdf.parts import Body, Part, note_unreadable
from dh2sim.formats.from_urdf.values import read_number, read_only_child, read_pose
from dh2sim.formats.notes import Notes
from dh2sim.formats.serial_robot import Inertial
from dh2sim.formats.xml_tree import Element, XmlReport
from dh2sim.kinematics.tensors import move_point, rotate_tensor
from dh2sim.kinematics.transforms import compose
from dh2sim.model.mass import MassProperties, combine, is_possible
from dh2sim.typing import Array, read_only

_POINT_MASS_SHARE: Final = 0.1
"""Of a body's mass: what lighter parts whose inertia is not known add by themselves is small."""


def read_inertial(body: Body, report: XmlReport, notes: Notes) -> Inertial:
    """Combine the masses of all parts of a body.

    Broken numbers in a part on the way from base to tip are problems; elsewhere they are noted and the part has no
    mass. An inertia that no body can have is noted and counts as unknown. Parts of unknown inertia count as point
    masses where they are light; else the inertia of the whole is unknown.

    Args:
        body: A link of the arm.
        report: Takes the problems.
        notes: Takes what was left out.
    """
    known = [found for part in body.parts if (found := _read_part(part, report, notes)) is not None]
    if not known:
        notes.group("The file gives no mass for links {}.", body.name)
        return Inertial()
    whole = known[0][0] if len(known) == 1 else combine(mass for mass, _ in known)
    unknown = [mass.mass for mass, has_inertia in known if not has_inertia]
    if not unknown:
        return _checked(whole, body.name, notes)
    if math.fsum(unknown) > _POINT_MASS_SHARE * whole.mass:
        if len(known) > 1:
            notes.group(
                "The inertia of a heavy part is not known, and so not that of the whole, for links {}.", body.name
            )
        return Inertial(mass=whole.mass, com=whole.com)
    notes.group("Light parts of unknown inertia were counted as point masses, in links {}.", body.name)
    return _checked(whole, body.name, notes)


def _checked(whole: MassProperties, name: str, notes: Notes) -> Inertial:
    if is_possible(whole.inertia):
        return Inertial(mass=whole.mass, com=whole.com, inertia=whole.inertia)
    notes.group("An inertia that no body has is left out, of links {}.", name)
    return Inertial(mass=whole.mass, com=whole.com)


def _read_part(part: Part, report: XmlReport, notes: Notes) -> tuple[MassProperties, bool] | None:
    """Return a part's mass properties in the link of the arm and whether its inertia is known; None without mass."""
    own = report if part.on_chain else XmlReport(report.file)
    before = len(own.problems)
    inertial = read_only_child(part.element, "inertial", part.path, own)
    if inertial is None:
        return None
    path = f"{part.path}.inertial"
    T = compose(part.T_link_part, read_pose(inertial, path, own))
    mass_element = read_only_child(inertial, "mass", path, own)
    mass = 0.0 if mass_element is None else read_number(mass_element, "value", f"{path}.mass", own)
    tensor = _tensor(inertial, path, own)
    if len(own.problems) > before:
        if own is not report:
            note_unreadable(own, "Masses that cannot be read are left out, of links {}.", part.name, notes)
        return None
    if mass < 0.0:
        notes.group("Negative masses are left out, of links {}.", part.name)
    elif mass == 0.0 and tensor is not None and tensor.any():
        notes.group("Inertias without a mass are left out, of links {}.", part.name)
    if mass <= 0.0:
        return None
    com = read_only(move_point(T, read_only([0, 0, 0])))
    if tensor is not None and not is_possible(tensor):
        notes.group("An inertia that no body has is left out, of links {}.", part.name)
        tensor = None
    elif tensor is None:
        notes.group("The file gives a mass without an inertia for links {}.", part.name)
    inertia = rotate_tensor(T, read_only(np.zeros((3, 3))) if tensor is None else tensor)
    return MassProperties(mass=mass, com=com, inertia=inertia), tensor is not None


def _tensor(inertial: Element, path: str, report: XmlReport) -> Array | None:
    """Return the inertia along the axes of the inertial's own frame, or None where there is none."""
    element = read_only_child(inertial, "inertia", path, report)
    if element is None:
        return None
    path = f"{path}.inertia"
    xx, yy, zz = (read_number(element, name, path, report) for name in ("ixx", "iyy", "izz"))
    xy, xz, yz = (
        read_number(element, name, path, report) if name in element.attributes else 0.0
        for name in ("ixy", "ixz", "iyz")
    )
    return read_only([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
