"""A calibration without a lab: an arm that is off its table, a tracker with noise, and a better table."""

from dataclasses import replace

import numpy as np

from dh2sim import Robot
from dh2sim.simulate.run_measurements import run_measurements

nominal = Robot.load("stanford")

# the arm that was built: each number of its table is off by about 1 mm and 1 mrad
rng = np.random.default_rng(7)
rows = [
    replace(
        row,
        a=row.a + 1e-3 * rng.normal(),
        alpha=row.alpha + 1e-3 * rng.normal(),
        theta=row.theta + 1e-3 * rng.normal(),
        d=row.d + 1e-3 * rng.normal(),
    )
    for row in nominal.spec.rows
]
built = Robot.from_spec(replace(nominal.spec, rows=tuple(rows), source_file=None))

# it moves, and a tracker with 0.05 mm and 0.05 mrad of noise records where its tool is
run = built.rollout(24, duration=1.0, every=100)
measured = run_measurements(nominal, run, noise=5e-5, count=120)
found = nominal.calibrate(measured, noise=5e-5)
calibrated = Robot.from_spec(found.robot)

q = nominal.random_configurations(1000, seed=1)
p = built.fk(q)[:, :3, 3]
for name, robot in (("nominal", nominal), ("calibrated", calibrated)):
    error = np.linalg.norm(robot.fk(q)[:, :3, 3] - p, axis=1)
    print(f"{name}: off by {1e3 * np.sqrt((error**2).mean()):.3f} mm, at most {1e3 * error.max():.3f} mm")
print(f"predicted: {1e3 * found.predicted.length:.3f} mm; {found.identifiable} parameters identifiable")
print(f"chi² per degree of freedom: {found.fit.chi2_per_dof:.3f}, expected 1 ± {found.chi2_spread:.3f}")

# a robot like any other
calibrated.save("stanford_calibrated.yaml", overwrite=True)
exported = calibrated.export("build")
off = max(each.position_error for each in exported.verified)
print(f"exported, off the calibrated table by at most {off:.1e} m")
print(f"reaches its home by {len(calibrated.ik(calibrated.fk('home'), q0='home'))} joint vectors inside the limits")

plan = nominal.plan_measurements(12)
print(
    f"next time: 12 points of a plan tell the tool {plan.random_error / plan.error:.1f} times as well as random ones"
)
