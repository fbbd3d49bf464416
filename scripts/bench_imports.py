"""The part of ``scripts/bench`` that measures imports, against the import of what they read with in the same run."""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

Row = tuple[str, str, str, bool | None]
PARSERS = "import typer, numpy, pydantic, ruamel.yaml, xml.parsers.expat"
"""What reads a URDF, and reads the robot file back."""


def imports() -> Iterator[Row]:
    """URDFs of 7 and of 400 joints to robot files, compared at 1000 configurations, in whole processes."""
    from dh2sim import build_model, load_robot, parse_robot, to_urdf

    with TemporaryDirectory() as folder:
        short, long = Path(folder, "short.urdf"), Path(folder, "long.urdf")
        short.write_text(to_urdf(build_model(load_robot("ssrms"))), encoding="utf-8")
        long.write_text(to_urdf(build_model(parse_robot(_long_robot(400)))), encoding="utf-8")
        beyond, ratios = [], []
        for _ in range(11):
            whole = _seconds(["-m", "dh2sim", "import", str(short)])
            floor = _seconds(["-c", PARSERS])
            beyond.append(whole - floor)
            ratios.append(whole / floor)
        extra = statistics.median(beyond)
        told = f"{extra:.2f} s ({statistics.median(ratios):.2f} times)"
        yield "import of 7 joints beyond importing its parsers", told, "0.3 s", extra <= 0.3
        seconds = statistics.median(_seconds(["-m", "dh2sim", "import", str(long)]) for _ in range(3))
        yield "import of 400 joints", f"{seconds:.1f} s", "10 s", seconds <= 10.0


def _long_robot(rows: int) -> str:
    rng = np.random.default_rng(0)
    table = [
        f"  - {{type: {'prismatic' if i % 7 == 3 else 'revolute'}, a: {a}, alpha: {alpha}, d: {d}, theta: {theta}}}\n"
        for i, (a, alpha, d, theta) in enumerate(rng.uniform(-1, 1, (rows, 4)).round(3).tolist())
    ]
    return f"name: long\nconvention: standard\njoints:\n{''.join(table)}"


def _seconds(arguments: list[str]) -> float:
    start = time.perf_counter()
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
    return time.perf_counter() - start
