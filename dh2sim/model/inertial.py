"""Mass properties of a link, from what its robot file says and from its shapes."""

from __future__ import annotations

from dh2sim.kinematics.chain import Joint
from dh2sim.model.mass import MassProperties, at_least, combine, in_frame, made_possible, of_shape
from dh2sim.model.shapes import Shape
from dh2sim.robot.spec import LinkSpec
from dh2sim.typing import read_only

ASSUMED_DENSITY = 1000.0
"""kg/m³: what a hollow arm with its motors weighs is nearer to water than to aluminium."""

LEAST_MASS = 1e-9
"""kg, and"""
LEAST_INERTIA = 1e-14
"""kg·m²: estimates are no smaller. MuJoCo refuses moving bodies of less than 1e-15."""


def link_inertial(
    link: LinkSpec, joint: Joint, shapes: tuple[Shape, ...]
) -> tuple[MassProperties | None, tuple[str, ...]]:
    """Mass properties of a link, what the robot file gives winning over what the shapes tell.

    Args:
        link: what the file says; centre of mass and inertia in DH frame i.
        joint: the link's joint.
        shapes: of the link, solid. A given mass scales their inertia, a given centre of mass moves it.

    Returns:
        The properties in the joint frame, and which of 'mass', 'com' and 'inertia' were estimated; None for a link
        of which nothing is known.
    """
    given = {"mass": link.mass, "com": link.com, "inertia": link.inertia}
    if not shapes and all(value is None for value in given.values()):
        return None, ()
    estimate = _estimate(link, shapes)
    mass = max(estimate.mass, LEAST_MASS) if link.mass is None else link.mass
    com, inertia = estimate.com, at_least(read_only(estimate.inertia * (mass / estimate.mass)), LEAST_INERTIA)
    in_dh = in_frame(
        joint.T_joint_dh,
        MassProperties(
            mass=mass,
            com=read_only([0, 0, 0]) if link.com is None else link.com,
            inertia=read_only([[0.0] * 3] * 3) if link.inertia is None else link.inertia,
        ),
    )
    if link.com is not None:
        com = in_dh.com
    if link.inertia is not None:
        inertia = in_dh.inertia
    body = MassProperties(mass=mass, com=com, inertia=made_possible(inertia))
    return body, tuple(k for k, v in given.items() if v is None)


def _estimate(link: LinkSpec, shapes: tuple[Shape, ...]) -> MassProperties:
    """From the shapes; a fixed link without any, but with a mass, counts as a small ball at its joint."""
    if shapes:
        return combine(of_shape(shape, link.density or ASSUMED_DENSITY) for shape in shapes)
    mass, r = link.mass or 1.0, link.radius or 0.01
    I = 2 / 5 * mass * r * r  # noqa: E741
    return MassProperties(mass=mass, com=read_only([0, 0, 0]), inertia=read_only([[I, 0, 0], [0, I, 0], [0, 0, I]]))
