"""Checks of all robot files of a repository."""

from __future__ import annotations

import re
import time
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

from dh2sim.arguments import below_one, file_path, file_paths, instance, names, whole_number
from dh2sim.checking.files import changed_files, find_robot_files
from dh2sim.checking.findings import PART_OF_RULE, Baseline, CheckPart, CheckReport, Finding, RobotCheck
from dh2sim.errors import Dh2simError, RobotError
from dh2sim.export import drift
from dh2sim.messages import member
from dh2sim.model.mechanism import MechanismModel, written_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.slips import find_slips
from dh2sim.progress import Advance
from dh2sim.robot.read import load_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.validate.report import Quantity, RobotReport, failure_text
from dh2sim.validate.run import validate_robot

ALL_PARTS = tuple(CheckPart)
_LINE = re.compile(r"from line (\d+)$")


def check_files(
    paths: Iterable[str | PathLike[str]] | str | PathLike[str] = (".",),
    *,
    exports: str | PathLike[str] | None = None,
    parts: Collection[CheckPart | str] | CheckPart | str = ALL_PARTS,
    samples: int = 200,
    seed: int = 0,
    tolerance: float = 1e-12,
    baseline: Baseline | None = None,
    changed_since: str | None = None,
    advance: Advance | None = None,
) -> CheckReport:
    """Check robot files, their exports, and the poses that all engines read from these.

    Args:
        paths: Robot files, and folders that are searched for them; one or several.
        exports: Folder with a folder of exports for every robot, which all must have then. By default 'generated',
            where robots without exports are exported afresh.
        parts: What to check, of 'files', 'drift' and 'poses'. Files are read in any case.
        samples: Number of random configurations.
        seed: Seed of the configurations.
        tolerance: Allowed angle, rad, and distance as a share of max(1 m, reach).
        baseline: Findings that are accepted.
        changed_since: A revision of git: check only robots whose file, meshes or exports changed since then.
        advance: Called with 1 after every robot.

    Returns:
        What was found. An invalid robot file counts as a finding.

    Raises:
        ArgumentError: An argument is of a wrong kind, ``samples`` is below 1, or ``tolerance`` is not above 0 and
            below 1.
        UnknownRobotError: A path does not exist.
        Dh2simError: git cannot say what changed, or a part is unknown.
    """
    chosen = tuple(member(CheckPart, part, "part") for part in names("parts", parts))
    places = file_paths("paths", paths)
    folder = file_path("exports", "generated" if exports is None else exports)
    samples, seed = whole_number("samples", samples, least=1), whole_number("seed", seed)
    tolerance = below_one("tolerance", tolerance)
    if baseline is not None:
        instance("baseline", baseline, Baseline)
    files = find_robot_files(places)
    read = [_read(path) for path in files]
    if changed_since is not None:
        changed = changed_files(changed_since, _folder_of(files, places))
        read = [entry for entry in read if entry.depends_on(changed, folder)]
    first: dict[str, Path] = {}
    robots = []
    for entry in read:
        start = time.perf_counter()
        clash = _clash(entry, first, folder, chosen)
        wanted = [part for part in chosen if not (clash and part is CheckPart.DRIFT)]
        robot = _check(entry, folder, exports is not None, wanted, samples, seed, tolerance)
        found = tuple(replace(finding, file=_posix(finding.file)) for finding in (*clash, *robot.findings))
        robots.append(replace(robot, findings=found, seconds=time.perf_counter() - start))
        if advance is not None:
            advance(1)
    return _with_baseline(CheckReport(robots=tuple(robots), parts=chosen), baseline, whole=changed_since is None)


Model = RobotModel | MechanismModel


@dataclass(frozen=True, slots=True)
class _Entry:
    """A robot file that was read."""

    path: Path
    spec: RobotSpec | None = None
    """None where the file is wrong."""
    model: Model | None = None
    """None where there is no model of the robot, either."""
    findings: tuple[Finding, ...] = ()
    """Why there is no model."""

    def depends_on(self, changed: set[Path], exports: Path) -> bool:
        """Return whether one of the files that it is made of, or that are made of it, changed."""
        if self.path.resolve() in changed:
            return True
        if self.spec is None:
            return False
        meshes = [self.spec.base.mesh, self.spec.tool.mesh, *(row.link.mesh for row in self.spec.all_rows)]
        files = {mesh.file.resolve() for mesh in meshes if mesh is not None}
        folder = (exports / self.spec.name).resolve()
        return any(path in files or folder in path.parents for path in changed)


def _read(path: Path) -> _Entry:
    spec = None
    try:
        spec = load_robot(path)
        return _Entry(path, spec, written_model(spec))
    except RobotError as error:
        found = [
            Finding(
                rule="robot-file",
                file=problem.file or str(path),
                line=problem.line,
                column=problem.column,
                path=problem.path,
                message=problem.message,
            )
            for problem in error.problems
        ]
        return _Entry(path, spec, None, tuple(found))
    except Dh2simError as error:
        return _Entry(path, spec, None, (_of_file(path, error),))


