#!/usr/bin/env python3
"""Update the pages that show what commands print, and the tables of docs/validation.md and docs/robots.md.

Every block of README.md and docs/importing.md that begins with ``$ dh2sim …`` is run, all of a page in one folder and
80 columns wide, without the optional engines that README's first line does not install. The accuracy table
shows the worst pose error of every engine on every robot at 1000 configurations; its last digits vary by machine.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from dh2sim import build_model, load_robot
from dh2sim.cli.new import DEFAULT_JOINTS, TYPES, template
from dh2sim.robot.catalog import builtin_robots, summaries
from dh2sim.robot.row import Convention
from dh2sim.validate.report import Quantity, RobotReport
from dh2sim.validate.run import validate_robot

ROOT = Path(__file__).resolve().parent.parent
README, IMPORTING, VALIDATION = ROOT / "README.md", ROOT / "docs" / "importing.md", ROOT / "docs" / "validation.md"
ROBOTS = ROOT / "docs" / "robots.md"
CONSOLE = re.compile(r"^```console\n\$ (.*?)\n.*?```$", flags=re.MULTILINE | re.DOTALL)
TABLE = re.compile(r"(?<=: begin -->\n)\|.*(?=<!-- )", flags=re.DOTALL)
MARKDOWN = re.compile(r"^```markdown\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)
ROBOT_FILE = re.compile(r"^```yaml\n(name: my_arm\n.*?)^```", flags=re.MULTILINE | re.DOTALL)
MISTAKES = (("alpha: 90,", "alfa: 90,"), ("[0.1, 1.2]", "[1.2, 0.1]"))
"""What is wrong in the robot file whose errors README.md shows."""
ABSENT = ("pinocchio", "pybullet")
NO_MODULE = """raise ModuleNotFoundError("No module named '{0}'", name="{0}")\n"""


def wrong_robot() -> str:
    """Return README's robot file, with the mistakes in it."""
    found = ROBOT_FILE.search(README.read_text(encoding="utf-8"))
    assert found is not None
    robot = found.group(1)
    for right, wrong in MISTAKES:
        assert right in robot
        robot = robot.replace(right, wrong)
    return robot


def files() -> dict[str, str]:
    """Return the files that the commands of the pages read, by name."""
    table = MARKDOWN.search(IMPORTING.read_text(encoding="utf-8"))
    assert table is not None
    types = [TYPES[letter] for letter in DEFAULT_JOINTS]
    return {
        "my_arm.yaml": template("my_arm", types, Convention.STANDARD),
        "wrong.yaml": wrong_robot(),
        "ur5.md": table.group(1),
    }


def run(command: str, folder: Path) -> str:
    """Run a command without the engines in ``ABSENT``, and return what it prints, its errors behind its results."""
    program, *arguments = command.split()
    assert program == "dh2sim"
    with TemporaryDirectory() as hiding:
        for module in ABSENT:
            Path(hiding, f"{module}.py").write_text(NO_MODULE.format(module), encoding="utf-8")
        path = os.pathsep.join(filter(None, [hiding, str(ROOT), os.environ.get("PYTHONPATH")]))
        done = subprocess.run(
            [sys.executable, "-m", "dh2sim", *arguments],
            cwd=folder,
            env={**os.environ, "COLUMNS": "80", "PYTHONPATH": path},
            capture_output=True,
            encoding="utf-8",
            timeout=120,
            check=False,
        )
    return done.stdout + done.stderr


def accuracy() -> str:
    """Return the accuracy table, as Markdown."""
    reports = [validate_robot(build_model(load_robot(name)), samples=1000) for name in builtin_robots()]
    engines = [check.engine for check in reports[0].checks if check.quantity is Quantity.POSE]
    lines = [f"| robot | reach | {' | '.join(engines)} |", f"|---|---:|{'---:|' * len(engines)}"]
    return "".join(f"{line}\n" for line in [*lines, *(_line(report, engines) for report in reports)])


def _line(report: RobotReport, engines: list[str]) -> str:
    errors = {check.engine: check for check in report.checks if check.quantity is Quantity.POSE}
    cells = [f"{errors[engine].max_position_error:.0e}" for engine in engines]
    return f"| {report.name} | {report.reach:.3g} m | {' | '.join(cells)} |"


def robots() -> str:
    """Return the table of the robots that come with dh2sim, as Markdown."""
    lines = ["| robot | kind | joints | convention | reach | moving mass |", "|---|---|---|---|---:|---:|"]
    for summary in summaries():
        model = build_model(load_robot(summary.name))
        given = all(row.link.mass is not None for row in model.spec.moving_rows)
        cells = (
            f"`{summary.name}`",
            summary.group,
            summary.joints,
            ", ".join(summary.conventions),
            f"{model.reach:.3g} m",
            f"{model.mass:.3g} kg" if given else "estimated",
        )
        lines.append(f"| {' | '.join(cells)} |")
    return "".join(f"{line}\n" for line in lines)


def updated(page: Path) -> str:
    """Return a page that shows what its commands print now."""
    text = page.read_text(encoding="utf-8")
    with TemporaryDirectory() as name:
        folder = Path(name)
        for file, content in files().items():
            if "$ dh2sim new" not in text or file != "my_arm.yaml":  # which that command writes
                (folder / file).write_text(content, encoding="utf-8")
        return CONSOLE.sub(lambda found: f"```console\n$ {found[1]}\n{run(found[1], folder)}```", text)


def main() -> None:
    """Rewrite the pages."""
    for page in (README, IMPORTING):
        page.write_text(updated(page), encoding="utf-8")
    for page, table in ((VALIDATION, accuracy), (ROBOTS, robots)):
        before, after = TABLE.split(page.read_text(encoding="utf-8"))
        page.write_text(before + table() + after, encoding="utf-8")


if __name__ == "__main__":
    main()
