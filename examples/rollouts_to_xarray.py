"""Simulate rollouts of a controlled arm, and evaluate them with xarray: in memory, or streamed to disk."""

import numpy as np

from dh2sim import Robot
from dh2sim.simulate import open_dataset

arm = Robot.load("stanford")

run = arm.rollout(16, controller="computed-torque", duration=0.5, seed=7, randomize={"mass": 0.1})
print(f"{run.sizes['rollout']} rollouts of {run.sizes['step']} states")
error = run.qpos - run.qpos_ref  # by rollout, step and joint
rms = np.sqrt((error**2).mean(["rollout", "step"]))
for joint, value in zip(run.joint.values, rms.values, strict=True):
    print(f"{joint} follows its reference to within {value:.1e} (rms)")

arm.rollout(16, controller="sine", duration=0.5, every=10, out="run.zarr", overwrite=True)
stored = open_dataset("run.zarr")
print(f"tool0 was up to {float(stored.tool_pose[..., :3].max()):.2f} m along an axis")
