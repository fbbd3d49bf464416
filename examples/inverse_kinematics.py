"""All joint vectors that reach a pose, each checked against the table; then one, along a moving pose."""

import numpy as np

from dh2sim import Robot

puma = Robot.load("puma560")
T = puma.fk("home")
everywhere = puma.ik(T, limits=False)
for q, branch in zip(everywhere.q, everywhere.branch, strict=True):
    print(np.degrees(q).round(2), branch)
worst = np.abs(puma.fk(everywhere.q) - T).max()
print(f"{len(everywhere)} joint vectors, off the pose by at most {worst:.1e}")

inside = puma.ik(T, q0="home")
print(f"{len(inside)} of them inside the limits, the nearest to home first, complete: {inside.complete}")

# a line of 0.3 m, point by point from the one before
q, off = inside.best, 0.0
for _ in range(30):
    T[2, 3] -= 0.01
    q = puma.ik(T, q0=q, numeric=True).best
    off = max(off, np.abs(puma.fk(q) - T).max())
print(f"30 points of a line, off the pose by at most {off:.1e}")

T[0, 3] += 2.0
print(f"two metres farther: {puma.ik(T).reason}")
