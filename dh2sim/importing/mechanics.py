"""Mass matrices and gravity forces of an imported robot, compared with those of the file that it was made from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dh2sim.formats.serial_robot import Mechanics
from dh2sim.formats.urdf.mechanics import urdf_mechanics
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.formats.xml_read import parse_xml
from dh2sim.kinematics.sampling import random_configurations
from dh2sim.model.build import build_model
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array

CONFIGURATIONS = 20
SEED = 0
LEAST = 1e-3
"""Lower bound of forces and roots of inertias that errors are relative to, as a share of the greatest."""
NO_LOAD = 1e-6
"""Forces below this share of the greatest inertia times 9.81 are rounding, as in an arm that moves on a plane."""
TOLERANCE = 1e-6
"""Relative; larger differences are reported. Numbers of a robot file are rounded to 1e-9 m."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MechanicsResidual:
    """The greatest differences over all configurations, relative."""

    mass_matrix: float
    """Of an entry, over sqrt(M_ii M_jj)."""
    gravity: float
    """Of a joint's force that balances gravity, over the greatest on that joint."""
    worst: str
    """The joint where the larger of the two is greatest."""
    configurations: int

    @property
    def small(self) -> bool:
        """Whether both are within ``TOLERANCE``."""
        return self.mass_matrix <= TOLERANCE and self.gravity <= TOLERANCE


def relative_errors(found: tuple[Array, Array], source: tuple[Array, Array]) -> tuple[Array, Array]:
    """Return the errors of mass matrices and gravity forces by configuration and joint, each of shape (N, n)."""
    (mass, load), (mass_0, load_0) = found, source
    diagonal = np.sqrt(np.maximum(np.einsum("kii->ki", mass_0), 0.0))
    diagonal = np.maximum(diagonal, LEAST * diagonal.max())
    force = np.abs(load_0).max(axis=0)
    rounding = NO_LOAD * 9.81 * float(np.square(diagonal).max())
    force = np.maximum(force, max(LEAST * max(force.max(), np.abs(load).max()), rounding))
    of_mass = np.abs(mass - mass_0) / (diagonal[:, :, None] * diagonal[:, None, :])
    return of_mass.max(axis=2), np.abs(load - load_0) / np.where(force > 0.0, force, 1.0)


def measure_mechanics(spec: RobotSpec, source: Mechanics) -> MechanicsResidual | None:
    """Compare what is exported of a robot with its source, at random configurations inside the limits.

    Args:
        spec: The robot; its moving rows are the joints of the source, in the same order.
        source: The source's own mechanics.

    Returns:
        The differences; None where the source gives no masses.
    """
    plain = replace(
        spec,
        base=replace(spec.base, mesh=None),
        rows=tuple(replace(row, link=replace(row.link, mesh=None)) for row in spec.rows),
    )
    model = build_model(plain)
    names = [joint.name for joint in model.moving_joints]
    q = random_configurations(*model.travel, CONFIGURATIONS, SEED)
    exported = parse_xml(to_urdf(model, dh_frames=False).encode(), file="export")
    with np.errstate(all="ignore"):
        own = source(q)
        if not np.einsum("kii->ki", own[0]).any():
            return None
        found = urdf_mechanics(exported, names, gravity=spec.gravity.tolist())(q)
        return residual(relative_errors(found, own), names)


def residual(errors: tuple[Array, Array], joints: Sequence[str]) -> MechanicsResidual:
    """Return the greatest of errors, each of shape (N, n); a NaN is greater than any number."""
    by_joint = np.maximum(*errors).max(axis=0)
    return MechanicsResidual(
        mass_matrix=float(errors[0].max()),
        gravity=float(errors[1].max()),
        worst=joints[int(np.argmax(by_joint))],
        configurations=len(errors[0]),
    )
