"""The part of ``scripts/bench`` that compares inverse kinematics with other libraries, each in its own environment.

The environments are folders ``eaik``, ``ssik`` and ``roboticstoolbox`` below the folder of ``--peers``; what is
missing is made there with pip. A peer that refuses an arm, or fails, stands in the table as that.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
import venv
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from dh2sim.inverse.solver import InverseSolver
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.frame_assignment.recover import recover_table
from dh2sim.kinematics.serial_chain import SerialChain, SerialJoint
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.robot.read import load_robot
from dh2sim.robot.row import Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from scripts.bench_timing import Row as TableRow
from scripts.bench_timing import measure

REQUIREMENTS: Final = {
    "eaik": ["EAIK==1.2.2"],
    "ssik": ["ssik==8.2.0"],
    "roboticstoolbox": ["roboticstoolbox-python[ik]==1.5.0"],
}
POSES: Final = 200
PATIENCE: Final = 560
"""Wall time, s, after which a peer is stopped."""
SAME: Final = 1e-4
"""Difference of coordinates, rad or m, below which two answers are one."""
WRONG: Final = 1e-6
"""Difference of a pose's entries, m and without unit, above which an answer is wrong."""

folder: Path | None = None
"""Of the environments; set by the option ``--peers``."""


def arms() -> dict[str, RobotSpec]:
    """Return the arms, each as a standard table of six joints with all theta at zero."""
    jaco = [(90, 0, 0.2755), (180, 0.41, 0), (90, 0, -0.0098), (55, 0, -0.2502), (55, 0, -0.0856), (180, 0, -0.2228)]
    ur5 = [(90, 0, 0.089159), (0, -0.425, 0), (0, -0.39225, 0), (90, 0, 0.10915), (-90, 0, 0.09465), (0, 0, 0.0823)]
    return {
        "puma560": _bare(load_robot("puma560_standard").rows),
        "ur5": _revolute(ur5),
        "jaco-like": _revolute(jaco),
        "panda, joint 7 locked": _locked(load_robot("franka_panda"), "joint_7", 0.4),
        "panda, joint 4 locked": _locked(load_robot("franka_panda"), "joint_4", -1.3),
        "stanford": _bare(load_robot("stanford").rows),
    }


def _revolute(rows: Sequence[tuple[float, float, float]]) -> RobotSpec:
    return _bare([Row(type="revolute", alpha=math.radians(alpha), a=a, d=d) for alpha, a, d in rows])  # type: ignore[arg-type]


def _bare(rows: Sequence[Row]) -> RobotSpec:
    plain = tuple(
        Row(name=f"q{i}", type=row.type, alpha=row.alpha, a=row.a, d=row.d) for i, row in enumerate(rows, 1)
    )
    return RobotSpec(name="arm", rows=plain)


