"""Random robot files, many of them: read and modelled without a traceback, exported, validated and imported back.

    python -m tests.robot.campaign read 1000000 [SEED] [LOG]
    python -m tests.robot.campaign whole 20000 [SEED] [LOG]

Files are made in chunks, of SEED and the seeds after it. Prints a line of JSON for each chunk, how often what was
found, and the files that fell short to standard error. With LOG, a file, all that is kept there, and a chunk that it
has is not made again.
"""

from __future__ import annotations

import gc
import json
import re
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

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


CAMPAIGNS: Final = {"read": (read, 10_000), "whole": (whole, 100)}
"""What is tried, and of how many files a chunk is made."""


def chunks(name: str, count: int, seed: int, log: Path | None) -> Iterator[dict[str, Any]]:
    """Run a campaign in chunks and yield what each found; those that the log has are not run again."""
    campaign, size = CAMPAIGNS[name]
    lines = log.read_text().splitlines() if log and log.exists() else []
    kept = {(line["campaign"], line["seed"], line["count"]): line for line in map(json.loads, lines)}
    for start in range(0, count, size):
        key = (name, seed + start // size, min(size, count - start))
        if key in kept:
            yield kept[key]
            continue
        begin = time.perf_counter()
        found, failures = campaign(key[2], key[1])
        line = {"campaign": name, "seed": key[1], "count": key[2], "found": found, "failures": failures}
        line["seconds"] = round(time.perf_counter() - begin, 1)
        if log:
            with log.open("a") as file:
                print(json.dumps(line), file=file)
        yield line


def main(name: str, count: str, seed: str = "0", log: str | None = None) -> None:
    """Run a campaign and print what it finds."""
    gc.freeze()
    gc.set_threshold(100_000)  # as in the command line
    total = Counter[str]()
    for line in chunks(name, int(count), int(seed), Path(log) if log else None):
        for failure in line.pop("failures"):
            print(failure, end="\n\n", file=sys.stderr, flush=True)
        print(json.dumps(line), flush=True)
        total.update(line["found"])
    print(json.dumps({"campaign": name, "found": total}))


if __name__ == "__main__":
    main(*sys.argv[1:])
