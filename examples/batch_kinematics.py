"""Compute poses and Jacobians of thousands of configurations at once, and find where the arm is nearly singular."""

import numpy as np

from dh2sim import Robot

puma = Robot.load("puma560")
q = puma.random_configurations(10_000, seed=1)  # (10000, 6), inside the limits

tool = puma.fk(q)  # (10000, 4, 4)
elbow = puma.fk(q, frame="dh_3")
jacobian = puma.jacobian(q)  # (10000, 6, 6): rows 0-2 linear, 3-5 angular

print(f"tool0 is up to {np.linalg.norm(tool[:, :3, 3], axis=1).max():.3f} m from the base")
print(f"dh_3 is up to {np.linalg.norm(elbow[:, :3, 3], axis=1).max():.3f} m from the base")

smallest = np.linalg.svd(jacobian, compute_uv=False)[:, -1]
worst = int(smallest.argmin())
print(f"nearest to singular: q = {q[worst].round(2)}, smallest singular value {smallest[worst]:.1e}")

# any batch shape: a grid over two joints
grid = np.zeros((50, 40, puma.n))
grid[..., 1] = np.linspace(-1, 1, 50)[:, None]
grid[..., 2] = np.linspace(-1, 1, 40)
print(f"poses of a grid: {puma.fk(grid).shape}")
