"""Mass, centre of mass and inertia: of solid primitives in closed form, of what is built from them, and of links.

Everything is done in plain double arithmetic in a fixed order, so that every machine writes the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dh2sim.kinematics.transforms import Rows, move_point, rotate_tensor, rotated_tensor
from dh2sim.model.shapes import Shape, ShapeKind
from dh2sim.robot.links import LinkSpec
from dh2sim.robot.magnitudes import INERTIA
from dh2sim.robot.parts import inertia_problem
from dh2sim.typing import Array, Point, read_only

ROUNDING = (0.0, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5)
"""Shares of its trace by which an inertia may be mended: numbers in robot files are rounded."""
ASSUMED_DENSITY = 1300.0
"""kg/m³, of housings and tubes as if solid: fitted to the masses that makers publish, see docs/bodies.md."""
THIN = 1e-12
"""Share of its trace below which a moment of inertia is zero but for rounding."""
THICKNESS = 1e-9
"""Share of its trace by which the inertia of a thin rod is made greater."""
NOTHING = 1e-15
"""Share of its trace below which an entry of a combined inertia is rounding: a zero lets MuJoCo keep its axes."""
TOOL_DENSITY = 1000.0
"""kg/m³: of tools and payloads, grippers and boxes that are not full."""
MIN_MASS = 1e-9
"""kg: estimates are no smaller."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MassProperties:
    """Mass properties of a rigid body in some frame."""

    mass: float
    """kg."""
    com: Array
    """Centre of mass, m, shape (3,)."""
    inertia: Array
    """About the centre of mass, along the frame's axes, kg·m², shape (3, 3)."""


LIGHTEST = MassProperties(
    mass=2e-14,
    com=read_only([0, 0, 0]),
    inertia=read_only([[2e-14, 0, 0], [0, 2e-14, 0], [0, 0, 2e-14]]),
)
"""What simulators are given for a link that moves and weighs nothing.

MuJoCo refuses moving bodies of less than 1e-15 kg, and in a URDF inertias of less than 1e-14 kg·m².
"""


def _solid(shape: Shape, density: float) -> tuple[float, Sequence[float], Rows]:
    """Return mass, centre of mass and inertia of a solid shape in its link's frame; ``density`` in kg/m³.

    Cylinder: I_z = m r²/2, I_x = m (3 r² + l²)/12. The capsule adds two half balls of mass m_b = 2/3 π r³ ρ, whose
    centres of mass lie 3/8 r beyond the cylinder's ends: I_z += 2 · 2/5 m_b r²,
    I_x += 2 m_b (2/5 r² + l²/4 + 3/8 l r). Ball: 2/5 m r². Box: I_x = m (y² + z²)/12.
    (Beer & Johnston, Vector Mechanics, tables of inertia; parallel axes.)
    """
    r, length, T = shape.radius, shape.length, shape.T_link_shape.tolist()
    com = [T[0][3], T[1][3], T[2][3]]
    if shape.size is not None:
        x, y, z = shape.size
        mass = density * x * y * z
        I_x, I_y, I_z = (mass * (u * u + v * v) / 12 for u, v in ((y, z), (x, z), (x, y)))
        return mass, com, rotated_tensor(T, [[I_x, 0.0, 0.0], [0.0, I_y, 0.0], [0.0, 0.0, I_z]])
    if shape.kind is ShapeKind.SPHERE:
        mass = density * 4 / 3 * math.pi * r * r * r
        return mass, com, ball(mass, r).inertia.tolist()
    mass = density * math.pi * r * r * length
    I_z = mass * r * r / 2
    I_x = mass * (3 * r * r + length * length) / 12
    if shape.kind is ShapeKind.CAPSULE:
        half_ball = density * math.pi * r * r * r * 2 / 3
        I_z += 2 * half_ball * (2 / 5) * r * r
        I_x += 2 * half_ball * (2 / 5 * r * r + length * length / 4 + 3 / 8 * length * r)
        mass += 2 * half_ball
    return mass, com, rotated_tensor(T, [[I_x, 0.0, 0.0], [0.0, I_x, 0.0], [0.0, 0.0, I_z]])


def ball(mass: float, radius: float) -> MassProperties:
    """Return a solid ball at the origin; kg, m."""
    I = 2 / 5 * mass * radius * radius  # noqa: E741
    return MassProperties(mass=mass, com=read_only([0, 0, 0]), inertia=read_only([[I, 0, 0], [0, I, 0], [0, 0, I]]))


