"""Workspaces and trajectories of odd arms and of the catalogue, against searches and differences of their own.

    python scripts/odd_arms.py                     all of them: some minutes
    python scripts/odd_arms.py gantry puma560      some

Extremes of the reach are compared with those that compass searches find from many starts on the textbook product of
the table; motions between random configurations, with every profile, with limits by finite differences of samples.
Seeds are fixed: what is found wrong is found again.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.trajectory.plan import plan_trajectory
from dh2sim.typing import Array
from dh2sim.workspace.workspace import compute_workspace

R = "type: revolute"
ODD: dict[str, tuple[str, str, list[str]]] = {
    # convention, keys of the whole, rows without braces
    "one_joint": ("standard", "", [f"{R}, a: 1"]),
    "one_slide": ("modified", "", ["type: prismatic, limits: {position: [0.1, 0.4]}"]),
    "gantry": ("standard", "", [f"type: prismatic, alpha: {a}, limits: {{position: [0, 1]}}" for a in (90, 90, 0)]),
    "slide_first": ("standard", "", ["type: prismatic, alpha: -90", f"{R}, a: 0.5", f"{R}, a: 0.3, alpha: 40"]),
    "millimetres": ("standard", "", [f"{R}, a: 0.002, alpha: 90", f"{R}, a: 0.003", f"{R}, a: 0.001"]),
    "hundred_metres": ("modified", "", [f"{R}, d: 40", f"{R}, alpha: 90, a: 1", f"{R}, a: 60"]),
    "one_sided": (
        "standard",
        "",
        [f"{R}, a: 1, limits: {{position: [10, 40]}}", f"{R}, a: 1, limits: {{position: [-90, -5]}}"],
    ),
    "continuous": (
        "standard",
        "",
        ["type: continuous, a: 1, alpha: 30", "type: continuous, a: 0.5", "type: continuous, a: 0.2"],
    ),
    "hayati": (
        "hayati",
        "",
        [f"{R}, a: 0.5, alpha: 3, beta: 2", f"{R}, a: 0.4, alpha: 80, beta: -1", f"{R}, a: 0.2"],
    ),
    "flips": (
        "standard",
        "",
        [f"{R}, a: 0.5, alpha: 20, flip: true", "type: prismatic, alpha: 50, flip: true", f"{R}, a: 0.3"],
    ),
    "nine_joints": ("standard", "", [f"{R}, a: 0.1, alpha: {17 * i % 90 - 37}, d: 0.05" for i in range(9)]),
    "coincident": ("standard", "", [R, R, f"{R}, a: 1", f"{R}, a: 0.5"]),
    "parallel": ("standard", "", [f"{R}, a: 0.3"] * 4),
    "base_and_tool": (
        "modified",
        "base: {xyz: [1, -2, 0.5], rpy: [10, 200, -70]}\ntool: {xyz: [0.3, 0, -0.1], rpy: [0, 90, 45]}\n",
        [f"{R}, d: 0.3", f"{R}, alpha: 91, a: 0.1", f"{R}, a: 0.6"],
    ),
    "sphere": ("standard", "", [f"{R}, alpha: 90", f"{R}, alpha: -90", f"{R}, a: 0, d: 0.2"]),
    "offset": (
        "standard",
        "",
        [f"{R}, a: 1, theta: 130, alpha: -60", "type: prismatic, theta: 30, d: 0.2, a: 0.1", f"{R}, a: 0.4"],
    ),
    "on_axis": ("standard", "", [f"{R}, d: 1", f"{R}, d: 0.5"]),
    "narrow": (
        "standard",
        "",
        [f"{R}, a: 1, limits: {{position: [0, 0.001]}}", f"{R}, a: 1, alpha: 90", f"{R}, a: 0.2"],
    ),
    "fixed_rows": ("standard", "", [f"{R}, a: 0.4", "type: fixed, theta: 30, a: 0.2, alpha: 45", f"{R}, a: 0.3"]),
    "rprp": (
        "modified",
        "",
        [R, "type: prismatic, alpha: 90", f"{R}, alpha: 45, a: 0.2", "type: prismatic, alpha: -60"],
    ),
}
STARTS = 12
PROFILES = ("quintic", "trapezoid", "jerk")


def odd_arm(name: str) -> RobotSpec:
    """Return an odd arm."""
    convention, more, rows = ODD[name]
    joints = "".join(f"  - {{{row}}}\n" for row in rows)
    return parse_robot(f"name: {name}\nconvention: {convention}\nunits: {{angle: deg}}\n{more}joints:\n{joints}")


def problems_of(spec: RobotSpec, starts: int = STARTS) -> Iterator[str]:
    """Yield what is wrong with a robot's workspace and trajectories."""
    model = build_model(spec)
    yield from _reach(model, starts)
    yield from _motions(model)


