"""Solve inverse kinematics with mink on the exported model.

Needs mink and a solver: pip install 'dh2sim[view]'
"""

import mink
import numpy as np

from dh2sim import Robot

puma = Robot.load("puma560")
model = puma.mjmodel()  # frames of the table are sites: dh_0 … dh_n, tool0
q_goal = puma.random_configurations(1, seed=4)[0]
T_goal = puma.fk(q_goal)

configuration = mink.Configuration(model, q=q_goal + 0.3)
task = mink.FrameTask("tool0", "site", position_cost=1.0, orientation_cost=1.0)
task.set_target(mink.SE3.from_matrix(T_goal))
limits = [mink.ConfigurationLimit(model)]
for _ in range(100):
    velocity = mink.solve_ik(configuration, [task], dt=0.1, solver="daqp", limits=limits)
    configuration.integrate_inplace(velocity, dt=0.1)

reached = puma.fk(configuration.q)  # the table's own kinematics
print(f"q = {configuration.q.round(4)}")
print(f"off the goal by {np.linalg.norm(reached[:3, 3] - T_goal[:3, 3]):.1e} m")
