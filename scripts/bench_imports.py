"""The part of ``scripts/bench`` that measures imports, against the import of what they read with in the same run."""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from scripts.bench_timing import Ratios, Row, run_python

PARSERS = "import typer, numpy, pydantic, ruamel.yaml, xml.parsers.expat"
"""What reads a URDF, and reads the robot file back."""


def imports() -> Iterator[Row]:
    """URDFs of 7 and of 400 joints to robot files, compared at 1000 configurations, in whole processes."""
    from dh2sim import build_model, load_robot, parse_robot, to_urdf

    with TemporaryDirectory() as folder:
        short, long = Path(folder, "short.urdf"), Path(folder, "long.urdf")
        short.write_text(to_urdf(build_model(load_robot("ssrms"))), encoding="utf-8")
        long.write_text(to_urdf(build_model(parse_robot(_long_robot(400)))), encoding="utf-8")
        beyond, ratios = [], Ratios()
        for _ in range(11):
            whole, floor = run_python("-m", "dh2sim", "import", str(short)), run_python("-c", PARSERS)
            beyond.append((whole.cpu - floor.cpu, whole.wall - floor.wall))
            ratios.add(whole, floor)
        cpu, wall = (statistics.median(times) for times in zip(*beyond, strict=True))
        figure = f"{cpu:.2f} s CPU ({ratios.cpu:.2f} times), by wall time {wall:.2f} s"
        yield "import of 7 joints beyond importing its parsers", figure, "<= 0.3 s", cpu <= 0.3
        taken = [run_python("-m", "dh2sim", "import", str(long)) for _ in range(3)]
        cpu, wall = (statistics.median(getattr(usage, kind) for usage in taken) for kind in ("cpu", "wall"))
        yield "import of 400 joints", f"{cpu:.1f} s CPU, by wall time {wall:.1f} s", "<= 10 s", cpu <= 10.0


def _long_robot(rows: int) -> str:
    rng = np.random.default_rng(0)
    table = [
        f"  - {{type: {'prismatic' if i % 7 == 3 else 'revolute'}, a: {a}, alpha: {alpha}, d: {d}, theta: {theta}}}\n"
        for i, (a, alpha, d, theta) in enumerate(rng.uniform(-1, 1, (rows, 4)).round(3).tolist())
    ]
    return f"name: long\nconvention: standard\njoints:\n{''.join(table)}"