def _reach(model: RobotModel, starts: int) -> Iterator[str]:
    found = compute_workspace(model, samples=4000, size=0.2 * max(model.extent, 1e-3), threads=1)
    low, high = model.travel
    size = max(model.extent, 1e-9)
    measures: dict[str, tuple[float, Callable[[Array], float]]] = {
        "farthest": (1.0, lambda p: float(np.linalg.norm(p))),
        "nearest": (-1.0, lambda p: float(np.linalg.norm(p))),
        "highest": (1.0, lambda p: float(p[2])),
        "lowest": (-1.0, lambda p: float(p[2])),
    }
    draws = np.random.default_rng(0).uniform(low, high, (40 * starts, len(low)))
    for name, (sign, measure) in measures.items():
        extreme = found.extremes[name]
        attained = measure(table_tool_pose(model.spec, extreme.q[None])[0, :3, 3])
        if abs(attained - extreme.value) > 1e-9 * size:
            yield f"{name}: its configuration attains {attained}, not {extreme.value}"
        if (extreme.q < low - 1e-9).any() or (extreme.q > high + 1e-9).any():
            yield f"{name}: its configuration is outside the limits"

        def values(q: Array, sign: float = sign, measure: Callable[[Array], float] = measure) -> Array:
            places = table_tool_pose(model.spec, q)[:, :3, 3]
            return np.array([sign * measure(place) for place in places])

        best = np.argsort(-values(draws), kind="stable")[:starts]
        greatest = _searched(values, draws[best], low, high)
        if sign * extreme.value < greatest - 1e-6 * size:
            yield f"{name}: {extreme.value}, but a search finds {sign * greatest}"


def _searched(values: Callable[[Array], Array], q: Array, low: Array, high: Array) -> float:
    """Return the greatest value that a compass search finds from configurations, shape (N, n), inside limits."""
    n = q.shape[1]
    compass = np.concatenate([np.eye(n), -np.eye(n)]) * (high - low)
    here, h = values(q), np.full(len(q), 0.1)
    for _ in range(300):
        around = np.clip(q[:, None] + h[:, None, None] * compass, low, high)
        found = values(around.reshape(-1, n)).reshape(len(q), 2 * n)
        best = found.argmax(axis=1)
        rises = found.max(axis=1, initial=-np.inf) > here
        q = np.where(rises[:, None], around[np.arange(len(q)), best], q)
        here = np.where(rises, found.max(axis=1), here)
        h = np.where(rises, h, 0.5 * h)
        if h.max() < 1e-8:
            break
    return float(here.max())


def _motions(model: RobotModel) -> Iterator[str]:
    low, high = model.travel
    points = np.random.default_rng(1).uniform(low, high, (3, len(low)))
    for profile, passing in itertools.product(PROFILES, (False, True)):
        middle = {"q": points[1].tolist(), "stop": not passing}
        try:
            planned = plan_trajectory(model, [points[0], middle, points[2]], profile=profile)
        except Exception as error:
            if not passing or "leaves its limits" not in str(error):
                yield f"{profile}: {type(error).__name__}: {error}"
            continue
        t = np.linspace(0.0, planned.duration, 4001)
        q = planned.at(t)[0]
        step, limits = t[1], planned.limits
        if ((q < limits.lower - 1e-9) | (q > limits.upper + 1e-9)).any():
            yield f"{profile}: leaves the position limits"
        for order, name in enumerate(("velocity", "acceleration", "jerk")[: 2 if profile == "trapezoid" else 3], 1):
            # differences are means of the rate over the samples they span: never above its greatest value
            rate = np.abs(np.diff(q, order, axis=0)).max(axis=0) / step**order
            noise = 2.0**order * 4e-16 * np.abs(q).max() / step**order
            most = getattr(limits, name)
            if (rate > most * (1.0 + 1e-6) + noise).any():
                yield f"{profile}: {name} {rate / most} times its limit"


def main() -> int:
    """Look at all; return 1 if something is wrong."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="*", help="of the odd ones or the catalogue")
    wanted = parser.parse_args().robots or [*ODD, *builtin_robots()]
    wrong = 0
    for name in wanted:
        problems = list(problems_of(odd_arm(name) if name in ODD else load_robot(name)))
        wrong += bool(problems)
        print(f"{name}: {'; '.join(problems) or 'agrees'}", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
