"""Checks of what a free motion conserves: energy up to the integrator's error, and momentum."""

from __future__ import annotations

import mujoco
import numpy as np

from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import with_base_mass
from dh2sim.typing import Array
from dh2sim.validate.motion.free_motion import State, random_states, simulate
from dh2sim.validate.motion.mechanics import bodies, energy
from dh2sim.validate.report import Check, Quantity, finding

ORDER = 4
"""Order of RK4: its energy error decreases with this power of the timestep, or a higher one."""
ORDER_TOLERANCE = 0.5
ENERGY_STARTS = 4
SMALL = 1e-7
"""Relative energy error below which the order is measured: larger timesteps do not show it yet, and smaller ones take
longer."""
MOST_SUBSTEPS = 1024
HALVINGS = 3
"""Halvings of the timestep over which the order is measured."""
ROUNDING = 1e-12
"""Energy errors below this are rounding, relative to the energy, or to the potential energy if that is larger."""
MOMENTUM_TOLERANCE = 1e-9
"""Of the sum of all links' momenta."""
MOMENTUM_STARTS = 2
MOMENTUM_SUBSTEPS = 1024


def check_energy(model: RobotModel, compiled: mujoco.MjModel, *, seed: int = 0) -> Check:
    """Measure how the energy error of the passive, frictionless arm decreases with the timestep.

    The error of RK4 is c h⁴ + O(h⁵): half the timestep h leaves a sixteenth of it. It decreases faster where c
    happens to vanish, and there may be no error at all (a joint that turns uniformly, a slide in free fall). A force
    that does work, masses other than the model's, or an integrator of lower order make it decrease more slowly, or
    not at all. The energy is computed from the table and the masses, not by MuJoCo.

    Args:
        model: The robot.
        compiled: The result of ``free_model``.
        seed: Seed of the initial states.

    Returns:
        A check whose error is by how much the measured order is below 4.
    """
    states = random_states(model, compiled, ENERGY_STARTS, np.random.default_rng([seed, 1]))
    substeps, errors = 1, [np.inf] * (HALVINGS + 1)
    while errors[0] > SMALL and substeps <= MOST_SUBSTEPS:
        errors = [*errors[1:], _energy_error(model, compiled, states, substeps)]
        substeps *= 2
    shortfall = max(0.0, ORDER - _power(np.array(errors)))
    return finding(
        Quantity.ENERGY,
        shortfall,
        ORDER_TOLERANCE,
        samples=ENERGY_STARTS,
        failure=f"the energy error with RK4 decreases with the power {ORDER - shortfall:.2f} of the timestep instead "
        f"of {ORDER}: from {errors[0]:.1e} of the energy to {errors[-1]:.1e} in {HALVINGS} halvings",
    )


def check_momentum(model: RobotModel, compiled: mujoco.MjModel, *, seed: int = 0) -> Check:
    """Require linear and angular momentum of the robot to be constant while its motors work.

    Its base floats without gravity, and has the mass of its shapes. Before 4.0 MuJoCo's RK4 is only of second order
    for a body that rotates freely: it adds angular velocities along axes that have rotated meanwhile. So the momentum
    is extrapolated to timestep zero from two timesteps (Richardson), which are halved until the error is well below
    the tolerance; other errors remain. Momenta are computed from the table and the masses, not by MuJoCo.

    Args:
        model: The robot.
        compiled: The result of ``free_model(model, floating_base=True)``.
        seed: Seed of the initial states.

    Returns:
        A check whose error is relative to the sum of all links' momenta, angular ones about the centre of mass.
    """
    model = with_base_mass(model)
    states = random_states(model, compiled, MOMENTUM_STARTS, np.random.default_rng([seed, 2]))
    linear, angular = np.max([_momentum_errors(model, compiled, state) for state in states], axis=0).tolist()
    return finding(
        Quantity.MOMENTUM,
        max(linear, angular),
        MOMENTUM_TOLERANCE,
        samples=MOMENTUM_STARTS,
        failure=f"linear momentum changes by {linear:.1e} of all links' momenta, angular momentum by {angular:.1e} "
        f"(tolerance {MOMENTUM_TOLERANCE:g})",
    )


def _energy_error(model: RobotModel, compiled: mujoco.MjModel, states: tuple[State, ...], substeps: int) -> float:
    """Return the greatest change of the energy, relative to the energy; infinite if a simulation is unstable.

    0 where it is rounding.
    """
    worst = 0.0
    for state in states:
        motion = simulate(compiled, state, substeps)
        with np.errstate(all="ignore"):
            potential, kinetic = energy(model, motion.q, motion.v)
            total = potential + kinetic
            change = float(np.max(np.abs(total - total[0])))
            size = float(np.max(kinetic) + np.ptp(potential))
        if not np.isfinite(change):
            return np.inf
        if change > ROUNDING * max(size, float(np.max(np.abs(potential)))):
            worst = max(worst, change / size)
    return worst


def _power(errors: Array) -> float:
    """Return the power of the timestep with which errors decrease when it is halved repeatedly.

    ``ORDER`` if there are none, or none after a few halvings; 0 if they are not finite.
    """
    if not np.isfinite(errors).all():
        return 0.0
    used = errors[errors > 0.0]
    if len(used) < 2:
        return float(ORDER)
    return -float(np.polyfit(np.arange(len(used)), np.log2(used), 1)[0])


def _momentum_errors(model: RobotModel, compiled: mujoco.MjModel, state: State) -> tuple[float, float]:
    """Return the relative changes of linear and angular momentum, extrapolated to timestep zero."""
    substeps = 1
    coarse = _momenta(model, compiled, state, substeps)
    errors = (np.inf, np.inf)
    while max(errors) > 0.01 * MOMENTUM_TOLERANCE and substeps < MOMENTUM_SUBSTEPS:
        substeps *= 2
        fine = _momenta(model, compiled, state, substeps)
        errors = (_change(coarse[0], fine[0]), _change(coarse[1], fine[1]))
        coarse = fine
    return errors


def _momenta(model: RobotModel, compiled: mujoco.MjModel, state: State, substeps: int) -> tuple[Array, Array]:
    """Return the linear and angular momenta of all links, shape (RECORDS + 1, L, 3) each."""
    motion = simulate(compiled, state, substeps)
    with np.errstate(all="ignore"):
        links = bodies(model, motion.q, motion.v, motion.base)
        return links.momentum, links.angular_momentum


def _change(coarse: Array, fine: Array) -> float:
    """Return the greatest change of the total momentum over the sum of links' magnitudes; infinite if unstable."""
    with np.errstate(all="ignore"):
        total = (4.0 * fine.sum(axis=1) - coarse.sum(axis=1)) / 3.0
        size = float(np.linalg.norm(fine, axis=2).sum(axis=1).max())
        change = float(np.linalg.norm(total - total[0], axis=1).max())
    if not np.isfinite(change):
        return np.inf
    return change / size if size > 0.0 else 0.0
