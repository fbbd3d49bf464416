"""DH frames as sites of an MJCF, placed so that MuJoCo keeps their poses to the last bit.

MuJoCo compares every site with its body's frame and with the body's principal frame. Where position or quaternion
differ by less than 1e-6 it uses the frame for the site, which is off by as much then: a twist of 1.570796 for pi/2
is enough. A body that has no mass is placed exactly, so such a site gets one of its own.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from functools import lru_cache

import numpy as np

from dh2sim.formats.xml_write import child, numbers
from dh2sim.kinematics.transforms import Rows, identity, quaternion_from_rotation, rotated_tensor
from dh2sim.model.mass import MassProperties
from dh2sim.typing import Array

NEAR = 1e-5
"""Frames that differ by less may be one frame to MuJoCo; m, and components of a rotation matrix."""
NOISE = 1e-15
"""Frames that differ by less count as one."""


def placed(T: Array) -> dict[str, str]:
    """Return the attributes of an element with pose ``T``, shape (4, 4), in its body."""
    return {"pos": numbers(T[:3, 3].tolist()), "quat": _quaternion(T[:3, :3].tobytes())}


@lru_cache(maxsize=1024)  # robots that differ in lengths have the same orientations
def _quaternion(rotation: bytes) -> str:
    return numbers(quaternion_from_rotation(np.frombuffer(rotation).reshape(3, 3)).tolist())


def add_site(body: ET.Element, name: str, T: Array, inertial: MassProperties | None, *, apart: bool = False) -> None:
    """Add a site to a body, in a massless body of the same name where it needs one, or ``apart`` is true.

    Args:
        body: the link's element.
        name: of the site.
        T: its pose in the link, shape (4, 4).
        inertial: of the link.
        apart: whether the site gets a body whatever its pose.
    """
    if apart or needs_body(T, inertial):
        body = child(body, "body", name=name, **placed(T))
        T = identity()
    child(body, "site", name=name, **placed(T))


def needs_body(T: Array, inertial: MassProperties | None) -> bool:
    """Whether MuJoCo may replace a site with pose ``T`` in a link by another frame that is only near it."""
    (xx, xy, xz, x), (yx, yy, yz, y), (zx, zy, zz, z), _ = T.tolist()
    turned = _largest(xx - 1.0, xy, xz, yx, yy - 1.0, yz, zx, zy, zz - 1.0)
    if NOISE < turned < NEAR:
        return True
    if turned > NOISE:
        return inertial is not None and _along_principal_axes(T, inertial.inertia)
    if NOISE < _largest(x, y, z) < NEAR:
        return True
    if inertial is None:
        return False
    u, v, w = inertial.com.tolist()
    return NOISE < _largest(x - u, y - v, z - w) < NEAR


def _along_principal_axes(T: Array, tensor: Array) -> bool:
    """Whether the axes of ``T`` are almost principal ones of a tensor that is not diagonal as it is written."""
    rows: Rows = tensor.tolist()
    if rows[0][1] == rows[0][2] == rows[1][2] == 0.0:
        return False
    (_, xy, xz), (_, _, yz), _ = rotated_tensor(T[:3, :3].T.tolist(), rows)
    return _largest(xy, xz, yz) < NEAR * (rows[0][0] + rows[1][1] + rows[2][2])


def _largest(*values: float) -> float:
    return max(map(abs, values))
