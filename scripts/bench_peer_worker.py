"""Solves inverse kinematics with one other library, in that library's own environment; no dh2sim is there.

    python bench_peer_worker.py eaik|ssik|roboticstoolbox < arm.json > answers.json

The arm is a standard table with all theta at zero: lists alpha, a, d and prismatic, and poses of the last frame. The
answers are lists of joint vectors, one a pose, with the processor time, s, of building and of solving; or an error.
"""

from __future__ import annotations

import json
import os
import sys
import time
import traceback
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np

Solve = Callable[[Any], Any]


def eaik(arm: dict[str, Any]) -> Solve:
    """Decompose by EAIK, which takes revolute joints alone."""
    from eaik.IK_DH import DhRobot  # type: ignore[import-not-found]

    if any(arm["prismatic"]):
        raise NotImplementedError("takes no prismatic joint")
    robot = DhRobot(*(np.array(arm[key]) for key in ("alpha", "a", "d")))
    if not robot.hasKnownDecomposition():
        raise NotImplementedError("no known decomposition")
    return lambda T: robot.IK(T).Q


def ssik(arm: dict[str, Any]) -> Solve:
    """Choose a solver by ssik, which takes revolute joints alone."""
    from ssik import Manipulator  # type: ignore[import-not-found]

    if any(arm["prismatic"]):
        raise NotImplementedError("takes no prismatic joint")
    robot = Manipulator.from_dh(arm["alpha"], arm["a"], arm["d"])
    robot.prepare()
    return lambda T: [solution.q for solution in robot.solve(T, enumerate_windings=False)]


def roboticstoolbox(arm: dict[str, Any]) -> Solve:
    """Derive symbolically by analytic_ik of the toolbox."""
    from roboticstoolbox import DHRobot, PrismaticDH, RevoluteDH

    rows = zip(*(arm[key] for key in ("alpha", "a", "d", "prismatic")), strict=True)
    links = [
        PrismaticDH(alpha=alpha, a=a, offset=d, theta=0.0, qlim=[-1e3, 1e3])
        if slides
        else RevoluteDH(alpha=alpha, a=a, d=d)
        for alpha, a, d, slides in rows
    ]
    robot = DHRobot(links).analytic_ik()
    return lambda T: robot.solve(T, joint_limits=False).q


PEERS: dict[str, tuple[str, Callable[[dict[str, Any]], Solve]]] = {
    "eaik": ("EAIK", eaik),
    "ssik": ("ssik", ssik),
    "roboticstoolbox": ("roboticstoolbox-python", roboticstoolbox),
}
"""The distribution of each peer, and what builds its solver."""


def main() -> None:
    """Read the arm, solve, print the answers."""
    out = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what a library prints is not an answer
    peer, build = PEERS[sys.argv[1]]
    arm = json.load(sys.stdin)
    poses = [np.array(pose) for pose in arm["poses"]]
    answers: dict[str, Any] = {"version": version(peer)}
    try:
        started = time.process_time()
        solve = build(arm)
        solve(poses[0])
        answers["built"] = time.process_time() - started
        found, cpu = [], 0.0
        for pose in poses:
            started = time.process_time()
            q = solve(pose)
            cpu += time.process_time() - started
            found.append(np.asarray(q, dtype=float).reshape(-1, len(arm["a"])).tolist())
        answers |= {"found": found, "cpu": cpu}
    except Exception as error:
        traceback.print_exc()
        answers["error"] = f"{type(error).__name__}: {' '.join(str(error).split())}"[:120]
    json.dump(answers, out)


if __name__ == "__main__":
    main()
