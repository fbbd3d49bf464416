"""RobotModel -> an MJCF scene around the robot: floor, light, and a camera that frames it."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass

from dh2sim.formats.xml_write import child, document, number, numbers, provenance
from dh2sim.kinematics.forward import reference_joint_poses
from dh2sim.kinematics.transforms import compose, identity, move_point
from dh2sim.kinematics.tree import body_poses
from dh2sim.model.mechanism import MechanismModel, written_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.shapes import Shape, ShapeKind
from dh2sim.robot.spec import SpecLike
from dh2sim.typing import Array, read_only

VIEW_DIRECTION = (1.0, -1.25, 0.62)
"""From the camera's target to the camera."""
FIELD_OF_VIEW = 40.0
"""Vertical, degrees."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Extent:
    """A ball around the robot in its home configuration, m."""

    centre: tuple[float, float, float]
    radius: float
    lowest: float
    """Height of the lowest part."""
    foot: float | None
    """Height of the foot of the base; None where the arm hangs from it."""


def to_scene(model: SpecLike) -> str:
    """Write a scene that includes the robot's MJCF, ``<name>.xml`` beside it.

    Args:
        model: the robot, in any form.

    Returns:
        The text of the file. The floor is at z = 0, or at the foot of the base if that is lower; below the arm
        where that is lower at home, and then the base stands on a pedestal.
    """
    written = written_model(model)
    main = written.main if isinstance(written, MechanismModel) else written
    extent = _extent(written)
    cell = 10.0 ** math.floor(math.log10(extent.radius))
    floor = 0.0 if extent.foot is None else min(0.0, extent.foot)
    if extent.lowest < floor - 1e-6 * extent.radius:
        floor = _short(extent.lowest - 0.15 * extent.radius)
    root = ET.Element("mujoco", model=f"{main.name} scene")
    child(root, "include", file=f"{main.name}.xml")
    child(root, "statistic", center=numbers(extent.centre), extent=number(extent.radius))
    visual = child(root, "visual")
    child(visual, "headlight", ambient="0.35 0.35 0.35", diffuse="0.45 0.45 0.45", specular="0.1 0.1 0.1")
    child(visual, "global", azimuth="130", elevation="-20", offwidth="1920", offheight="1080")
    child(visual, "quality", shadowsize="8192", offsamples="8")
    child(visual, "rgba", haze="0.86 0.89 0.93 1")
    child(visual, "map", znear="0.01", zfar="60", shadowclip="3")
    _scene_assets(root, cell)
    world = child(root, "worldbody")
    _lights(world, extent)
    child(
        world,
        "geom",
        name="floor",
        type="plane",
        pos=numbers([0, 0, floor]),
        size="0 0 0.05",
        material="floor",
    )
    if extent.foot is not None and floor < extent.foot:
        _pedestal(world, main, floor, extent.foot)
    _camera(world, extent)
    return document(root, provenance(written)[:2])


def _extent(model: RobotModel | MechanismModel) -> _Extent:
    main = model.main if isinstance(model, MechanismModel) else model
    if isinstance(model, MechanismModel):
        poses = [identity(), *body_poses(model.tree, model.q)]
    else:
        poses = [identity(), *reference_joint_poses(model.chain, model.home)]
    if main.tool is not None:
        poses.append(compose(poses[len(main.joints)], main.joints[-1].T_joint_dh))
    points, lowest = [], 0.0
    for link, T in zip(model.all_links, poses, strict=True):
        for shape in link.shapes:
            points += [(move_point(T, point), shape.radius) for point in shape.ends]
            lowest = min(lowest, _lowest(shape, T))
    plate, *others = (_lowest(shape, poses[0]) for shape in model.base.shapes)
    foot = _short(plate) if all(plate <= other for other in others) else None
    low = [min(point[k] - r for point, r in points) for k in range(3)]
    high = [max(point[k] + r for point, r in points) for k in range(3)]
    centre = [_short(0.5 * (a + b)) for a, b in zip(low, high, strict=True)]
    radius = max(math.dist(point, centre) + r for point, r in points)
    return _Extent(centre=(centre[0], centre[1], centre[2]), radius=_short(radius), lowest=_short(lowest), foot=foot)


def _lowest(shape: Shape, T: Array) -> float:
    """Return the height of the lowest point of a shape, m, a cylinder or not."""
    start, end = (move_point(T, point) for point in shape.ends)
    drop = shape.radius
    if shape.kind is ShapeKind.CYLINDER:  # by how much a disc square to the axis is lower than its centre
        slope = (end[2] - start[2]) / shape.length
        drop *= math.sqrt(max(0.0, 1.0 - slope * slope))
    return min(start[2], end[2]) - drop


def _scene_assets(root: ET.Element, cell: float) -> None:
    asset = child(root, "asset")
    child(
        asset,
        "texture",
        type="skybox",
        builtin="gradient",
        rgb1="0.86 0.89 0.93",
        rgb2="0.55 0.65 0.78",
        width="64",
        height="384",
    )
    child(
        asset,
        "texture",
        name="grid",
        type="2d",
        builtin="checker",
        rgb1="0.80 0.82 0.85",
        rgb2="0.74 0.76 0.80",
        mark="edge",
        markrgb="0.88 0.90 0.92",
        width="512",
        height="512",
    )
    repeat = numbers([0.5 / cell, 0.5 / cell])
    child(asset, "material", name="floor", texture="grid", texuniform="true", texrepeat=repeat)
    child(asset, "material", name="pedestal", rgba="0.62 0.64 0.68 1", specular="0.2", shininess="0.2")


def _lights(world: ET.Element, extent: _Extent) -> None:
    x, y, z = extent.centre
    r = extent.radius
    above = numbers([_short(x + r), _short(y - r), _short(z + 4 * r)])
    child(world, "light", pos=above, dir="-0.25 0.25 -1", type="directional", diffuse="0.55 0.55 0.55")


def _pedestal(world: ET.Element, model: RobotModel, floor: float, foot: float) -> None:
    """Add a pedestal under the foot of the base where the floor is lower; it is only shown, and does not collide."""
    radius = 0.8 * max(shape.radius for shape in model.base.shapes)
    child(
        world,
        "geom",
        name="pedestal",
        type="cylinder",
        fromto=numbers([0, 0, floor, 0, 0, foot]),
        size=number(_short(radius)),
        material="pedestal",
        contype="0",
        conaffinity="0",
    )


def _camera(world: ET.Element, extent: _Extent) -> None:
    norm = math.sqrt(sum(x * x for x in VIEW_DIRECTION))
    back = [x / norm for x in VIEW_DIRECTION]
    distance = extent.radius / math.sin(math.radians(FIELD_OF_VIEW / 2))
    across = math.hypot(back[0], back[1])
    right = [-back[1] / across, back[0] / across, 0.0]
    up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2], across]
    position = read_only([c + distance * b for c, b in zip(extent.centre, back, strict=True)])
    child(
        world,
        "camera",
        name="overview",
        pos=numbers(_short(float(x)) for x in position),
        xyaxes=numbers(_short(x) for x in (*right, *up)),
        fovy=number(FIELD_OF_VIEW),
    )


def _short(value: float) -> float:
    """Round to four significant digits: a scene needs no more, and every machine rounds to the same."""
    return float(f"{value:.4g}")
