"""Controllers of torques and forces: none, gravity compensation, PD and computed torque."""

from __future__ import annotations

import functools
from typing import Annotated, Final

import mujoco
import numpy as np

from dh2sim.errors import ControllerError
from dh2sim.robot.row import ActuatorType
from dh2sim.simulate.controllers.options import Within
from dh2sim.simulate.controllers.protocol import Observation, Prepared, RolloutBatch
from dh2sim.simulate.controllers.reference import SampledReference, read_reference
from dh2sim.simulate.controllers.trajectories import Amplitude, Period, SmoothReference
from dh2sim.simulate.plant import Plant
from dh2sim.trajectory.files import SampledTrajectory
from dh2sim.typing import Array

MOST_DAMPED: Final = 0.4
"""Largest share of its velocity that damping takes from a joint in a time step at home."""
MOST_DAMPED_ELSEWHERE: Final = 0.8
"""The same in other configurations; from 2 on the arm would oscillate."""
POSES: Final = 64
"""Configurations, besides home, in which that is looked at."""
ROUNDS: Final = 300
"""Of reducing the damping in the configuration that is worst."""


def steady_gains(plant: Plant) -> tuple[Array, Array]:
    """Return what ``_steady_gains`` does; of shape (batch, n) where the plant is that of designs."""
    if not plant.each:
        return _steady_gains(plant)
    own = {id(each): _steady_gains(each) for each in plant.each}
    kp, kv = zip(*(own[id(each)] for each in plant.each), strict=True)
    return np.stack(kp), np.stack(kv)


@functools.lru_cache(maxsize=64)  # every block of a run asks
def _steady_gains(plant: Plant) -> tuple[Array, Array]:
    """Return the robot's stiffness and damping, reduced as far as a torque that is held for a time step requires.

    A position actuator's own damping is integrated implicitly, and may be arbitrarily strong; that of a controller is
    not. With inertia M, damping D and time step h the velocities of the next step are (1 - h M⁻¹ D) times the current
    ones, so h times the largest eigenvalue of M⁻¹ D is kept below ``MOST_DAMPED`` at home. Elsewhere an arm may be
    much lighter for some joints: there it is kept below ``MOST_DAMPED_ELSEWHERE``. Each joint's damping is reduced by
    its part in the fastest motion, and its stiffness by the square of that, which keeps the damping ratio.

    Returns:
        Stiffness, N·m/rad or N/m, and damping, N·m·s/rad or N·s/m, each of shape (n,).
    """
    if plant.n == 0:
        return plant.kp, plant.kv
    mobilities = _mobilities(plant) * plant.timestep
    mobilities[0] /= MOST_DAMPED
    mobilities[1:] /= MOST_DAMPED_ELSEWHERE
    shares = np.ones(plant.n)
    bounds = np.full(len(mobilities), np.inf)  # less damping makes no eigenvalue larger, so old ones are upper bounds
    for _ in range(ROUNDS):
        while True:
            worst = int(np.argmax(bounds))
            root = np.sqrt(plant.kv * shares)
            # the eigenvalues of M⁻¹ D, but symmetric
            sizes, motions = np.linalg.eigh(root[:, None] * mobilities[worst] * root)
            size, part = float(sizes[-1]), motions[:, -1]
            bounds[worst] = size
            if size >= bounds.max():
                break
        if size <= 1.0:
            break
        shares = shares * (1.0 - part * part * (1.0 - 1.0 / size))
    # the last bits of an eigenvalue are not the same on every machine
    shares = np.array([float(f"{share:.3g}") for share in shares.tolist()])
    return plant.kp * shares * shares, plant.kv * shares


def _mobilities(plant: Plant) -> Array:
    """Return the inverse of the mass matrix at home and in random configurations, shape (count, n, n)."""
    model, n = plant.model, plant.n
    data, inertia = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    lower = np.where(np.isfinite(plant.lower), plant.lower, -plant.free_half_ranges)
    upper = np.where(np.isfinite(plant.upper), plant.upper, plant.free_half_ranges)
    poses = np.random.default_rng(0).uniform(lower, upper, (POSES, n))
    if plant.loops is not None:
        reached, _ = plant.loops.follow(np.tile(plant.loops.start, (1 + POSES, 1)), np.vstack([plant.home, poses]))
        return np.array([np.linalg.inv(plant.loops.inertia(qpos)) for qpos in reached])
    found = np.empty((1 + POSES, n, n))
    for k, q in enumerate([plant.home, *poses]):
        data.qpos[plant.positions] = q
        mujoco.mj_kinematics(model, data)  # and what the mass matrix takes; contacts are of no account
        mujoco.mj_comPos(model, data)
        mujoco.mj_crb(model, data)
        mujoco.mj_fullM(model, data, inertia)
        found[k] = np.linalg.inv(inertia)[plant.velocities, plant.velocities]
    return found


class Passive:
    """No actuators: the robot moves by gravity, friction and its initial state alone."""

    actuation = ActuatorType.NONE

    def __init__(self, batch: RolloutBatch) -> None:
        """Prepare empty controls."""
        self._controls = np.zeros((len(batch.rollouts), 1, 0))

    def controls(self, first: int, count: int) -> Array:  # noqa: ARG002 - the same at every step
        """Return no controls, shape (batch, 1, 0)."""
        return self._controls


