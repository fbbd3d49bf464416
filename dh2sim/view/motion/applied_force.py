"""Forces on a simulated robot: a constant one, or the spring with which the mouse drags a link."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError
from dh2sim.messages import did_you_mean, listed, shown
from dh2sim.typing import Array, read_only

NATURAL_FREQUENCY = 10.0
"""rad/s: of the spring with the mass that it drags, were that free; as in MuJoCo's own viewer."""
MAX_ACCELERATION = 100.0
"""m/s²: that the spring gives the mass at most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DragSpring:
    """A spring with a damper, critically damped for the mass that it drags."""

    stiffness: float
    """N/m."""
    damping: float
    """N·s/m."""
    max_force: float
    """N."""


def drag_spring(mass: float) -> DragSpring:
    """Return a spring that feels the same for light and heavy robots.

    Args:
        mass: Effective mass of the grabbed point, kg.
    """
    return DragSpring(
        stiffness=mass * NATURAL_FREQUENCY**2,
        damping=2.0 * mass * NATURAL_FREQUENCY,
        max_force=mass * MAX_ACCELERATION,
    )


def spring_force(spring: DragSpring, point: ArrayLike, velocity: ArrayLike, target: ArrayLike) -> Array:
    """Return the force of a spring between a point of a link and the mouse.

    Args:
        spring: The spring.
        point: Position of the grabbed point, m, shape (3,).
        velocity: Its velocity, m/s, shape (3,).
        target: Position of the mouse, m, shape (3,).

    Returns:
        The force on the link at that point, N, read-only, shape (3,).
    """
    stretch = 0.5 * np.asarray(target, dtype=float) - 0.5 * np.asarray(point, dtype=float)  # halves never overflow
    force = spring.stiffness * 2.0 * _shortened(stretch, 0.5 * spring.max_force / spring.stiffness)
    return read_only(_shortened(force - spring.damping * np.asarray(velocity, dtype=float), spring.max_force))


def _shortened(vector: Array, longest: float) -> Array:
    """Return a vector with the same direction and a length of at most ``longest``."""
    greatest = float(np.abs(vector).max())
    if greatest == 0.0:
        return vector
    direction = vector / greatest
    length = math.hypot(*direction)
    return vector if greatest <= longest / length else direction * (longest / length)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkPoint:
    """A point of a link."""

    body: int
    """Of the link in MuJoCo."""
    point: Array
    """In the link's frame, m, shape (3,)."""

    def position(self, data: mujoco.MjData) -> Array:
        """Return the position of the point, m, shape (3,)."""
        return np.asarray(data.xpos[self.body] + data.xmat[self.body].reshape(3, 3) @ self.point)

    def jacobian(self, model: mujoco.MjModel, data: mujoco.MjData) -> Array:
        """Return the derivative of its position by the joint positions, shape (3, nv)."""
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, self.position(data), self.body)
        return jacobian

    def effective_mass(self, model: mujoco.MjModel, data: mujoco.MjData) -> float:
        """Return the mass that somebody who drags the point feels, averaged over all directions, kg.

        The inverse of J M⁻¹ Jᵀ, the mobility of the point: O. Khatib, A unified approach for motion and force control
        of robot manipulators, IEEE J. Robotics and Automation 3(1), 1987. At most the mass of everything that moves.
        """
        whole = float(model.body_subtreemass[0])
        jacobian = self.jacobian(model, data)
        solved = np.zeros_like(jacobian)
        mujoco.mj_solveM(model, data, solved, jacobian)
        mobility = float(np.sum(jacobian * solved)) / 3.0
        return 1.0 / mobility if mobility * whole > 1.0 else whole


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpringForce:
    """The force of a spring."""

    place: LinkPoint
    target: Array
    """Where the other end of the spring is, m, shape (3,)."""
    spring: DragSpring

    def force_at(self, point: Array, velocity: Array) -> Array:
        """Return the force, N, shape (3,), on a point at ``point`` with ``velocity``, m and m/s."""
        return spring_force(self.spring, point, velocity, self.target)


def joint_forces(applied: SpringForce, model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the joint forces of an applied force, N·m or N, shape (nv,), by the principle of virtual work."""
    jacobian = applied.place.jacobian(model, data)
    with np.errstate(over="ignore", invalid="ignore"):  # the result is checked after the time step
        force = applied.force_at(applied.place.position(data), jacobian @ data.qvel)
        return np.asarray(force @ jacobian)


def find_point(bodies: Mapping[str, int], link: str, point_in_link: ArrayLike) -> LinkPoint:
    """Return a point of a link.

    Args:
        bodies: MuJoCo's numbers of the links, by name.
        link: Name of the link.
        point_in_link: m, shape (3,).

    Raises:
        ConfigurationError: The link is unknown, or the point is not three finite numbers.
    """
    if link not in bodies:
        raise ConfigurationError(f"unknown link {shown(link)}.{did_you_mean(link, bodies)} Links: {listed(bodies)}")
    return LinkPoint(body=bodies[link], point=finite_vector(point_in_link, "the point"))


def finite_vector(values: ArrayLike, what: str) -> Array:
    """Return three finite numbers as an array.

    Raises:
        ConfigurationError: They are not.
    """
    array = read_only(values)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise ConfigurationError(f"{what} must be three finite numbers, got {np.asarray(values).tolist()}")
    return array
