"""What fixes a run: everything, beside the model's text, on which the bits of a rollout depend."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from dh2sim.simulate.controllers.options import ControllerChoice
from dh2sim.typing import Array

RECORDABLE = ("qpos", "qvel", "ctrl", "tool_pose", "reference", "qacc", "torque", "energy", "contacts")
"""What ``record`` may name."""
DEFAULT_RECORD = ("qpos", "qvel", "ctrl", "tool_pose", "reference")
"""'reference' is recorded of controllers that follow one."""
RANDOMIZABLE = ("mass", "friction", "damping", "armature", "gain")
"""What ``randomize`` may name: of links mass and inertia together, of joints dry friction, viscous damping and rotor
inertia, of position and velocity actuators the gains."""
STARTS = ("home", "zero", "random")


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Settings of a run. A block of rollouts is a pure function of (model text, settings, range of rollouts)."""

    rollouts: int
    """At least 1."""
    steps: int
    """Time steps of each rollout, at least 1."""
    every: int = 1
    """A state in so many is recorded; divides ``steps``."""
    seed: int = 0
    controller: ControllerChoice
    start: str = "home"
    """'home', 'zero', 'random', or the name of the file that ``start_states`` came from."""
    start_states: Array | None = field(default=None, compare=False, repr=False)
    """Joint positions and velocities at the start, rad, m and their rates, shape (1 or rollouts, 2, n)."""
    start_digest: str = ""
    """SHA-256 of ``start_states``; part of what is compared."""
    home: tuple[float, ...] = ()
    """The robot's home configuration, rad or m."""
    record: tuple[str, ...] = DEFAULT_RECORD
    """Of ``RECORDABLE``."""
    randomize: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    """Greatest relative change of ``RANDOMIZABLE`` quantities, each at least 0 and below 1."""
    velocity: tuple[float, ...] = ()
    """Velocity limit of each moving joint, rad/s or m/s; references stay below it. An MJCF cannot hold it."""
    kp: tuple[float, ...] = ()
    """Stiffness, N·m/rad or N/m, that controllers with motors use for each moving joint unless told otherwise."""
    kv: tuple[float, ...] = ()
    """Damping, N·m·s/rad or N·s/m, likewise."""

    @property
    def records(self) -> int:
        """Number of recorded intervals, K; states are recorded at K + 1 instants."""
        return self.steps // self.every

    def to_json(self) -> dict[str, Any]:
        """Return what the run's attributes hold, and what a resumed run is compared with."""
        return {
            "rollouts": self.rollouts,
            "steps": self.steps,
            "every": self.every,
            "seed": self.seed,
            "controller": self.controller.text,
            "controller_digest": self.controller.digest,
            "start": self.start,
            "start_digest": self.start_digest,
            "home": list(self.home),
            "record": list(self.record),
            "randomize": dict(self.randomize),
            "velocity_limits": list(self.velocity),
            "kp": list(self.kp),
            "kv": list(self.kv),
        }
