"""Exports that are killed, and exports of two processes into one folder, many times over.

    python -m tests.export.campaigns kills 2000
    python -m tests.export.campaigns pairs 1000

Prints a line of JSON: how often what was found.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import NoReturn

from dh2sim import build_model, parse_robot
from dh2sim.export import drift, export_robot
from dh2sim.model.robot_model import RobotModel
from tests.program import contents
from tests.robot_files import small

MODELS = [build_model(parse_robot(small(length=length))) for length in (0.4, 0.5, 0.6)]
"""Versions of one robot."""


def kills(count: int, out: Path) -> Counter[str]:
    """Kill exports at random moments; whatever is found afterwards is one version, and nothing else is left.

    On a busy machine all ``count`` of them may die before they have begun, so it goes on until one left something.
    """
    versions, chance, found = _versions(out / "versions"), random.Random(1), Counter[str]()
    folder = out / "made"
    export_robot(MODELS[0], folder, verify=False)
    for number in range(20 * count):
        if number >= count and found["left something"]:
            break
        child = os.fork()
        if child == 0:
            _export_for_ever(folder)
        time.sleep(chance.uniform(0.0, 0.02))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        at_first = contents(folder / "small")
        found["mixed at first"] += at_first not in versions
        found["left something"] += any(name.startswith(".") for name in os.listdir(folder))
        differing = [bool(drift(model, folder)) for model in MODELS]  # as ``export --check`` does
        found["mixed after a look"] += contents(folder / "small") not in versions
        found["seen as none of the versions"] += all(differing)
        export_robot(chance.choice(MODELS), folder, verify=False)
        found["mixed after the next export"] += contents(folder / "small") not in versions
        found["left after the next export"] += os.listdir(folder) != ["small"]
    return found


def pairs(count: int, out: Path) -> Counter[str]:
    """Export two versions at once from two processes."""
    versions, found, folder = _versions(out / "versions"), Counter[str](), out / "made"
    for _ in range(count):
        children = [_forked(model, folder) for model in MODELS[:2]]
        failed = [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]
        found["failed"] += sum(map(bool, failed))
        found["mixed"] += contents(folder / "small") not in versions
        found["left something"] += os.listdir(folder) != ["small"]
    return found


def _versions(folder: Path) -> list[dict[str, bytes]]:
    made = []
    for number, model in enumerate(MODELS):
        export_robot(model, folder / str(number), verify=False)
        made.append(contents(folder / str(number) / "small"))
    return made


def _export_for_ever(folder: Path) -> NoReturn:
    chance = random.Random(os.getpid())
    while True:
        export_robot(chance.choice(MODELS), folder, verify=False)


def _forked(model: RobotModel, folder: Path) -> int:
    child = os.fork()
    if child:
        return child
    try:
        for _ in range(3):
            export_robot(model, folder, verify=False)
    except BaseException:
        os._exit(1)
    os._exit(0)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        campaign = {"kills": kills, "pairs": pairs}[sys.argv[1]]
        print(
            json.dumps(
                {name: number for name, number in campaign(int(sys.argv[2]), Path(temporary)).items() if number}
            )
        )
