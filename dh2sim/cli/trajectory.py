"""``dh2sim trajectory``: motions through waypoints, within limits."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dh2sim.cli.common import MANY, ForceOption, JsonOption, RobotArgument, build_any, words_of
from dh2sim.cli.output import json_text, progress_bar, require_free, table_lines, wrapped
from dh2sim.errors import ConfigurationError, SettingsError, TrajectoryError
from dh2sim.messages import did_you_mean, listed, printable, shown
from dh2sim.progress import Advance

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from dh2sim.model.robot_model import RobotModel
    from dh2sim.robot.spec import RobotSpec
    from dh2sim.robot.units import Units
    from dh2sim.trajectory.mechanism import MechanismTrajectory
    from dh2sim.trajectory.trajectory import Trajectory
    from dh2sim.trajectory.waypoints import WaypointFile

_FILES = (".yaml", ".yml", ".json")
_OTHER_FILES = (".csv", ".txt", ".toml", ".parquet")
_SOON = 0.5
"""s: what is done sooner shows no progress."""


def trajectory(
    robot: RobotArgument,
    waypoints: Annotated[
        list[str],
        typer.Argument(
            metavar="WAYPOINTS",
            help="A waypoint file; or at least two waypoints: names of configurations, or joint coordinates in the "
            "robot file's units.",
        ),
    ],
    kind: Annotated[
        str | None,
        typer.Option(
            metavar="joint|line|arc",
            help="How to get from one to the next: all joints in step, or the tool along a line or through every "
            "second waypoint along an arc. [default: joint]",
        ),
    ] = None,
    profile: Annotated[
        str | None,
        typer.Option(
            metavar="quintic|trapezoid|jerk|optimal",
            help="How motions speed up and slow down; optimal: as fast as limits of torque allow. [default: quintic]",
        ),
    ] = None,
    duration: Annotated[
        float | None,
        typer.Option(metavar="S", help="Duration of the whole motion, s. [default: as short as limits allow]"),
    ] = None,
    limits: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE...",
            help="velocity, acceleration and jerk of joints in the robot file's units, or '50%' of the robot's own; "
            "JOINT.velocity of one; tool_speed, tool_turn; with blanks, commas or repeated. Alone: the robot's own, "
            "as by default.",
        ),
    ] = None,
    through: Annotated[
        bool, typer.Option("--through", help="Pass singularities slowly instead of refusing them.")
    ] = False,
    free: Annotated[
        str | None,
        typer.Option(
            metavar="rotation|roll",
            help="What lines and arcs leave open of the orientation: all, or the roll. [default: what joints "
            "cannot hold]",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", metavar="FILE", help="Write samples: .csv or .npz.")
    ] = None,
    rate: Annotated[
        float | None, typer.Option(metavar="HZ", help="Samples per second. [default: 1000; mechanisms: 100]")
    ] = None,
    samples: Annotated[int | None, typer.Option(metavar="N", help="Number of samples, in place of --rate.")] = None,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Plan a motion through waypoints that keeps all limits, and write it as samples.

    Motions start and stop at rest at each waypoint; a waypoint file may let them pass (stop: false), and name times,
    poses of the tool, and its own limits. Limits of position, velocity, acceleration and jerk hold at all times;
    lines and arcs of the tool are exact at all times. A path that would jump to another branch of the inverse
    kinematics, or that crosses a singularity, is refused, and the place named. For a mechanism the driven joints are
    planned, by joint motions, and all joints are written: the passive ones follow.

    \b
    Examples:
      dh2sim trajectory puma560 home zero -o motion.csv
      dh2sim trajectory stanford home 20 40 0.5 -30 45 -10 --profile jerk
      dh2sim trajectory ur5e waypoints.yaml --limits velocity=50% tool_speed=0.25
      dh2sim trajectory scara home 30 60 0.1 0 --kind line --duration 2
      dh2sim trajectory four_bar home 200 -o motion.csv
    Then:
      dh2sim view puma560 motion.csv
      dh2sim plot motion.csv
      dh2sim rollout puma560 --out run.zarr --controller replay:motion.csv
    """
    from dh2sim.model.mechanism import MechanismModel
    from dh2sim.trajectory.files import require_suffix
    from dh2sim.trajectory.mechanism import driven_joints
    from dh2sim.trajectory.plan import plan_trajectory

    if out is None:
        for option, value in (("--rate", rate), ("--samples", samples), ("--force", force or None)):
            if value is not None:
                raise typer.BadParameter("needs --out", param_hint=option)
    else:
        require_suffix(out)
    require_free(out, force=force)
    [built] = build_any([robot])
    model = driven_joints(built) if isinstance(built, MechanismModel) else built
    file, points = _waypoints(model.spec, waypoints)
    request: dict[str, Any] = {
        "kind": kind or (file and file.kind),
        "profile": profile or (file and file.profile),
        "duration": duration if duration is not None else file and file.duration,
        "limits": {**(file.limits if file else {}), **_limits(model, limits)},
        "through": through or bool(file and file.through),
        "free": free or (file and file.free),
    }

    def stage(doing: str, what: str, total: int) -> AbstractContextManager[Advance]:
        return progress_bar(doing, what, total, after=_SOON)

    try:
        wanted: Any = {k: v for k, v in request.items() if v is not None}
        planned = plan_trajectory(built, points, stage=stage, **wanted)
    except TrajectoryError as error:
        raise TrajectoryError(_as_option(str(error))) from None
    if out is not None:
        planned.save(out, rate=rate, samples=samples, overwrite=force)
    count = len(planned.sample_times(rate, samples))
    if as_json:
        written = {"file": None if out is None else str(out), "samples": None if out is None else count}
        print(json_text({**planned.to_json(), **written}, indent=None))
        return
    for text in _report(model, planned):
        print(printable(text))
    if out is not None:
        print(printable(f"{out}: {count:,} samples"))


