"""A robot's pose, Jacobian and inverse dynamics as a file of code, compared with the table before it is returned."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

from dh2sim.arguments import names, text
from dh2sim.codegen.base_parameters import base_parameters
from dh2sim.codegen.check import force_error, jacobian_error, pose_error
from dh2sim.codegen.forward import joint_turns, tool_jacobian, tool_pose
from dh2sim.codegen.languages import Language, program_text
from dh2sim.codegen.lengths import length_constants
from dh2sim.codegen.mechanism import Mechanism, build_mechanism, origin_moved
from dh2sim.codegen.newton_euler import inverse_dynamics
from dh2sim.codegen.program import Function, Listing, Program, What
from dh2sim.errors import Dh2simError
from dh2sim.kinematics.chain import serial_spec_of
from dh2sim.kinematics.trace import Number, Operations, Trace, count_operations
from dh2sim.messages import member
from dh2sim.model.build import model_of
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.spec import RobotSpec, SpecLike

_WIDTH: Final = 100
_MOST_TRIED: Final = 12
"""Joints whose frames may be moved along their axes; each try takes as long as the whole."""


def generate_code(
    robot: SpecLike,
    language: Language | str = Language.PYTHON,
    what: What | str | Iterable[What | str] = What.POSE,
    *,
    name: str | None = None,
) -> str:
    """Return code that computes a robot's kinematics or dynamics, in one file that needs no other.

    Its constants are named, its angles are in rad and its lengths in m. Before it is returned it is run, as Python,
    and compared with the table.

    Args:
        robot: The robot, in any form.
        language: 'python', 'numpy', 'c', 'cpp', 'matlab' or 'javascript'.
        what: 'pose' of tool0 in base_link, its 'jacobian', and 'inverse-dynamics', one or several.
        name: Begins the names of functions in C, is the namespace in C++ and the function's name in MATLAB; by
            default the robot's name.

    Returns:
        The text of the file.

    Raises:
        MismatchError: The code differs from the table by more than rounding.
        MeshError: There is no model to take masses from, for 'inverse-dynamics'.
        ModelError: The same; or the robot has branches or closures.
        Dh2simError: An argument has a value that is not allowed.
    """
    language = member(Language, language, "language")
    program, spec, model = _asked_for(robot, what, name)
    return program_text(replace(program, header=(*program.header, *_measured(program, spec, model))), language)


def _asked_for(
    robot: SpecLike, what: What | str | Iterable[What | str], name: str | None
) -> tuple[Program, RobotSpec, RobotModel | None]:
    wanted = {member(What, each, "code") for each in names("what", what)}
    if not wanted:
        raise Dh2simError(f"choose at least one of {', '.join(What)}")
    model = model_of(robot) if What.INVERSE_DYNAMICS in wanted else None
    spec = serial_spec_of(robot) if model is None else model.spec
    called = spec.name if name is None else text("name", name) or spec.name
    return _program(spec, model, [each for each in What if each in wanted], called), spec, model


@dataclass(frozen=True, slots=True, kw_only=True)
class CodeSummary:
    """What code computes with, and what a call costs."""

    operations: Mapping[str, Operations]
    """By the name of the function."""
    constants: tuple[tuple[str, float, str], ...]
    """Names, values in SI units, and notes; the base inertial parameters among them."""


def summarize(robot: SpecLike, what: What | str | Iterable[What | str] = (What.INVERSE_DYNAMICS,)) -> CodeSummary:
    """Return what ``generate_code`` would write, in numbers; arguments and errors are those of it."""
    program, _, _ = _asked_for(robot, what, None)
    return CodeSummary(
        operations={function.name: program.operations(function) for function in program.functions},
        constants=tuple((name, float(value), note) for name, value, note in Listing(program, ()).constants),
    )


def _program(spec: RobotSpec, model: RobotModel | None, wanted: list[What], name: str) -> Program:
    trace = Trace()
    mechanism = build_mechanism(spec, trace, length_constants(spec, trace))
    n = len(mechanism.joints)
    q = trace.variables("q", n)
    functions: list[Function] = []
    for each in wanted:
        match each:
            case What.POSE:
                rows = tool_pose(mechanism, q, trace)
                functions.append(_function("fk", "q", "T", (4, 4), rows, "the pose of tool0 in base_link"))
            case What.JACOBIAN:
                rows = tool_jacobian(mechanism, q, trace)
                text = "the Jacobian of tool0 in base_link, linear above angular"
                functions.append(_function("jacobian", "q", "J", (6, n), rows, text))
            case What.INVERSE_DYNAMICS:
                assert model is not None
                rows = [_forces(model, mechanism, trace)]
                text = "the forces on the joints, N m or N, for rates qd and accelerations qdd"
                functions.append(_function("inverse_dynamics", "q qd qdd", "tau", (n,), rows, text))
    return Program(
        name=name,
        n=n,
        trace=trace,
        functions=tuple(functions),
        header=tuple(_header(spec, model)),
    )


def _function(
    name: str, arguments: str, result: str, shape: tuple[int, ...], rows: list[list[Number]], text: str
) -> Function:
    values = tuple(value for row in rows for value in row)
    return Function(
        name=name, arguments=tuple(arguments.split()), result=result, shape=shape, values=values, text=text
    )


def _forces(model: RobotModel, mechanism: Mechanism, trace: Trace) -> list[Number]:
    """Return the forces on the joints, with frames on the joints' axes where that takes the fewest operations."""
    forces = _forces_of(model, mechanism, trace)
    for i in range(min(len(mechanism.joints) - 1, _MOST_TRIED)):
        other = origin_moved(mechanism, i, trace)
        if other is not None:
            found = _forces_of(model, other, trace)
            if count_operations(trace, found).arithmetic < count_operations(trace, forces).arithmetic:
                mechanism, forces = other, found
    return forces


