"""How much twelve planned configurations tell, as compared to random ones and to the best that any could.

    python scripts/calibration_plans.py [--robots NAMES] [--kinds KINDS] [--count N]

Prints the table of docs/calibration.md. The bound holds for any N configurations inside the limits: the predicted
variance of the tool is convex in the information, so that at a design with weights w of information M, variance
v = tr(M⁻¹ T) and sensitivity d(q) = tr(J(q) M⁻¹ T M⁻¹ J(q)ᵀ), none has less than v² / max d(q) (J. Kiefer, General
equivalence theory for optimum designs, Annals of Statistics 2(5), 1974). Where max d is found by searching, the bound
is as good as that search.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from dh2sim import Robot
from dh2sim.calibrate import plan
from dh2sim.calibrate.measurements import Kind
from dh2sim.kinematics.chain import serial_spec_of
from dh2sim.model.build import build_model
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array

ROBOTS = "puma560,ur5e,franka_panda,stanford,scara"
KINDS = "position,pose,distance"


def main() -> int:
    """Print a line for each kind and robot."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", default=ROBOTS)
    parser.add_argument("--kinds", default=KINDS)
    parser.add_argument("--count", type=int, default=12)
    options = parser.parse_args()
    print(f"{'':24}{'planned/random':>16}{'bound/random':>14}")
    for kind in options.kinds.split(","):
        for name in options.robots.split(","):
            spec = serial_spec_of(Robot.load(name))
            found = plan.plan_measurements(spec, options.count, kind=kind, noise=1.0)
            bound = least_error(spec, Kind(kind), options.count) / found.random_error
            print(f"{kind:10}{name:14}{found.error / found.random_error:16.3f}{bound:14.3f}", flush=True)
    return 0


def least_error(spec: RobotSpec, kind: Kind, count: int) -> float:
    """Return a lower bound of the predicted error of the tool, in sigmas, of any configurations inside the limits."""
    contact = plan._SelfContact(build_model(spec))
    q, _ = contact.free(plan.CANDIDATES, np.random.default_rng(0))
    design, _ = plan._design(spec, q, kind, (1.0, 1.0), 0)
    rng = np.random.default_rng(0)
    bound = 0.0
    for _ in range(4):
        rows = design.rows(q)
        weight = np.full(len(q), 1.0 / len(q))
        for _ in range(150):  # multiplicative: S. D. Silvey, D. M. Titterington, B. Torsney, 1978
            sensitivity, variance = _sensitivity(rows, weight, rows, design.target)
            weight *= np.sqrt(sensitivity / variance)
            weight /= weight.sum()
        best = q[np.argsort(-sensitivity)[:40]]
        for step in plan._STEPS:
            near = best[:, None] + step * rng.normal(size=(len(best), 64, q.shape[1])) * (
                contact.upper - contact.lower
            )
            near = np.clip(np.concatenate([best[:, None], near], axis=1), contact.lower, contact.upper)
            value, _ = _sensitivity(rows, weight, design.rows(near.reshape(-1, q.shape[1])), design.target)
            best = near[np.arange(len(best)), value.reshape(len(best), -1).argmax(axis=1)]
        value, variance = _sensitivity(rows, weight, design.rows(best), design.target)
        bound = max(bound, math.sqrt(variance**2 / max(value.max(), sensitivity.max()) / count))
        q = np.concatenate([q, best])
    return bound


def _sensitivity(rows: Array, weight: Array, at: Array, target: Array) -> tuple[Array, float]:
    """Return how much weight at configurations would take off the variance, and the variance."""
    C = np.linalg.inv(np.einsum("n,nki,nkj->ij", weight, rows, rows))
    return np.asarray(((at @ (C @ target @ C)) * at).sum(axis=(1, 2))), float(np.trace(C @ target))


if __name__ == "__main__":
    sys.exit(main())
