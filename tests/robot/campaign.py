"""Random robot files, many of them: read and modelled without a traceback, exported, validated and imported back.

    python -m tests.robot.campaign read 100000 [SEED]
    python -m tests.robot.campaign whole 1000 [SEED]

Prints a line of JSON, how often what was found, and the files that fell short to standard error.
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

from dh2sim.errors import Dh2simError, ModelError, RobotFileError
from dh2sim.export import export_robot
from dh2sim.importing.sources import ImportOptions, import_robot
from dh2sim.kinematics.sampling import random_configurations
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import pose_errors
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.validate.run import validate_robot
from tests.robot.random_files import RandomFiles

IMPORTED = 1e-9
"""rad, and of the extent or 1 m: how far an export that is imported again may be from the robot."""


def read(count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Read random files and make models of those that are robots; return what was found, and failures."""
    files, found, failures = RandomFiles(seed), Counter[str](), list[str]()
    for _ in range(count):
        text = files.any()
        try:
            found["refused" if _model(text) is None else "accepted"] += 1
        except Exception as error:
            found[f"failed: {_kind(error)}"] += 1
            failures.append(f"{error!r}\n{text}")
    return found, failures


def whole(count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Export, validate and import random robots; return what was found, and failures.

    Args:
        count: Number of robots that are accepted.
        seed: Of the files.
    """
    files, found, failures = RandomFiles(seed), Counter[str](), list[str]()
    while found["accepted"] < count:
        text = files.whole()
        try:
            model = _model(text)
            if model is None:
                found["refused"] += 1
                continue
            found["accepted"] += 1
            with tempfile.TemporaryDirectory() as folder:
                for problem in shortcomings(model, Path(folder)):
                    found[f"fell short: {problem.partition(':')[0]}"] += 1
                    failures.append(f"{problem}\n{text}")
        except Exception as error:
            found[f"failed: {_kind(error)}"] += 1
            failures.append(f"{error!r}\n{text}")
    return found, failures


def _model(text: str) -> RobotModel | None:
    """Return the robot of a file; None for one that is refused, at proper places."""
    try:
        return build_model(parse_robot(text, mesh_files=False))
    except ModelError as error:
        place = r"<string>:\d+:\d+: joints\[\d+\]\.link\.mass"
        if re.match(rf"{place}: \S+ moves nothing that has mass; ", str(error)) is None:
            raise
        return None
    except RobotFileError as error:
        lines = text.replace("\r\n", "\n").replace("\r", "\n").count("\n") + 1
        for problem in error.problems:
            assert 1 <= problem.line <= lines, problem
            assert problem.column >= 1, problem
        return None


def shortcomings(model: RobotModel, folder: Path) -> list[str]:
    """Export a robot, validate the files and import them again; return what fell short."""
    export_robot(model, folder)
    found = []
    report = validate_robot(model, samples=50, folder=folder / model.name)
    for check in report.checks:
        if check.ok is False:
            error = check.reason or check.max_error or (check.max_position_error, check.max_rotation_error)
            found.append(f"{check.engine} {check.quantity}: {error} {check.tolerance}")
    if model.chain.n == 0:
        return found
    for suffix in ("urdf", "xml"):
        path = folder / model.name / f"{model.name}.{suffix}"
        try:
            imported = import_robot(path, ImportOptions(tip="tool0")).spec
        except Dh2simError as error:
            # lengths near the bound may add up to more in the frames that are found, which is said of the file
            said = (
                rf"^{re.escape(str(path))}:.*: (must be from -1e6 to 1e6 m, found|the lengths up to here add up to)"
            )
            if re.search(said, str(error)) is None:
                found.append(f"import of {suffix}: {error}")
            continue
        position, rotation = _difference(model, imported)
        if not (position <= IMPORTED * max(1.0, model.extent) and rotation <= IMPORTED):
            found.append(f"imported {suffix}: {position} m of {model.extent} m, {rotation} rad")
    return found


def _difference(model: RobotModel, imported: RobotSpec) -> tuple[float, float]:
    """Return how far tool0 of the imported robot is from where it was."""
    lower, upper = model.travel
    q = random_configurations(lower, upper, 20, 0)
    position, rotation = pose_errors(table_tool_pose(imported, q), table_tool_pose(model.spec, q))
    return float(np.max(position)), float(np.max(rotation))


def _kind(error: Exception) -> str:
    return f"{type(error).__name__}: {re.sub(r'[0-9].*', '…', str(error))[:60]}"


if __name__ == "__main__":
    made, failed = {"read": read, "whole": whole}[sys.argv[1]](
        int(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 0
    )
    print("\n\n".join(failed), file=sys.stderr)
    print(json.dumps(made))