class GravityCompensation:
    """Motors balance gravity, so that the robot stays where it is put."""

    actuation = ActuatorType.MOTOR

    def __init__(self, batch: RolloutBatch, *, damping: Annotated[float, Within(at_least=0.0)] = 0.0) -> None:  # noqa: ARG002
        """Set the damping.

        Args:
            batch: The rollouts.
            damping: Torque against motion per velocity, N·m·s/rad or N·s/m.
        """
        self._damping = damping

    def control(self, observation: Observation) -> Array:
        """Return torques or forces, N·m or N, shape (batch, n)."""
        if self._damping == 0.0:
            return observation.gravity
        return observation.gravity - self._damping * observation.v


class PD:
    """Motors act as springs and dampers towards smooth random references, with gravity balanced."""

    actuation = ActuatorType.MOTOR

    def __init__(
        self,
        batch: RolloutBatch,
        *,
        kp: Annotated[float | None, Within(at_least=0.0)] = None,
        kd: Annotated[float | None, Within(at_least=0.0)] = None,
        gravity: bool = True,
        period: Period = 1.0,
        amplitude: Amplitude = 0.5,
    ) -> None:
        """Draw the references.

        Args:
            batch: The rollouts.
            kp: Stiffness of every joint, N·m/rad or N/m; None: the robot's own, reduced as the time step requires.
            kd: Damping of every joint, N·m·s/rad or N·s/m; None: likewise.
            gravity: Whether gravity is balanced.
            period: Duration of a motion between waypoints, s.
            amplitude: Share of the joints' range that the waypoints are in.
        """
        own_kp, own_kd = steady_gains(batch.plant)
        self._kp = own_kp if kp is None else np.full(batch.plant.n, kp)
        self._kd = own_kd if kd is None else np.full(batch.plant.n, kd)
        self._gravity = gravity
        self._smooth = SmoothReference(batch, period=period, amplitude=amplitude)

    def control(self, observation: Observation) -> Array:
        """Return torques or forces, N·m or N, shape (batch, n)."""
        q, v, _ = self._smooth.at(observation.step)
        torque = self._kp * (q - observation.q) + self._kd * (v - observation.v)
        return torque + observation.gravity if self._gravity else torque

    def reference(self, first: int, count: int) -> tuple[Array, Array]:
        """Return the reference's positions and velocities."""
        motion = self._smooth.motion(first, count)
        return motion.q, motion.v


class ComputedTorque:
    """Motors apply the torques that follow smooth random references according to the robot's dynamics.

    tau = M(q) (a_ref + kd (v_ref - v) + kp (q_ref - q)) + c(q, v) + g(q) - passive forces, which leaves the error
    e'' + kd e' + kp e = 0; kp = bandwidth², kd = 2 bandwidth damp it critically. Source: M. Spong, S. Hutchinson,
    M. Vidyasagar, Robot Modeling and Control (2006), section 8.3, inverse dynamics.
    """

    actuation = ActuatorType.MOTOR

    def __init__(
        self,
        batch: RolloutBatch,
        *,
        bandwidth: float = 20.0,
        period: float = 1.0,
        amplitude: float = 0.5,
        reference: SampledTrajectory | None = None,
    ) -> None:
        """Draw the references, unless one is given.

        Args:
            batch: The rollouts.
            bandwidth: How fast errors vanish, rad/s.
            period: Duration of a motion between waypoints, s.
            amplitude: Share of the joints' range that the waypoints are in.
            reference: What every rollout follows instead.
        """
        self._kp, self._kd = bandwidth * bandwidth, 2.0 * bandwidth
        self._followed: SmoothReference | SampledReference = (
            SmoothReference(batch, period=period, amplitude=amplitude)
            if reference is None
            else SampledReference(batch, reference)
        )

    @classmethod
    def prepare(
        cls,
        *,
        bandwidth: Annotated[float, Within(above=0.0, unit="rad/s")] = 20.0,
        period: Period = 1.0,
        amplitude: Amplitude = 0.5,
        reference: str | None = None,
    ) -> Prepared:
        """Read the file of the reference, if there is one.

        Args:
            bandwidth: How fast errors vanish, rad/s.
            period: Duration of a motion between random waypoints, s.
            amplitude: Share of the joints' range that the waypoints are in.
            reference: A trajectory file, .csv or .npz, that every rollout follows in place of random waypoints.

        Raises:
            ControllerError: The file cannot be used.
        """
        if reference is None:
            make = functools.partial(cls, bandwidth=bandwidth, period=period, amplitude=amplitude)
            return Prepared(make=make, actuation=cls.actuation, follows=True)
        if (period, amplitude) != (1.0, 0.5):
            raise ControllerError("options 'period' and 'amplitude' are of random references, not of a file's")
        read = read_reference(reference)
        return Prepared(
            make=functools.partial(cls, bandwidth=bandwidth, reference=read),
            actuation=cls.actuation,
            digest=read.digest,
            follows=True,
            first=dict(zip(read.joints, read.q[0].tolist(), strict=True)),
        )

    def control(self, observation: Observation) -> Array:
        """Return torques or forces, N·m or N, shape (batch, n)."""
        q, v, a = self._followed.at(observation.step)
        wanted = a + self._kd * (v - observation.v) + self._kp * (q - observation.q)
        batch, n = wanted.shape
        terms = np.empty((1 + n, n, batch))
        np.subtract(observation.bias.T, observation.passive.T, out=terms[0])
        np.multiply(observation.mass_matrix.T, wanted.T[:, None], out=terms[1:])
        # one after the other, as the last axis is the one of long loops: the same order of additions for any batch
        torque: Array = np.add.reduce(terms, axis=0).T
        return torque

    def reference(self, first: int, count: int) -> tuple[Array, Array]:
        """Return the reference's positions and velocities."""
        motion = self._followed.motion(first, count)
        return motion.q, motion.v
