"""Load an exported URDF in PyBullet, and compare its poses, torques and inertia with the table and MuJoCo.

Needs PyBullet: pip install pybullet
"""

import sys

import mujoco
import numpy as np

from dh2sim import Robot

try:
    import pybullet as bullet
except ImportError:
    sys.exit("this example needs PyBullet: pip install pybullet")

robot = Robot.load("puma560")
robot.export("build", formats=["urdf"])

bullet.connect(bullet.DIRECT)
body = bullet.loadURDF(
    f"build/{robot.name}/{robot.name}.urdf",
    useFixedBase=True,
    # or else PyBullet estimates the inertia from the collision shapes; URDF_MERGE_FIXED_LINKS would misplace masses
    flags=bullet.URDF_USE_INERTIA_FROM_FILE,
)
bullet.setGravity(*robot.spec.gravity)
joints: dict[str, int] = {}
links: dict[str, int] = {}
for index in range(bullet.getNumJoints(body)):
    info = bullet.getJointInfo(body, index)
    joints[info[1].decode()] = index
    links[info[12].decode()] = index  # PyBullet numbers a link like the joint that carries it

model = robot.mjmodel()
data = mujoco.MjData(model)
rest = [0.0] * robot.n
distance = torque_error = inertia_error = 0.0
for q in robot.random_configurations(100, seed=2):
    for row, value in zip(robot.spec.moving_rows, q, strict=True):
        bullet.resetJointState(body, joints[row.name], value)
    state = bullet.getLinkState(body, links["tool0"], computeForwardKinematics=True)
    # the centre of mass, which is tool0 itself, in double precision; state[4], the link's frame, is rounded to single
    distance = max(distance, float(np.linalg.norm(state[0] - robot.fk(q)[:3, 3])))
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    mass_matrix = np.zeros((robot.n, robot.n))
    mujoco.mj_fullM(model, data, mass_matrix)
    holding = np.asarray(bullet.calculateInverseDynamics(body, q.tolist(), rest, rest))
    torque_error = max(torque_error, float(np.abs(holding - data.qfrc_bias).max()))
    difference = np.asarray(bullet.calculateMassMatrix(body, q.tolist())) - mass_matrix
    inertia_error = max(inertia_error, float(np.abs(difference).max()))
bullet.disconnect()
print(f"tool0 in PyBullet and by the table: at most {distance:.1e} m apart")
print(f"torques that hold the arm in PyBullet and MuJoCo: at most {torque_error:.1e} N·m apart")
print(f"mass matrices of PyBullet and MuJoCo: at most {inertia_error:.1e} kg·m² apart")
