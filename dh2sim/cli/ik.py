"""``dh2sim ik``: all joint vectors that reach a pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dh2sim.cli.common import DONE, FELL_SHORT, MANY, JsonOption, RobotArgument, complain, load_one, words_of
from dh2sim.cli.output import json_text
from dh2sim.errors import ConfigurationError, Dh2simError, SettingsError
from dh2sim.messages import did_you_mean, listed, shown

if TYPE_CHECKING:
    from dh2sim.inverse.goals import Free
    from dh2sim.inverse.solutions import Solutions
    from dh2sim.inverse.textbook import Explanation
    from dh2sim.robot.spec import RobotSpec
    from dh2sim.typing import Array

FREE: tuple[Free, ...] = ("rotation", "roll")
Words = tuple[str, str, str]


def ik(
    robot: RobotArgument,
    pose: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="JSON file with the goal, a 4x4 matrix as 'fk --json' prints it; - for standard input.",
        ),
    ] = None,
    xyz: Annotated[Words | None, typer.Option(metavar="X Y Z", help="Position of the goal in base_link, m.")] = None,
    rpy: Annotated[
        Words | None,
        typer.Option(
            metavar="R P Y", help="Its roll, pitch, yaw, in the robot file's unit. Without orientation any will do."
        ),
    ] = None,
    quaternion: Annotated[
        tuple[str, str, str, str] | None, typer.Option(metavar="W X Y Z", help="Its orientation as a quaternion.")
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            metavar="Q...",
            help="Take the pose that these joint coordinates reach, in the robot file's units; or the name of a "
            "configuration.",
        ),
    ] = None,
    frame: Annotated[
        str | None,
        typer.Option(
            metavar="FRAME",
            help="Frame to place at the goal: tool0 or dh_1 … dh_n. Joints behind it do not move. [default: tool0]",
            show_default=False,
        ),
    ] = None,
    near: Annotated[
        str | None,
        typer.Option(metavar="Q...", help="Print the nearest to this joint vector first. [default: --at, or home]"),
    ] = None,
    lock: Annotated[
        list[str] | None,
        typer.Option(
            metavar="JOINT=VALUE...",
            help="Joints that stay where they are, in the robot file's units; with blanks, commas or repeated.",
        ),
    ] = None,
    free: Annotated[
        str | None,
        typer.Option(metavar="rotation|roll", help="Leave the orientation open, or the roll about tool0's z."),
    ] = None,
    no_limits: Annotated[bool, typer.Option("--no-limits", help="Ignore the joints' position limits.")] = False,
    numeric: Annotated[
        bool,
        typer.Option(
            "--numeric",
            help="Search for one solution numerically, or the nearest configuration; needed where more than 50 "
            "joints move.",
        ),
    ] = False,
    explain: Annotated[
        bool, typer.Option("--explain", help="Print the derivation as in a textbook, where there is one.")
    ] = False,
    as_json: JsonOption = False,
) -> int:
    """Print all joint vectors that reach a pose, each verified against the table.

    Give the pose as a file, as position and orientation, or as joint coordinates that reach it. Joint coordinates and
    angles are in the robot file's units, positions in m. Where nothing reaches the pose, the reason is printed, and
    the exit status is 1.

    \b
    Examples:
      dh2sim ik puma560 --at 10 -20 30 40 50 60       # all ways to get there
      dh2sim ik stanford --xyz 0.5 0.2 0.4 --rpy 0 90 45
      dh2sim ik planar_2r --xyz 0.6 0.4 0             # in any orientation
      dh2sim ik arm_5r --at home --free roll          # along tool0's z
      dh2sim ik franka_panda --at home --lock joint_7=0.5
      dh2sim fk stanford home --json | dh2sim ik stanford --pose - --json
    """
    from dh2sim.kinematics.chain import serial_spec_of

    spec = serial_spec_of(load_one(robot))
    asked = _read(spec, _Options(pose, xyz, rpy, quaternion, at, frame, near, lock, free, no_limits))
    solutions = _solved(asked, limits=not no_limits, numeric=numeric)
    explanation = _explained(asked) if explain else None
    if as_json:
        print(json_text(_as_json(asked, solutions, explanation), indent=None))
    else:
        from dh2sim.cli.solutions import print_solutions

        if explanation is not None:
            print("\n".join([*explanation.lines, ""]))
        print_solutions(asked.spec, asked.robot, solutions, frame=asked.frame, given=asked.given, behind=asked.behind)
    reached = bool(solutions.within_limits.any() or solutions.curves or (no_limits and len(solutions)))
    return DONE if reached else FELL_SHORT


@dataclass(frozen=True, slots=True)
class _Options:
    pose: str | None
    xyz: Words | None
    rpy: Words | None
    quaternion: tuple[str, str, str, str] | None
    at: str | None
    frame: str | None
    near: str | None
    lock: list[str] | None
    free: str | None
    no_limits: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Asked:
    """What is asked for."""

    robot: RobotSpec
    spec: RobotSpec
    """The robot up to the frame, which is its tool0."""
    frame: str
    T: Array
    near: Array
    given: Array | None
    """The joint vector that ``--at`` names, shape (n,)."""
    behind: Array
    """Coordinates of the joints behind the frame."""
    lock: dict[str, float]
    free: Free | None


def _read(spec: RobotSpec, options: _Options) -> _Asked:
    """Return what options ask for.

    Raises:
        SettingsError: Options are wrong; the error holds everything that is.
        Dh2simError: The file of ``--pose`` is.
    """
    import numpy as np

    from dh2sim.cli.goal import joints_before, read_pose_file
    from dh2sim.inverse.goals import FARTHEST
    from dh2sim.kinematics.forward import forward_kinematics

    problems: list[tuple[str, str]] = []
    ways = [f"--{name}" for name in ("pose", "xyz", "at") if getattr(options, name) is not None]
    if len(ways) != 1:
        wrong = f"{' and '.join(ways)} exclude each other; give" if ways else "no goal given; give"
        problems.append(("", f"{wrong} one of --pose, --xyz and --at"))
    if options.rpy and options.quaternion:
        problems.append(("rpy", "cannot be combined with --quaternion"))
    orientations = [name for name in ("rpy", "quaternion") if getattr(options, name)]
    if options.xyz is None:
        problems += [(name, "needs --xyz") for name in orientations]
    free = next((way for way in FREE if way == options.free), None)
    if free != options.free:
        problems.append(("free", f"must be one of {listed(FREE)}, got {shown(options.free)}"))
    file, wrong_file = None, None
    if options.pose is not None:
        try:
            file = read_pose_file(options.pose)
        except Dh2simError as error:
            wrong_file = error
    frame = options.frame or (file.frame if file else None) or "tool0"
    if file is not None and file.frame not in (None, frame):
        problems.append(("frame", f"is {frame}, but the file holds the pose of {file.frame}"))
    shortened = spec
    try:
        shortened = joints_before(spec, frame)
    except ConfigurationError as error:
        problems.append(("frame", str(error)))
    count = len(shortened.moving_rows)
    at = _vector(spec, options.at, "at", problems)
    near = _vector(spec, options.near, "near", problems)
    T = np.eye(4)
    if file is not None:
        T = file.T
    elif at is not None:
        with np.errstate(all="ignore"):
            T = forward_kinematics(shortened, at[:count])
    elif options.xyz is not None:
        T = _typed(spec, options, problems)
        if not orientations:
            free = free or "rotation"
            if options.free == "roll":
                problems.append(("free", "roll needs an orientation: --rpy or --quaternion"))
    if not bool(np.abs(T[:3, 3]).max() <= FARTHEST):
        problems.append((ways[0].removeprefix("--"), f"is a pose farther away than {FARTHEST:g} m"))
    lock = _locked(spec, shortened, options, problems)
    if problems and wrong_file:
        complain(wrong_file)
    if problems:
        raise SettingsError(problems)
    if wrong_file:
        raise wrong_file
    start = near if near is not None else at if at is not None else spec.named_configurations["home"]
    return _Asked(
        robot=spec,
        spec=shortened,
        frame=frame,
        T=T,
        near=start[:count],
        given=None if at is None else at[:count],
        behind=start[count:],
        lock=lock,
        free=free,
    )


def _vector(spec: RobotSpec, text: str | None, option: str, problems: list[tuple[str, str]]) -> Array | None:
    """Return the joint vector of an option, rad and m, shape (n,)."""
    import numpy as np

    from dh2sim.cli.joint_vector import read_joint_vector

    if text is None:
        return None
    try:
        words = text.split(MANY)
        vector = read_joint_vector(spec, words, degrees=False, radians=False)
    except ConfigurationError as error:
        problems.append((option, str(error)))
        return None
    return np.array(vector.q)


def _typed(spec: RobotSpec, options: _Options, problems: list[tuple[str, str]]) -> Array:
    """Return the pose that ``--xyz`` and an orientation name."""
    import numpy as np

    from dh2sim.cli.goal import numbers, pose_of

    values: dict[str, list[float]] = {}
    for name in ("xyz", "rpy", "quaternion"):
        words: Sequence[str] | None = getattr(options, name)
        if words:
            values[name], wrong = numbers(words)
            problems += [(name, problem) for problem in wrong]
    if "quaternion" in values and not any(values["quaternion"]):
        problems.append(("quaternion", "has length zero"))
    if problems:
        return np.eye(4)
    rpy = [spec.units.coordinate(angle, turns=True) for angle in values["rpy"]] if "rpy" in values else None
    return pose_of(values["xyz"], rpy, values.get("quaternion"))


def _locked(
    spec: RobotSpec, shortened: RobotSpec, options: _Options, problems: list[tuple[str, str]]
) -> dict[str, float]:
    """Return the values of locked joints, rad and m, by name."""
    import numpy as np

    from dh2sim.cli.goal import numbers
    from dh2sim.inverse.reach import amount_text, beyond_limits

    words = words_of(options.lock, "--lock")
    rows = {row.name: row for row in spec.moving_rows}
    lock: dict[str, float] = {}
    for word in words:
        name, equals, value = word.partition("=")
        row = rows.get(name)
        if not equals:
            problems.append(("lock", f"expected JOINT=VALUE, got {shown(word)}"))
        elif row is None:
            known = f"{did_you_mean(name, rows)} Joints: {listed(rows)}"
            problems.append(("lock", f"{spec.name} has no joint {shown(name)} that moves.{known}"))
        elif name in lock:
            problems.append(("lock", f"{name} is given twice"))
        elif row not in shortened.moving_rows:
            problems.append(("lock", f"{name} is behind {options.frame}, and does not move anyway"))
        else:
            given, wrong = numbers([value])
            problems += [("lock", f"{name}: {problem}") for problem in wrong]
            if given:
                lock[name] = spec.units.coordinate(given[0], turns=row.type.turns)
                beyond = float(beyond_limits([row], np.array([lock[name]]))[0])
                if beyond and not options.no_limits:
                    amount = amount_text(spec, abs(beyond), turns=row.type.turns)
                    problems.append(("lock", f"{name} is {amount} outside its limits; --no-limits ignores them"))
    return lock


def _solved(asked: _Asked, *, limits: bool, numeric: bool) -> Solutions:
    from dataclasses import replace

    import numpy as np

    from dh2sim.inverse.self_motion import SELF_MOTION
    from dh2sim.inverse.solver import MOST_JOINTS, InverseSolver

    moving = len(asked.spec.moving_rows) - len(asked.lock)
    if not numeric and moving > MOST_JOINTS:
        raise SettingsError(
            [("numeric", f"is needed: {moving} joints move, and all solutions are found for at most {MOST_JOINTS}")]
        )
    solver = InverseSolver(asked.spec)
    solutions: Solutions = solver.solve(asked.T, asked.near, limits, asked.lock, asked.free, numeric)
    if not limits or numeric or any(curve.kind == SELF_MOTION for curve in solutions.curves):
        return solutions
    # what limits rule out is printed, too
    anywhere: Solutions = solver.solve(asked.T, asked.near, False, asked.lock, asked.free)
    outside = ~anywhere.within_limits & ~np.isin(anywhere.same, solutions.same)
    both: dict[str, Any] = {
        name: np.concatenate([getattr(solutions, name), getattr(anywhere, name)[outside]])
        for name in ("q", "residual", "sigma_min", "within_limits", "same")
    }
    branches = [name for name, out in zip(anywhere.branch, outside, strict=True) if out]
    return replace(solutions, **both, branch=(*solutions.branch, *branches))


def _explained(asked: _Asked) -> Explanation:
    from dh2sim.inverse.textbook import explain_inverse_kinematics

    return explain_inverse_kinematics(asked.spec, asked.T)


def _as_json(asked: _Asked, solutions: Solutions, explanation: Explanation | None) -> dict[str, Any]:
    behind = asked.behind.tolist()
    found = [
        {
            "q": q.tolist() + behind,
            "within_limits": bool(solutions.within_limits[k]),
            "residual": float(solutions.residual[k]),
            "sigma_min": float(solutions.sigma_min[k]),
            "branch": solutions.branch[k],
        }
        for k, q in enumerate(solutions)
    ]
    curves = [
        {"kind": curve.kind, "closed": curve.closed, "q": [[*q, *behind] for q in curve.q.tolist()]}
        for curve in solutions.curves
    ]
    content: dict[str, Any] = {
        "robot": asked.robot.name,
        "frame": asked.frame,
        "joints": [row.name for row in asked.robot.moving_rows],
        "target": asked.T.tolist(),
        "free": asked.free,
        "complete": solutions.complete,
        "found_share": solutions.found_share,
        "solutions": found,
        "curves": curves,
        "notes": list(solutions.notes),
    }
    if solutions.reason:
        nearest = solutions.nearest
        content["reason"] = solutions.reason
        content["nearest"] = None if nearest is None else nearest.tolist() + behind
    if explanation is not None:
        derivation = explanation.as_json()
        for branch in (*derivation["branches"], *derivation["position_only"]):
            branch["q"] += behind
        content["explanation"] = list(explanation.lines)
        content["derivation"] = derivation
    return content
