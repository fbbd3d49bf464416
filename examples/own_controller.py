"""Drive rollouts with a controller of one's own: a class with a method ``control``, for many rollouts at once."""

from pathlib import Path

from dh2sim import Robot
from dh2sim.simulate import Observation, RolloutBatch
from dh2sim.typing import Array


class Spring:
    """Balances gravity, and pulls every joint towards its home position: a compliant arm."""

    actuation = "motor"

    def __init__(self, batch: RolloutBatch, *, stiffness: float = 20.0, damping: float = 4.0) -> None:
        self.home = batch.plant.home  # (n,)
        self.stiffness = stiffness
        self.damping = damping

    def control(self, observation: Observation) -> Array:
        """Return torques, shape (batch, n)."""
        spring = self.stiffness * (self.home - observation.q)
        return observation.gravity + spring - self.damping * observation.v


if __name__ == "__main__":
    arm = Robot.load("stanford")
    for stiffness in (5.0, 50.0):
        controller = f"{Path(__file__).stem}:Spring:stiffness={stiffness}"  # MODULE:CLASS:options
        run = arm.rollout(8, controller=controller, duration=1.0, start="random", seed=1)
        distance = abs(run.qpos - arm.configurations["home"]).mean(["rollout", "joint"])
        first, last = float(distance[0]), float(distance[-1])
        print(f"stiffness {stiffness:4.1f}: from home by {first:.2f} at first, {last:.2f} in the end")