def ball_radius(mass: float) -> float:
    """Return the radius, m, of a solid ball of the density of tools, to three digits; ``mass`` in kg."""
    return float(f"{(3 * mass / (4 * math.pi * TOOL_DENSITY)) ** (1 / 3):.3g}")


def combine(parts: Iterable[MassProperties]) -> MassProperties:
    """Combine rigid bodies that are fixed to each other, all given in one frame (parallel-axis theorem)."""
    return _combined([(part.mass, part.com.tolist(), part.inertia.tolist()) for part in parts])


def _combined(bodies: Sequence[tuple[float, Sequence[float], Rows]]) -> MassProperties:
    mass = math.fsum([m for m, _, _ in bodies])
    cx, cy, cz = (math.fsum([m * com[i] for m, com, _ in bodies]) / mass for i in range(3))
    tensors = [shifted_inertia(inertia, m, (x - cx, y - cy, z - cz)) for m, (x, y, z), inertia in bodies]
    inertia = [[math.fsum(same) for same in zip(*rows, strict=True)] for rows in zip(*tensors, strict=True)]
    least = NOTHING * (inertia[0][0] + inertia[1][1] + inertia[2][2])
    inertia = [[0.0 if abs(inertia[i][j]) < least else inertia[i][j] for j in range(3)] for i in range(3)]
    return MassProperties(mass=mass, com=read_only([cx, cy, cz]), inertia=read_only(inertia))


def shifted_inertia(inertia: Rows, mass: float, offset: Sequence[float]) -> list[list[float]]:
    """Return the inertia, shape (3, 3), about a point ``offset`` (m) from the centre: I + m (o·o E - o oᵀ)."""
    x, y, z = offset
    square = x * x + y * y + z * z
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = inertia
    return [
        [xx + mass * (square - x * x), xy + mass * (0.0 - x * y), xz + mass * (0.0 - x * z)],
        [yx + mass * (0.0 - y * x), yy + mass * (square - y * y), yz + mass * (0.0 - y * z)],
        [zx + mass * (0.0 - z * x), zy + mass * (0.0 - z * y), zz + mass * (square - z * z)],
    ]


def is_possible(inertia: Array) -> bool:
    """Whether a body can have an inertia, shape (3, 3), that simulators read.

    As a robot file allows it: all moments are large enough; two may fall short of the third by 1e-9 of it.
    """
    return inertia_problem(inertia) is None


def made_possible(inertia: Array) -> Array:
    """Return the inertia, shape (3, 3), mended so that no two principal moments make less than the third.

    A flat body has A + B = C, which is A + B < C after rounding, and then MuJoCo refuses the file. The second moments
    of mass, tr(I)/2 E - I, are what must be positive; a multiple of E is added where they are not, no greater than
    it takes.
    """
    rows = inertia.tolist()
    trace = rows[0][0] + rows[1][1] + rows[2][2]
    least = 0.1 * ROUNDING[1] * trace  # readers' own rounding is some thousand times less
    for share in ROUNDING:
        extra = share * trace
        half = (
            0.5 * (trace + extra) - least
        )  # all eigenvalues of what follows are positive: pivots alone do not say so
        moments = [[(half if i == j else 0.0) - x for j, x in enumerate(row)] for i, row in enumerate(rows)]
        if min(_pivots(moments)) > 0.0:
            return read_only(
                [[x + (extra if i == j else 0.0) for j, x in enumerate(row)] for i, row in enumerate(rows)]
            )
    return inertia


def thickened(inertia: Array) -> Array | None:
    """Return the inertia, shape (3, 3), of a thin rod with a moment about the rod that survives being turned.

    That of an ideal rod is 0; rounding leaves it a little above or below, where turning the axes may make it the
    other. Every moment is greater by 1e-9 of the trace then, or by what is lacking to the least that simulators read.
    Other inertias are returned as they are.

    Returns:
        None where no body has such an inertia.
    """
    scale = float(np.abs(inertia).max())
    if not 0.0 < scale < math.inf:
        return None
    trace = float(inertia[0, 0]) + float(inertia[1, 1]) + float(inertia[2, 2])
    least = float(np.linalg.eigvalsh(inertia / scale)[0]) * scale
    if least < -THIN * trace:
        return None
    if least <= THIN * trace:
        extra = THICKNESS * trace
        inertia = read_only([[float(inertia[i, j]) + (extra if i == j else 0.0) for j in range(3)] for i in range(3)])
    inertia = substantial(inertia)
    return inertia if is_possible(inertia) else None