def _as_option(text: str) -> str:
    """Return what the library says with its argument as an option."""
    return text.replace("through=True", "--through")


def _waypoints(spec: RobotSpec, words: Sequence[str]) -> tuple[WaypointFile | None, Sequence[Any]]:
    """Return the waypoint file that is named, and waypoints."""
    from dh2sim.trajectory.waypoints import read_waypoints

    named = [word for word in words if word.lower().endswith(_FILES)]
    if named and len(words) == 1:
        file = read_waypoints(words[0], spec)
        return file, file.waypoints
    if named:
        raise ConfigurationError(f"{named[0]} is a waypoint file: it cannot be combined with other waypoints")
    if other := [word for word in words if os.path.isfile(word) or word.lower().endswith(_OTHER_FILES)]:
        wanted = f"these are YAML with a list 'waypoints', and end in {listed(_FILES)}"
        raise ConfigurationError(f"{shown(other[0])} is not a waypoint file: {wanted}")
    return None, _typed(spec, words)


def _typed(spec: RobotSpec, words: Sequence[str]) -> list[Any]:
    """Return waypoints that are typed: names of configurations, and as many numbers as joints for each vector."""
    from dh2sim.cli.joint_vector import read_joint_vector, split

    known, count = spec.named_configurations, len(spec.moving_rows)
    points: list[Any] = []
    pending: list[str] = []

    def finish() -> None:
        if pending:
            read = read_joint_vector(spec, pending, degrees=False, radians=False)
            points.append(list(read.q))
            pending.clear()

    for word in words:
        if word in known or (word.isidentifier() and word not in ("pi",)):
            finish()
            spec.configuration(word)  # refuses an unknown name
            points.append(word)
            continue
        parts = split([word], count)
        if len(parts) > 1:
            finish()
        pending += parts
        if len(pending) >= count or len(parts) > 1:
            finish()
    finish()
    return points


def _limits(model: RobotModel, texts: Sequence[str] | None) -> dict[str, Any]:
    """Return what ``--limits`` requests, in rad and m."""
    from dh2sim.cli.goal import numbers
    from dh2sim.trajectory.limits import GIVEN, QUANTITIES
    from dh2sim.trajectory.waypoints import limits_in_si

    problems: list[tuple[str, str]] = []
    found: dict[str, Any] = {}
    joints = [joint.name for joint in model.moving_joints]
    for word in words_of([text for text in texts or () if text != MANY], "--limits"):  # alone: the robot's own
        name, equals, value = word.partition("=")
        joint, _, quantity = name.rpartition(".")
        quantity = quantity.replace("-", "_")
        allowed = QUANTITIES if joint else GIVEN
        share = value.strip().endswith("%")
        values, wrong = numbers([value.strip().removesuffix("%")])
        if not equals:
            problems.append(("limits", f"must be NAME=VALUE, got {shown(word)}"))
        elif joint and joint not in joints:
            known = f"{did_you_mean(joint, joints)} Joints: {listed(joints)}"
            problems.append(("limits", f"{model.name} has no joint {shown(joint)} that moves.{known}"))
        elif quantity not in allowed:
            guess = f"{did_you_mean(quantity, allowed)} Allowed: {listed(allowed)}"
            problems.append(("limits", f"{shown(name)} is not a limit.{guess}"))
        elif wrong:
            problems.append(("limits", f"{name}: {wrong[0]}"))
        else:
            number: Any = f"{values[0]}%" if share else values[0]
            if joint:
                of_joints = found.setdefault(quantity, {})
                if isinstance(of_joints, dict):
                    of_joints[joint] = number
            else:
                others = found.get(quantity)
                own = others if isinstance(others, dict) else {}
                found[quantity] = {**dict.fromkeys(joints, number), **own} if quantity in QUANTITIES else number
    if problems:
        raise SettingsError(problems)
    return dict(limits_in_si(found, model.spec.moving_rows, model.spec.units))


