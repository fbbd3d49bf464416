"""Choose a robot among many: measure 60 designs of the Stanford arm, and simulate the best and the worst."""

from __future__ import annotations

import numpy as np

from dh2sim import Robot, TableBatch

arm = Robot.load("stanford")
found = arm.sweep(vary={"d1": "uniform:0.3:0.5", "d2": 0.3}, count=60, measure="reach,workspace", samples=500)
for name, spread in found.measures.items():
    print(f"{name}: {spread.least:.3f} to {spread.best.value:.3f} {spread.unit}, best design {spread.best.design}")

best = found.measures["reach"].best
worst = int(np.argmin(found.columns["reach"]))
pair = {name: found.columns[name][[best.design, worst]] for name in found.parameters}
run = arm.rollout(designs=pair, per_design=5, duration=0.2)
print(f"{run.sizes['rollout']} rollouts of designs {best.design} and {worst}")

# each rollout moves as its own table says
tables = TableBatch.from_robot(arm, {name: run[name].values for name in found.parameters})
off = np.abs(tables.fk(run.qpos.values)[..., :3, 3] - run.tool_pose.values[..., :3]).max()
print(f"tool0 is off its own table by at most {off:.1e} m")
