"""Export a robot that comes with dh2sim, load the files in MuJoCo, and let it hold its home configuration."""

import mujoco

from dh2sim import Robot

stanford = Robot.load("stanford")
stanford.export("build")

model = mujoco.MjModel.from_xml_path("build/stanford/scene.xml")  # with floor, light and camera
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
while data.time < 1.0:
    mujoco.mj_step(model, data)

difference = data.site("tool0").xpos - stanford.fk(data.qpos)[:3, 3]
print(f"joints after {data.time:.1f} s: {data.qpos.round(3)}")
print(f"tool0 in MuJoCo and by the table: {abs(difference).max():.1e} m apart")

# without files: the robot alone, as a compiled model
print(f"{stanford.mjmodel().nbody} bodies, {stanford.mjmodel().nu} actuators")