def _report(model: RobotModel, planned: Trajectory) -> list[str]:
    """Return what is to be said of a trajectory, at most 80 columns wide."""
    from dh2sim.trajectory.mechanism import MechanismTrajectory

    units = model.spec.units
    lines = [
        f"{model.name}: {len(planned.waypoints)} waypoints, {planned.profile.value}, {planned.duration:.4g} s",
        "",
    ]
    lines += _passages(planned)
    lines += ["", *(f"  {line}" for line in _table(planned, units))]
    if isinstance(planned, MechanismTrajectory) and planned.passive:
        lines += ["", *(f"  {line}" for line in _passive_table(planned, units))]
    joint, quantity, share = planned.limiting
    lines += ["", *_filled(f"Nearest to a limit: {joint}, {100 * share:.4g} % of its {quantity}.")]
    speed, turn = planned.tool_peaks
    rate = turn / units.coordinate(1.0, turns=True)
    lines += _filled(
        f"The tool moves at up to {_short(speed)} m/s and turns at up to {_short(rate)} {units.angle.value}/s."
    )
    optimal = planned.profile.value == "optimal"
    for name in planned.limits.assumed:
        lines += [] if optimal and name != "velocity" else _filled(_ASSUMED[name])
    if optimal and any("effort" in joint.assumed for joint in model.moving_joints):
        lines += _filled("Effort limits are assumed: see 'dh2sim info'.")
    for note in planned.notes:
        lines += _filled(_as_option(note))
    return lines


_ASSUMED = {
    "velocity": "Velocity limits are assumed: the robot file gives none.",
    "acceleration": "Acceleration limits are assumed: 0.25 s from rest to the velocity limit.",
    "jerk": "Jerk limits are assumed: 0.1 s from zero to the acceleration limit.",
}


def _filled(text: str) -> list[str]:
    return wrapped(text, first="  ", rest="    ")


_MOST_PASSAGES = 24


def _passages(planned: Trajectory) -> list[str]:
    rows = [
        f"  {p.time:9.3f} s  {p.kind if p.stop or p.kind == 'start' else f'{p.kind}, passing':15}{p.name}".rstrip()
        for p in planned.waypoints
    ]
    if len(rows) > _MOST_PASSAGES:
        half = _MOST_PASSAGES // 2
        rows = [*rows[:half], f"  … {len(rows) - 2 * half} more", *rows[-half:]]
    return rows


def _table(planned: Trajectory, units: Units) -> list[str]:
    peaks, shares = planned.peaks, planned.peaks.shares(planned.limits)
    rows = [["joint", "unit", "least", "most", "velocity", "%", "accel.", "%", "jerk", "%"]]
    for i, (name, turns) in enumerate(zip(planned.joints, planned.limits.turns, strict=True)):
        unit = units.angle.value if turns else units.length.value
        scale = units.coordinate(1.0, turns=turns)
        cells = [_short(peaks.lower[i] / scale), _short(peaks.upper[i] / scale)]
        for order in range(3):
            share = f"{100 * shares[order, i]:.0f}"
            if order == 2 and planned.profile.value in ("trapezoid", "optimal"):
                share = "jumps"
            elif math.isinf(planned.limits.rates[order, i]):
                share = "free"
            cells += [_short(peaks.rates[order, i] / scale), share]
        rows.append([name if len(name) <= 16 else f"{name[:15]}…", unit, *cells])
    return table_lines(rows, left=2)


_CLOSED = 1e-7
"""rad and m: where loops determine a joint to the second order only, no smaller number means anything."""


def _passive_table(planned: MechanismTrajectory, units: Units) -> list[str]:
    rows = [["passive joint", "unit", "least", "most", "velocity"]]
    turns = {joint.name: joint.type.turns for joint in planned.mechanism.moving_joints}
    for name, values in planned.passive.items():
        unit = units.angle.value if turns[name] else units.length.value
        scale = units.coordinate(1.0, turns=turns[name])
        shown = [0.0 if abs(value) < _CLOSED else value / scale for value in values]
        rows.append([name, unit, *map(_short, shown)])
    return table_lines(rows, left=2)


def _short(value: float) -> str:
    """Return a number to four digits."""
    return f"{value + 0.0:.4g}" if abs(value) > 1e-9 else "0"
