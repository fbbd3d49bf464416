"""Pictures of the robots that changed: their kinematic diagrams before and after."""

from __future__ import annotations

from pathlib import Path

from dh2sim.checking.files import text_before
from dh2sim.checking.findings import CheckReport
from dh2sim.draw.diagram.drawing import draw_robot
from dh2sim.errors import Dh2simError
from dh2sim.files import atomic_file
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.spec import RobotSpec


def draw_changes(report: CheckReport, folder: Path, revision: str) -> list[Path]:
    """Write ``<name>_before.svg`` and ``<name>_after.svg`` for every robot whose drawing changed.

    Of a robot that is new there is only the second one. Mechanisms, and robots that were wrong before or cannot be
    drawn, are left out.

    Args:
        report: Of a check of what changed since the revision.
        folder: Where to write; made if it is not there.
        revision: The commit, branch or tag that was compared with.

    Returns:
        The files that were written.

    Raises:
        OutputError: A file cannot be written.
        Dh2simError: git cannot tell what was there before.
    """
    written = []
    for robot in report.robots:
        if robot.name is None:
            continue
        path = Path(robot.file)
        after = _drawn(load_robot(path))
        text = text_before(revision, path)
        before = None
        if text is not None:
            try:
                before = _drawn(parse_robot(text, file=robot.file, directory=path.parent))
            except Dh2simError:
                before = None
        if after is None or after == before:
            continue
        folder.mkdir(parents=True, exist_ok=True)
        for state, svg in (("before", before), ("after", after)):
            if svg is not None:
                target = folder / f"{robot.name}_{state}.svg"
                with atomic_file(target) as draft:
                    draft.write_text(svg, encoding="utf-8")
                written.append(target)
    return written


def _drawn(spec: RobotSpec) -> str | None:
    try:
        return None if spec.is_mechanism else draw_robot(spec).svg
    except Dh2simError:
        return None
