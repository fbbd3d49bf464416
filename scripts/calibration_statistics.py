"""Whether calibrations are as good as they say: many simulated fits, each of another robot with other noise.

    python scripts/calibration_statistics.py                      all of them, 200 fits each: ten minutes
    python scripts/calibration_statistics.py stanford --fits 20

Robots are off their tables by 1 mm and 1 mrad (one sigma, every number), noise is 0.05 mm and 0.05 mrad. What is
measured is beside the last axis, as a reflector is. Of each robot and kind:

- chi² per degree of freedom: its mean, and how many standard errors that is from 1;
- held out: rms error of what is predicted at 200 configurations that no fit has seen, by the rms that
  the covariances predict;
- parameters: mean of the squared errors of the fitted parameters, whitened by their covariance, a parameter; 1 if
  they are distributed as the covariance says; and how many standard errors that is from 1.
"""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # for the simulated robots of the tests

from dh2sim.calibrate.calibration import calibrate_robot
from dh2sim.calibrate.fit import fit
from dh2sim.calibrate.observations import Observations
from dh2sim.robot.read import load_robot
from tests.calibrate.measured import SIGMA, measured, off, random_q

ROBOTS = ("puma560", "ur5e", "franka_panda", "stanford", "scara")
KINDS = ("pose", "position", "distance")
ROWS = {"pose": 40, "position": 60, "distance": 120}
UNSEEN = 200
REFLECTOR = np.array([0.03, 0.02, 0.1])
"""Of tool0, from where the robot file has it, m."""
_NO_NOISE = 1e-13


@dataclass(frozen=True, slots=True, kw_only=True)
class Statistics:
    """What many fits of one kind show."""

    fits: int
    chi2: float
    """Mean of chi² per degree of freedom."""
    chi2_off: float
    """Standard errors from 1."""
    held_out: float
    """rms error, m; of poses that of the positions."""
    predicted: float
    """rms error by the covariances, m."""
    parameters: float
    """Mean squared whitened error, a parameter."""
    parameters_off: float
    """Standard errors from 1."""


def simulate(name: str, kind: str, *, fits: int, seed: int = 0) -> Statistics:
    """Calibrate many robots that are off one table."""
    nominal = load_robot(name)
    nominal = replace(nominal, tool=replace(nominal.tool, xyz=nominal.tool.xyz + REFLECTOR), source_file=None)
    chi2, dof, held, predicted, whitened, fitted = [], 0, [], [], [], 0
    for k in range(fits):
        true = off(nominal, 1e-3, 1000 * seed + k)
        q, unseen = random_q(nominal, ROWS[kind], 2000 * seed + k), random_q(nominal, UNSEEN, 3000 * seed + k)
        found = calibrate_robot(nominal, measured(nominal, true, kind, q, seed=k), noise=SIGMA, held_out=False)
        best = found.fit
        chi2.append(best.chi2)
        dof = best.dof
        kept = list(best.basis.kept)
        robot = best.observations.robot
        after = Observations(robot, measured(nominal, true, kind, unseen, seed=k, sigma=_NO_NOISE))
        equations = after.equations(best.state)
        lengths = equations.scale == 0
        J = equations.J[np.ix_(lengths, kept)]
        held.append(float((equations.e[lengths] ** 2).mean()))
        predicted.append(float(np.einsum("ei,ij,ej->e", J, best.covariance, J).mean()))
        exact = Observations(robot, measured(nominal, true, kind, q, seed=k, sigma=_NO_NOISE))
        truth = fit(exact, best.state, kept, best.sigma).state
        change = robot.change(best.state.values, truth.values)
        error = np.concatenate([change, (best.state.points - truth.points).ravel()])[kept]
        fitted = len(kept)
        whitened.append(float(error @ np.linalg.solve(best.covariance, error)))
    per_dof, per_parameter = np.array(chi2) / dof, np.array(whitened) / fitted
    return Statistics(
        fits=fits,
        chi2=float(per_dof.mean()),
        chi2_off=float((per_dof.mean() - 1.0) / math.sqrt(2.0 / dof / fits)),
        held_out=math.sqrt(float(np.mean(held))),
        predicted=math.sqrt(float(np.mean(predicted))),
        parameters=float(per_parameter.mean()),
        parameters_off=float((per_parameter.mean() - 1.0) / math.sqrt(2.0 / fitted / fits)),
    )


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="*", default=list(ROBOTS))
    parser.add_argument("--kinds", nargs="+", default=list(KINDS))
    parser.add_argument("--fits", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    print("| robot | measured | chi² per dof | held out, predicted (µm) | ratio | parameters |")
    print("|---|---|---|---|---|---|")
    for name in options.robots:
        for kind in options.kinds:
            found = simulate(name, kind, fits=options.fits, seed=options.seed)
            print(
                f"| {name} | {ROWS[kind]} {kind}s | {found.chi2:.4f} ({found.chi2_off:+.1f} σ) | "
                f"{1e6 * found.held_out:.1f}, {1e6 * found.predicted:.1f} | {found.held_out / found.predicted:.3f} | "
                f"{found.parameters:.3f} ({found.parameters_off:+.1f} σ) |",
                flush=True,
            )


if __name__ == "__main__":
    main()
