"""Make the DH table of a URDF, and compare its poses with those that MuJoCo computes from the URDF itself.

python import_urdf.py [FILE.urdf]
"""

import sys

import mujoco
import numpy as np

from dh2sim import Robot

if len(sys.argv) > 1:
    path = sys.argv[1]
else:  # something to import
    Robot.load("scara").export("build")
    path = "build/scara/scara.urdf"

robot = Robot.from_urdf(path)  # base= and tip= choose the arm in a larger tree
print(robot)
for note in robot.notes:
    print(f"note: {note}")

model = mujoco.MjModel.from_xml_path(path)
data = mujoco.MjData(model)
q = robot.random_configurations(100)
last = robot.spec.rows[-1].name  # the body that the last joint moves
distances = []
for configuration, T in zip(q, robot.fk(q, frame=f"link_{len(robot.spec.rows)}"), strict=True):
    for row, value in zip(robot.spec.moving_rows, configuration, strict=True):
        data.joint(row.name).qpos = value
    mujoco.mj_kinematics(model, data)
    axis = data.joint(last).xaxis
    distances.append(np.linalg.norm(np.cross(axis, T[:3, 3] - data.joint(last).xanchor)))
print(f"the last joint's axis: at most {max(distances):.1e} m apart at {len(q)} configurations")
