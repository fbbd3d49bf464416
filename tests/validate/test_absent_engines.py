"""An engine that is not installed is reported, and is no failure."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.program import Outcome, environment
from tests.robot_files import small, write

WITHOUT = """
import sys
sys.modules[sys.argv.pop(1)] = None
from dh2sim.cli.main import main
main()
"""


def _without(package: str, *arguments: str | Path) -> Outcome:
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT, package, *map(str, arguments)],
        env=environment(),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    return Outcome(status=done.returncode, out=done.stdout, err=done.stderr)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "package"), [("pinocchio", "pin"), ("pybullet", "pybullet"), ("yourdfpy", "'dh2sim[engines]'")]
)
def test_an_engine_that_is_not_installed_is_null_with_the_reason(tmp_path: Path, engine: str, package: str) -> None:
    run = _without(engine, "validate", write(tmp_path, small()), "--samples", "3", "--json", "-")
    report = json.loads(run.out)
    assert (run.status, run.err, report["ok"]) == (0, "", True)
    assert [entry for entry in report["robots"][0]["engines"] if entry["engine"] == engine] == [
        {
            "engine": engine,
            "quantity": "pose",
            "ok": None,
            "reason": f"not installed (import of {engine} halted; None in sys.modules); pip install {package}",
        }
    ]


@pytest.mark.slow
def test_the_output_says_that_an_engine_was_skipped(tmp_path: Path) -> None:
    run = _without("pinocchio", "validate", write(tmp_path, small()), "--samples", "3")
    lines = run.out.splitlines()
    assert run.status == 0
    assert lines[0] == "small matches its table"
    assert [line.split() for line in lines if line.endswith("skipped")] == [["pinocchio", "pose", "skipped"]]
    assert " ".join(line.strip() for line in lines[-2:]) == (
        "pinocchio: not installed (import of pinocchio halted; None in sys.modules); pip install pin"
    )
    assert max(map(len, lines)) <= 80
