"""The floor and the pedestal of a robot's scene, as the exported ``scene.xml`` has them."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from dh2sim.formats.mjcf.scene import to_scene
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.shapes import ShapeKind, ShapePart, between
from dh2sim.view.scene.items import Color, Solid
from dh2sim.view.scene.solids import orientation_of, position_of, shape_triangles

_COLOR: Final[Color] = (0.62, 0.64, 0.68)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ground:
    """What a robot stands on."""

    height: float
    """Of the floor in base_link, m."""
    pedestal: Solid | None
    """Under the base, in base_link; None where the base stands on the floor."""


@lru_cache(maxsize=8)  # asked for with every picture
def ground_of(model: RobotModel) -> Ground:
    """Return the floor and the pedestal of a robot's scene."""
    geoms = {geom.get("name"): geom for geom in ET.fromstring(to_scene(model)).iter("geom")}
    floor, pedestal = geoms["floor"], geoms.get("pedestal")
    return Ground(
        height=float(floor.get("pos", "0 0 0").split()[2]), pedestal=None if pedestal is None else _solid(pedestal)
    )


def _solid(geom: ET.Element) -> Solid:
    ends = [float(text) for text in geom.get("fromto", "").split()]
    radius = float(geom.get("size", "").split()[0])
    shape = between(ShapeKind.CYLINDER, ShapePart.LINK, radius, ends[:3], ends[3:])
    vertices, faces = shape_triangles(shape)
    return Solid(
        position=position_of(shape.T_link_shape),
        orientation=orientation_of(shape.T_link_shape),
        vertices=vertices,
        faces=faces,
        color=_COLOR,
    )