def _locked(spec: RobotSpec, name: str, angle: float) -> RobotSpec:
    """Return the standard table of an arm, one of whose joints stands still."""
    T, joints = np.eye(4), []
    for joint in build_chain(spec).joints:
        T = T @ joint.T_parent_joint
        if joint.name == name or not joint.type.moves:
            c, s = (math.cos(angle), math.sin(angle)) if joint.type.moves else (1.0, 0.0)
            T = T @ np.array([[c, -s, 0.0, 0.0], [s, c, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
            continue
        joints.append(
            SerialJoint(
                name=joint.name,
                type=joint.type,
                T_parent_link=read_only(T),
                axis=read_only([0.0, 0.0, joint.sign]),
                point=read_only([0.0, 0.0, 0.0]),
            )
        )
        T = np.eye(4)
    return _bare(recover_table(SerialChain(joints=tuple(joints), T_link_tip=read_only(T))).spec.rows)


def peers() -> Iterator[TableRow]:
    """Branches found, missed and wrong of each library on each arm, and processor time."""
    if folder is None:
        yield "inverse kinematics of peers", "not measured: give --peers FOLDER", "", None
        return
    for peer, wanted in REQUIREMENTS.items():
        if not _python(peer).exists():
            venv.create(folder / peer, with_pip=True)
            subprocess.run([_python(peer), "-m", "pip", "install", "--quiet", *wanted], check=True)
    for name, spec in arms().items():
        yield from _compared(name, spec)


def _compared(name: str, spec: RobotSpec) -> Iterator[TableRow]:
    rng = np.random.default_rng(1)
    slides = np.array([not row.type.turns for row in spec.rows])
    drawn = np.where(slides, rng.uniform(0.1, 0.8, (POSES, 6)), rng.uniform(-math.pi, math.pi, (POSES, 6)))
    T = table_tool_pose(spec, drawn)
    answers: dict[str, dict[str, Any]] = {"dh2sim": _own(spec, T)}
    problem = {
        "alpha": [row.alpha for row in spec.rows],
        "a": [row.a for row in spec.rows],
        "d": [row.d for row in spec.rows],
        "prismatic": slides.tolist(),
        "poses": T.tolist(),
    }
    for peer in REQUIREMENTS:
        answers[peer] = _answers(peer, json.dumps(problem))
    right = {peer: _right(spec, T, given, slides) for peer, given in answers.items()}
    for peer, given in answers.items():
        label = f"{name}: {peer} {given.get('version', '')}".rstrip()
        if "error" in given:
            yield label, given["error"], "", None
            continue
        wrong, found, missed, own = 0, 0, 0, 0
        for i in range(POSES):
            good, bad = right[peer][i]
            known = _distinct([q for others in right.values() for q in others[i][0]], slides)
            wrong, found, missed = wrong + bad, found + len(good), missed + len(known) - len(good)
            own += any(_same(q, drawn[i], slides) for q in good)
        figure = (
            f"drawn {own}/{POSES}, branches {found}, missed {missed}, wrong {wrong}, "
            f"{given['cpu'] / POSES * 1e6:.0f} us a pose, built in {given['built']:.2f} s"
        )
        target, met = ("none missed, none wrong", missed + wrong == 0) if peer == "dh2sim" else ("", None)
        yield label, figure, target, met


def _own(spec: RobotSpec, T: Array) -> dict[str, Any]:
    solver = InverseSolver(spec)
    built = measure(lambda: solver.solve(T[0], limits=False))
    found: list[Any] = []
    taken = measure(lambda: found.extend(solver.solve(T, limits=False)))
    return {"built": built.cpu, "cpu": taken.cpu, "found": [solutions.q.tolist() for solutions in found]}


def _answers(peer: str, problem: str) -> dict[str, Any]:
    worker = Path(__file__).with_name("bench_peer_worker.py")
    environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "VIRTUAL_ENV")}
    started = time.perf_counter()
    with TemporaryDirectory() as cache:  # what was derived in another run is derived again
        try:
            process = subprocess.run(
                [_python(peer), str(worker), peer],
                input=problem,
                capture_output=True,
                text=True,
                timeout=PATIENCE,
                check=False,
                env=environment | {"XDG_CACHE_HOME": cache},
            )
        except subprocess.TimeoutExpired:
            return {"error": f"no answer in {PATIENCE} s"}
    if process.returncode or not process.stdout:
        print(process.stderr[-2000:], file=sys.stderr)
        return {"error": f"ended with exit status {process.returncode} after {time.perf_counter() - started:.0f} s"}
    answers: dict[str, Any] = json.loads(process.stdout)
    return answers


def _right(spec: RobotSpec, T: Array, given: dict[str, Any], slides: Array) -> list[tuple[list[Array], int]]:
    """Return, for each pose, the distinct answers that reach it by the table, and how many do not."""
    checked = []
    for pose, found in zip(T, given.get("found", [[]] * len(T)), strict=True):
        q = np.array(found, dtype=float).reshape(-1, 6)
        errors = np.abs(table_tool_pose(spec, q) - pose).max(axis=(1, 2)) if len(q) else np.zeros(0)
        good = errors <= WRONG  # a NaN is wrong
        checked.append((_distinct(list(q[good]), slides), int((~good).sum())))
    return checked


def _distinct(vectors: Sequence[Array], slides: Array) -> list[Array]:
    kept: list[Array] = []
    for q in vectors:
        if not any(_same(q, other, slides) for other in kept):
            kept.append(q)
    return kept


def _same(q: Array, other: Array, slides: Array) -> bool:
    gap = q - other
    gap = np.where(slides, gap, gap - 2.0 * math.pi * np.round(gap / (2.0 * math.pi)))
    return bool(np.abs(gap).max() < SAME)


def _python(peer: str) -> Path:
    assert folder is not None
    return folder / peer / ("Scripts" if os.name == "nt" else "bin") / "python"
