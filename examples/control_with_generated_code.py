"""Let an arm follow a path in MuJoCo by its own inverse dynamics, generated as C and called with ctypes."""

import ctypes
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import mujoco
import numpy as np

from dh2sim import Robot

compiler = shutil.which("cc") or shutil.which("gcc")
if compiler is None:
    sys.exit("this example needs a C compiler")

arm = Robot.load("ur5e")
with tempfile.TemporaryDirectory() as folder:
    source, library = Path(folder, "ur5e.c"), Path(folder, "ur5e.so")
    source.write_text(arm.code("c", "inverse-dynamics"))
    subprocess.run([compiler, "-O2", "-shared", "-fPIC", source, "-o", library, "-lm"], check=True)
    inverse_dynamics = ctypes.CDLL(str(library)).ur5e_inverse_dynamics
inverse_dynamics.argtypes = [np.ctypeslib.ndpointer(np.float64, shape=(arm.n,), flags="C")] * 4

model = arm.mjmodel()
model.opt.timestep = 0.001
model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)  # torques instead of the position actuators
data = mujoco.MjData(model)
home, swing, rate = arm.configurations["home"], np.array([0.5, 0.3, 0.4, 0.6, 0.5, 0.8]), 2.0
data.qpos[:], data.qvel[:] = home, swing * rate

torque, worst, seconds = np.zeros(arm.n), 0.0, 2.0
while data.time < seconds:
    phase = rate * data.time
    q, qd, qdd = home + swing * np.sin(phase), swing * rate * np.cos(phase), -swing * rate**2 * np.sin(phase)
    # computed torque: the errors vanish like those of a critically damped oscillator of 20 rad/s
    wanted = qdd + 400.0 * (q - data.qpos) + 40.0 * (qd - data.qvel)
    inverse_dynamics(data.qpos.copy(), data.qvel.copy(), wanted, torque)
    data.qfrc_applied[:] = torque
    worst = max(worst, float(np.abs(q - data.qpos).max()))
    mujoco.mj_step(model, data)
print(f"{arm.name} follows its path to within {worst:.1e} rad")
