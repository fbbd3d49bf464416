"""The text of docs/imported-robots.md."""

from __future__ import annotations

import math
import re
import textwrap
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from dh2sim.importing.result import Imported
from dh2sim.importing.sources import import_robot
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import pose_errors
from dh2sim.robot.row import Convention, Row
from scripts.real_arms.arm import TOLERANCE, Arm
from scripts.real_arms.arms import ARMS
from scripts.real_arms.congruence import congruence
from scripts.real_arms.packages import PACKAGES, Package
from scripts.real_arms.published import PUBLISHED, Published
from scripts.real_arms.reading import CONFIGURATIONS, joint_vectors, other_reader, poses_from_file
from scripts.real_arms.words import COMPARED, ELSEWHERE, FINDINGS, HEAD, REPEAT

_WIDTH = 118
_KINDS = {Convention.HAYATI: "Hayati"}
_ERROR = re.compile(r"\b\d(?:\.\d)?e-\d\d (m|rad)\b|\b0 (m|rad)\b")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Measured:
    """An imported arm, and how far another program's reading of the file is from it."""

    imported: Imported
    position: float
    """m."""
    rotation: float
    """rad."""


def measure(arm: Arm, root: Path) -> Measured:
    """Import an arm, and compare its tool with the tip that pinocchio or MuJoCo finds in the file."""
    path = arm.path(root)
    imported = import_robot(path, arm.options)
    q = joint_vectors(imported.spec)
    chain = imported.chain
    assert chain is not None
    joints = [joint.name for joint in chain.joints]
    poses = poses_from_file(path, arm.base, arm.tip, joints, q)
    position, rotation = pose_errors(table_tool_pose(imported.spec, q), poses)
    return Measured(imported=imported, position=float(position.max()), rotation=float(rotation.max()))


def page(measured: Mapping[str, Measured]) -> str:
    """Return the page.

    Args:
        measured: By the key of every arm.
    """
    joints = sum(len(measured[arm.key].imported.spec.moving_rows) for arm in ARMS)
    files = len({(arm.package.name, arm.file) for arm in ARMS})
    head = HEAD.format(arms=len(ARMS), files=files, joints=joints, configurations=CONFIGURATIONS, tolerance=TOLERANCE)
    tables = "\n".join(_package(package, measured) for package in PACKAGES)
    same = "\n".join(_compared(published, measured) for published in PUBLISHED if published.same_arm)
    other = "\n".join(_compared(published, measured) for published in PUBLISHED if not published.same_arm)
    return "\n".join([head, tables, COMPARED, same, ELSEWHERE, other, FINDINGS, REPEAT])


def stable(text: str) -> str:
    """Return a page without what depends on the machine: the errors' digits."""
    return _ERROR.sub(lambda found: f"~ {found[1] or found[2]}", text)


def line(arm: Arm, measured: Measured) -> str:
    """Return an arm's line of the table."""
    spec, residual = measured.imported.spec, measured.imported.residual
    assert residual is not None
    kinds = Counter(row.convention for row in spec.rows)
    kinds_text = ", ".join(f"{number} {_KINDS.get(kind, kind)}" for kind, number in kinds.items())
    cells = (
        arm.robot,
        f"`{arm.file}`",
        f"`{arm.base}` → `{arm.tip}`",
        _options(arm),
        kinds_text,
        errors(residual.position, residual.rotation),
        errors(measured.position, measured.rotation),
        arm.remark,
    )
    return f"| {' | '.join(cells)} |".replace("|  |", "| |")


def errors(position: float, rotation: float) -> str:
    """Return two errors as ``4e-16 m, 7e-16 rad``."""
    return f"{_error(position)} m, {_error(rotation)} rad"


def _error(value: float) -> str:
    return f"{value:.0e}" if value else "0"


def _options(arm: Arm) -> str:
    asked = [
        f"--base {arm.base}" if arm.ask_base else "",
        f"--tip {arm.tip}" if arm.ask_tip else "",
        "--convention modified" if arm.convention is Convention.MODIFIED else "",
        "" if arm.tolerance == TOLERANCE else f"--tolerance {arm.tolerance:.0e}".replace("e-0", "e-"),
    ]
    return " ".join(f"`{option}`" for option in asked if option)


def _package(package: Package, measured: Mapping[str, Measured]) -> str:
    arms = [arm for arm in ARMS if arm.package is package]
    other = other_reader(Path(arms[0].file))
    lines = [
        f"### {package.name} {package.version}\n",
        f"{package.license}; files below `{package.root}`.\n",
        f"| robot | file | from → to | options | rows | residual | by {other} | |",
        f"|{'---|' * 8}",
        *(line(arm, measured[arm.key]) for arm in arms),
    ]
    return "\n".join([*lines, ""])


def _compared(published: Published, measured: Mapping[str, Measured]) -> str:
    """Return both tables beside each other, and how they hang together."""
    imported = measured[published.arm.key].imported.spec
    ours = [_numbers(row) for row in imported.rows]
    ours += [("—",) * 4] * (len(published.rows) - len(ours))
    rows = [
        f"| {name} | {' | '.join(_number(value) for value in theirs)} | | {' | '.join(own)} |"
        for name, theirs, own in zip(_names(published), published.rows, ours, strict=True)
    ]
    lines = [
        f"### {published.robot}\n",
        _filled(
            f"Published: {published.source}. Imported: `{published.arm.file}` of {published.arm.package.name}, "
            f"{published.convention} convention."
        ),
        "",
        "| joint | a, m | alpha, ° | d, m | theta, ° | | a, m | alpha, ° | d, m | theta, ° |",
        "|---|---:|---:|---:|---:|---|---:|---:|---:|---:|",
        *rows,
        "",
        _filled(published.why),
    ]
    if published.same_senses:
        lines += ["", _filled(_relation(published, measured))]
    return "\n".join([*lines, ""])


def _relation(published: Published, measured: Mapping[str, Measured]) -> str:
    result = congruence(published, measured[published.arm.key].imported.spec)
    turn = f"Rz({published.turn:g}°) " if published.turn else ""
    still = not result.xyz.any() and not result.rpy.any()
    xyz, rpy = (", ".join(_number(value) for value in values.tolist()) for values in (result.xyz, result.rpy))
    ending = "" if still else " E"
    where = "" if still else f", E at ({xyz}) m and turned by roll, pitch, yaw ({rpy})°"
    if published.same_arm:
        size = errors(result.position, result.rotation)
    else:
        size = f"{1e3 * result.position:.2f} mm, {math.degrees(result.rotation):.2f}°"
    return f"**T_published(q) = {turn}T_imported(q){ending}**{where}: off by at most {size} at 1000 random q."


def _filled(text: str) -> str:
    return textwrap.fill(text, _WIDTH, break_long_words=False, break_on_hyphens=False)


def _names(published: Published) -> list[str]:
    names = [str(i) for i in range(1, len(published.rows) + 1)]
    return [*names[:-1], "flange"] if published.flange else names


def _numbers(row: Row) -> tuple[str, str, str, str]:
    return (
        _number(row.a),
        _number(math.degrees(row.alpha)),
        _number(row.d),
        _number(math.degrees(row.theta)),
    )


def _number(value: float) -> str:
    return f"{value + 0.0:.12g}"