def _of_file(path: Path, error: Dh2simError) -> Finding:
    """Return the finding for an error whose text may begin with the file, or with a place in it."""
    text = str(error)
    place = re.match(re.escape(str(path)) + r":(?:(\d+):(\d+):)? ?", text)
    line, column = (int(place[1]), int(place[2])) if place and place[1] else (0, 0)
    message = text[place.end() :] if place else text
    return Finding(rule="robot-file", file=str(path), line=line, column=column, path="", message=message)


def _clash(entry: _Entry, first: dict[str, Path], exports: Path, parts: Sequence[CheckPart]) -> list[Finding]:
    """Find another robot that has the same folder of exports, and remember this one."""
    if entry.model is None:
        return []
    name = entry.model.name
    other = first.setdefault(name, entry.path)
    if other == entry.path or CheckPart.DRIFT not in parts or not (exports / name).is_dir():
        return []
    message = f"'{_posix(str(other))}' has a robot of the name '{name}', too; both would be exported to one folder"
    return [Finding(rule="name-clash", file=str(entry.path), path="name", message=message)]


def _check(
    entry: _Entry,
    exports: Path,
    required: bool,
    parts: Sequence[CheckPart],
    samples: int,
    seed: int,
    tolerance: float,
) -> RobotCheck:
    file = _posix(str(entry.path))
    if entry.model is None:
        return RobotCheck(file=file, name=None, exports=None, report=None, findings=entry.findings)
    model = entry.model
    findings: list[Finding] = []
    if CheckPart.FILES in parts and isinstance(model, RobotModel):
        findings += [
            Finding(
                rule=slip.kind.value,
                file=slip.file or str(entry.path),
                line=slip.line,
                column=slip.column,
                path=slip.path,
                message=slip.message,
            )
            for slip in find_slips(model)
        ]
    folder = exports / model.name
    exported = folder.is_dir() or required
    report = None
    try:
        if CheckPart.DRIFT in parts and exported:
            findings += _drifted(model, exports)
        if CheckPart.POSES in parts:
            written = folder if folder.is_dir() else None
            report = validate_robot(model, samples=samples, seed=seed, tolerance=tolerance, folder=written)
            missing = any(finding.rule == "drift" for finding in findings)
            findings += _engines(report, str(entry.path), files_too=not missing)
    except Dh2simError as error:
        findings.append(replace(_of_file(entry.path, error), rule="engine"))
    return RobotCheck(
        file=file,
        name=model.name,
        exports=_posix(str(folder)) if folder.is_dir() else None,
        report=report,
        findings=tuple(findings),
    )


def _drifted(model: Model, exports: Path) -> list[Finding]:
    found = []
    for entry in drift(model, exports):
        line = _LINE.search(entry.what)
        found.append(
            Finding(
                rule="drift",
                file=str(entry.path),
                line=int(line[1]) if line else 0,
                column=1 if line else 0,
                path="",
                message=f"{_LINE.sub('', entry.what).strip()}: not what '{model.name}' is exported as; "
                "write it with 'dh2sim export'",
            )
        )
    return found


def _engines(report: RobotReport, file: str, *, files_too: bool) -> list[Finding]:
    """Return what failed; without ``files_too`` no file that is missing or mixed, which drift reports already."""
    return [
        Finding(
            rule="engine",
            file=file,
            path="",
            message=f"{check.engine}, {check.quantity.value}: {failure_text(check)}",
        )
        for check in report.checks
        if check.ok is False and (files_too or check.quantity is not Quantity.FILE)
    ]


def _with_baseline(report: CheckReport, baseline: Baseline | None, *, whole: bool) -> CheckReport:
    """Mark what is accepted; ``whole`` says that all robots were checked, so that entries can be outdated."""
    if baseline is None:
        return report
    left = baseline.counts()

    def marked(finding: Finding) -> Finding:
        if left[finding.identity] == 0:
            return finding
        left[finding.identity] -= 1
        return replace(finding, accepted=True)

    robots = [replace(robot, findings=tuple(map(marked, robot.findings))) for robot in report.robots]
    outdated = sum(count for (rule, *_), count in left.items() if PART_OF_RULE.get(rule) in (None, *report.parts))
    return replace(report, robots=tuple(robots), outdated=outdated if whole else 0)


def _folder_of(files: Sequence[Path], places: Sequence[Path]) -> Path:
    """Return a folder of the repository that the files are in."""
    if files:
        return files[0].parent
    return next((place for place in places if place.is_dir()), Path())


def _posix(file: str) -> str:
    """Return a path as reports show it: with slashes, and relative to the current folder where it is below that."""
    path = Path(file)
    here = Path.cwd()
    if path.is_absolute() and here in path.parents:
        path = path.relative_to(here)
    return path.as_posix()
