"""DH frames in an MJCF: sites, placed so that MuJoCo keeps their poses to the last bit.

MuJoCo compares every site with its body's frame and with the body's principal frame. Where position or quaternion
differ by less than 1e-6 it takes one for the other, and the site is off by as much: a twist of 1.570796 where pi/2
was meant is enough. A body that has no mass is placed exactly, so such a site gets one of its own.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from dh2sim.formats.xml import child, numbers
from dh2sim.kinematics.transforms import identity, quaternion_from_rotation
from dh2sim.model.mass import MassProperties, rotate_tensor
from dh2sim.typing import Array

NEAR = 1e-5
"""Frames that differ by less may be one frame to MuJoCo; m, and components of a rotation matrix."""


def placed(T: Array) -> dict[str, str]:
    """Attributes of an element with pose ``T``, shape (4, 4), in its body."""
    return {"pos": numbers(T[:3, 3]), "quat": numbers(quaternion_from_rotation(T[:3, :3]))}


def add_site(body: ET.Element, name: str, T: Array, inertial: MassProperties | None) -> None:
    """Add a site to a body, in a massless body of the same name where it needs one.

    Args:
        body: the link's element.
        name: of the site.
        T: its pose in the link, shape (4, 4).
        inertial: of the link.
    """
    if needs_body(T, inertial):
        body = child(body, "body", name=name, **placed(T))
        T = identity()
    child(body, "site", name=name, **placed(T))


def needs_body(T: Array, inertial: MassProperties | None) -> bool:
    """Whether MuJoCo may take a site with pose ``T`` in a link for another frame that is only near it."""
    position, R = T[:3, 3], T[:3, :3]
    aligned = bool((identity()[:3, :3] == R).all())
    if _near(R, identity()[:3, :3]) and not (aligned and (not position.any() or not _near(position, 0.0))):
        return True
    if inertial is None:
        return False
    if aligned:
        return bool(position.any()) and _near(position, inertial.com) and bool((position != inertial.com).any())
    return _along_principal_axes(R, inertial.inertia)


def _along_principal_axes(R: Array, tensor: Array) -> bool:
    """Whether the axes of ``R`` are almost principal ones of a tensor that is not diagonal as it is written."""
    if tensor[0, 1] == tensor[0, 2] == tensor[1, 2] == 0.0:
        return False
    turned = rotate_tensor(R.T, tensor)
    return _near(turned - turned * identity()[:3, :3], 0.0, float(tensor[0, 0] + tensor[1, 1] + tensor[2, 2]))


def _near(a: Array, b: Array | float, scale: float = 1.0) -> bool:
    return bool((abs(a - b) < NEAR * scale).all())