def substantial(inertia: Array) -> Array:
    """Return the inertia, shape (3, 3), with all principal moments great enough for simulators.

    Where one may be below ``INERTIA.least``, or ``THIN`` of the trace, which is rounding, all are greater by that.
    """
    trace = float(inertia[0, 0]) + float(inertia[1, 1]) + float(inertia[2, 2])
    least = max(INERTIA.least, THIN * trace) * (1.0 - 1e-9)  # turned, one that is just enough may be less
    less = [[x - (least if i == j else 0.0) for j, x in enumerate(row)] for i, row in enumerate(inertia.tolist())]
    if min(_pivots(less)) > 0.0:
        return inertia
    return read_only([[float(inertia[i, j]) + (least if i == j else 0.0) for j in range(3)] for i in range(3)])


def _pivots(A: list[list[float]]) -> list[float]:
    """Return the pivots of a symmetric matrix, up to the first not positive; all are if it is positive definite."""
    first = A[0][0]
    if first <= 0.0:
        return [first]
    b, c, d = (A[i][j] - A[0][i] * A[0][j] / first for i, j in ((1, 1), (1, 2), (2, 2)))
    return [first, b] if b <= 0.0 else [first, b, d - c * c / b]


def in_frame(T: Array, body: MassProperties) -> MassProperties:
    """Return ``body``, given in frame b, in the frame a in which b has pose ``T`` (T_a_b, shape (4, 4))."""
    return MassProperties(
        mass=body.mass, com=read_only(move_point(T, body.com)), inertia=rotate_tensor(T, body.inertia)
    )


def link_inertial(
    link: LinkSpec, T_link_dh: Array, shapes: tuple[Shape, ...], anchor: Point
) -> tuple[MassProperties | None, tuple[str, ...]]:
    """Return the mass properties of a link; what the robot file gives wins over estimates from the shapes.

    Args:
        link: As in the file; centre of mass and inertia in DH frame i.
        T_link_dh: Pose of DH frame i in the link, shape (4, 4).
        shapes: Of the link, solid. A given mass scales their inertia, a given centre of mass moves it.
        anchor: Where a link without shapes counts as a ball, in the joint frame, m.

    Returns:
        The properties in the link's frame, and which of 'mass', 'com' and 'inertia' were estimated; None for a link
        of mass 0, and for one of which nothing is known.
    """
    if link.mass == 0.0:
        return None, ()
    given = {"mass": link.mass, "com": link.com, "inertia": link.inertia}
    if not shapes and all(value is None for value in given.values()):
        return None, ()
    estimate = _estimate(link, shapes, anchor)
    estimate = _of_mass(estimate, max(estimate.mass, MIN_MASS) if link.mass is None else link.mass)
    mass, com, inertia = estimate.mass, estimate.com, estimate.inertia
    if link.com is not None:
        com = read_only(move_point(T_link_dh, link.com))
    if link.inertia is not None:
        inertia = rotate_tensor(T_link_dh, link.inertia)
    body = MassProperties(mass=mass, com=com, inertia=made_possible(substantial(inertia)))
    return body, tuple(k for k, v in given.items() if v is None)


def of_shapes(shapes: Iterable[Shape], density: float) -> MassProperties:
    """Return the mass properties of a link of solid shapes, none too small for MuJoCo; ``density`` in kg/m³."""
    whole = _combined([_solid(shape, density) for shape in shapes if shape.solid])
    whole = _of_mass(whole, max(whole.mass, MIN_MASS))
    return replace(whole, inertia=made_possible(whole.inertia))


def _of_mass(body: MassProperties, mass: float) -> MassProperties:
    """Return a body of the same shape and another mass, kg; its inertia is not too small for MuJoCo."""
    return replace(body, mass=mass, inertia=substantial(read_only(body.inertia * (mass / body.mass))))


def _estimate(link: LinkSpec, shapes: tuple[Shape, ...], anchor: Point) -> MassProperties:
    """Estimate from the shapes; a fixed link without any, but with a mass, counts as a small ball."""
    if shapes:
        density = link.density or ASSUMED_DENSITY
        return _combined([_solid(shape, density) for shape in shapes if shape.solid])
    return replace(ball(link.mass or 1.0, link.radius or 0.01), com=read_only(anchor))