def _forces_of(model: RobotModel, mechanism: Mechanism, trace: Trace) -> list[Number]:
    n = len(mechanism.joints)
    q, qd, qdd = (trace.variables(argument, n) for argument in ("q", "qd", "qdd"))
    x, y, z = (trace.constant(f"g{'xyz'[i]}", float(model.spec.gravity[i]), "m/s^2") for i in range(3))
    links = base_parameters(model, mechanism, trace)
    forces = inverse_dynamics(mechanism, links, joint_turns(mechanism, q, trace), q, qd, qdd, (x, y, z))
    armatures = [
        trace.constant(f"armature{joint.row}", model.joints[joint.row - 1].dynamics.armature, "kg m^2 or kg")
        for joint in mechanism.joints
    ]
    return [force + armature * rate for force, armature, rate in zip(forces, armatures, qdd, strict=True)]


def _header(spec: RobotSpec, model: RobotModel | None) -> list[str]:
    source = spec.source_file
    origin = "a robot made in code" if source is None else f"{source.name} (SHA-256 {source.sha256})"
    conventions = " and ".join(dict.fromkeys(row.convention.value for row in spec.rows))
    joints = [f"{row.name} ({'rad' if row.type.turns else 'm'})" for row in spec.moving_rows]
    lines = [
        f"{spec.name}: made by dh2sim from {origin}.",
        f"Convention: {conventions}. Units: rad, m, s, kg, N, N m.",
        f"q holds the joint coordinates as in the table: {', '.join(joints) or 'none'}.",
    ]
    if model is not None:
        lines += [
            "Inverse dynamics: links, tool, gravity and armature; no friction, damping or payload. Constants such as "
            "XX2, MX2 are base parameters of what row 2 moves: inertia and first moment about its joint, with all "
            "that may be regrouped from links after it. They contain masses and lengths of the robot file: make this "
            "file again after changing one.",
            *(entry.sentence for entry in model.estimates),
        ]
    return _wrapped(lines)


def _wrapped(lines: Iterable[str]) -> list[str]:
    """Return lines that fit a page, in ASCII and without control characters."""
    wrapper = textwrap.TextWrapper(_WIDTH, break_on_hyphens=False, break_long_words=False)
    return [part for line in lines for part in wrapper.wrap(re.sub(r"[^ -~]", "?", line))]


def _measured(program: Program, spec: RobotSpec, model: RobotModel | None) -> list[str]:
    """Return lines that say what each function costs and how exact it is."""
    names: dict[str, Any] = {}
    exec(compile(program_text(program, Language.PYTHON), f"<{program.name}>", "exec"), names)
    lines = []
    for function in program.functions:
        call = names[function.name]
        match function.name:
            case "fk":
                error = f"{_bound(pose_error(spec, call))} off the table's product"
            case "jacobian":
                error = f"{_bound(jacobian_error(spec, call))} off the chain's"
            case _:
                assert model is not None
                error = f"{_bound(force_error(model, call))} of the greatest force off Kane's equations"
        lines.append(f"{function.name}: {program.operations(function)}; at most {error}.")
    return _wrapped(lines)


def _bound(error: float) -> str:
    """Return an error with one digit, rounded up."""
    if error == 0.0:
        return "0"
    unit = 10.0 ** math.floor(math.log10(error))
    return f"{math.ceil(error / unit) * unit:.0e}"
