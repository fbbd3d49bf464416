"""A row of the DH table: its convention and its numbers, how it moves, what drives it and what it carries."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated, Final

from dh2sim.robot.checks import default_name
from dh2sim.robot.fields import COORDINATE, Choice, Dimension, Flag, Name, Number, Range, Tree
from dh2sim.robot.links import LinkSpec
from dh2sim.robot.magnitudes import ARMATURE, DAMPING, EFFORT, FRICTION, POSITION_GAIN, VELOCITY_GAIN
from dh2sim.robot.parts import FILLED_IN, Part


class Convention(StrEnum):
    """Order of the factors of a row's transform."""

    STANDARD = "standard"
    """A_i = Rz(theta) Tz(d) Tx(a) Rx(alpha); distal (Paul, Spong)."""
    MODIFIED = "modified"
    """A_i = Tx(a) Rx(alpha) Rz(theta) Tz(d), with a and alpha of index i - 1; proximal (Craig)."""
    HAYATI = "hayati"
    """A_i = Rz(theta) Tx(a) Rx(alpha) Ry(beta), for nearly parallel axes; distal (Hayati, Mirmirani)."""


CONVENTIONS: Final = {
    "craig": "modified",
    "mdh": "modified",
    "proximal": "modified",
    "khalil": "modified",
    "dh": "standard",
    "sdh": "standard",
    "classic": "standard",
    "classical": "standard",
    "distal": "standard",
    "paul": "standard",
    "spong": "standard",
}
"""What the conventions are called elsewhere."""


class JointType(StrEnum):
    """How a row moves."""

    REVOLUTE = "revolute"
    CONTINUOUS = "continuous"
    PRISMATIC = "prismatic"
    FIXED = "fixed"

    @property
    def moves(self) -> bool:
        """Whether the row has a joint coordinate."""
        return self is not JointType.FIXED

    @property
    def turns(self) -> bool:
        """Whether the joint coordinate is an angle."""
        return self in (JointType.REVOLUTE, JointType.CONTINUOUS)


JOINT_LETTERS: Final = {"r": "revolute", "p": "prismatic", "f": "fixed"}
"""Joint types as many tables abbreviate them."""


class ActuatorType(StrEnum):
    """What drives a joint in the MJCF."""

    POSITION = "position"
    VELOCITY = "velocity"
    MOTOR = "motor"
    NONE = "none"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Limits:
    """Limits of a joint, in the file's units."""

    position: Annotated[
        tuple[float, float] | None,
        Range("Lower and upper joint coordinate, in the file's angle or length unit.", COORDINATE),
    ] = None
    velocity: Annotated[
        float | None,
        Number("In the file's angle or length unit per second.", Dimension.COORDINATE, rate=1, above=0),
    ] = None
    effort: Annotated[float | None, Number("N·m or N.", size=EFFORT, above=0)] = None
    acceleration: Annotated[
        float | None,
        Number("Of trajectories, in the file's angle or length unit per s².", Dimension.COORDINATE, rate=2, above=0),
    ] = None
    jerk: Annotated[
        float | None,
        Number("Of trajectories, in the file's angle or length unit per s³.", Dimension.COORDINATE, rate=3, above=0),
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Dynamics:
    """Joint dynamics, in SI units."""

    damping: Annotated[float, Number("N·m·s/rad or N·s/m.", size=DAMPING, least=0)] = 0.0
    friction: Annotated[float, Number("Coulomb friction, N·m or N.", size=FRICTION, least=0)] = 0.0
    armature: Annotated[float, Number("Rotor inertia seen at the joint, kg·m² or kg.", size=ARMATURE, least=0)] = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ActuatorSpec:
    """What drives a joint in the MJCF."""

    type: Annotated[
        ActuatorType, Choice("What the control signal is; default position.", ActuatorType, inherited=True)
    ] = ActuatorType.POSITION
    kp: Annotated[
        float | None, Number("Position gain, N·m/rad or N/m; for position.", size=POSITION_GAIN, above=0)
    ] = None
    kv: Annotated[
        float | None,
        Number(
            "Velocity gain, N·m·s/rad or N·s/m; for position (0: no damping) and velocity (not 0).",
            size=VELOCITY_GAIN,
            least=0,
        ),
    ] = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Row:
    """A row of the DH table: its transform at coordinate zero, how it moves and what it carries."""

    name: Annotated[str, Name("Default joint_<i>, counted from 1.")] = FILLED_IN
    type: Annotated[
        JointType,
        Choice(
            "How the row moves; R, P and F are short for revolute, prismatic and fixed.",
            JointType,
            short=JOINT_LETTERS,
            required=True,
        ),
    ]
    convention: Annotated[
        Convention, Choice("Overrides the file's for this row.", Convention, other_names=CONVENTIONS)
    ] = FILLED_IN
    a: Annotated[float, Number("a_i (modified: a_{i-1}), in the file's length unit.", Dimension.LENGTH)] = 0.0
    alpha: Annotated[float, Number("alpha_i (modified: alpha_{i-1}), in the file's angle unit.", Dimension.ANGLE)] = (
        0.0
    )
    d: Annotated[
        float,
        Number(
            "d_i, in the file's length unit; a prismatic coordinate adds to it. "
            "A Hayati row has one only if it is prismatic.",
            Dimension.LENGTH,
        ),
    ] = 0.0
    theta: Annotated[
        float, Number("theta_i, in the file's angle unit; a revolute coordinate adds to it.", Dimension.ANGLE)
    ] = 0.0
    beta: Annotated[
        float,
        Number("beta_i, second twist, about y, in the file's angle unit; of a Hayati row only.", Dimension.ANGLE),
    ] = 0.0
    flip: Annotated[bool, Flag("True: the joint coordinate subtracts instead.")] = False
    limits: Annotated[
        Limits, Part("Limits, in the file's units; [lower, upper] are those of position.", Limits, list_is="position")
    ] = field(default_factory=Limits)
    dynamics: Annotated[Dynamics, Part("Joint dynamics, SI.", Dynamics)] = field(default_factory=Dynamics)
    link: Annotated[LinkSpec, Part("The link that this joint moves.", LinkSpec)] = field(default_factory=LinkSpec)
    actuator: Annotated[ActuatorSpec, Part("Overrides the file's actuators.", ActuatorSpec)] = field(
        default_factory=ActuatorSpec
    )


def filled_in(rows: Sequence[Tree], robot: Tree, branch: str = "") -> list[Tree]:
    """Return the rows of a checked tree, each with a name, a convention and an actuator."""
    shared = {"type": ActuatorType.POSITION, **robot.get("actuators", {})}
    convention = robot.get("convention", Convention.STANDARD)
    filled = [
        {"name": default_name(index, branch), "convention": convention, **row, "actuator": _actuator(row, shared)}
        for index, row in enumerate(rows)
    ]
    actuated = robot.get("actuated")
    if actuated is None:
        return filled
    passive = {"type": ActuatorType.NONE}
    return [row if row["name"] in actuated else {**row, "actuator": passive} for row in filled]


def _actuator(row: Tree, shared: Tree) -> Tree:
    """Return a row's actuator: its own, else the file's; gains are inherited where the types agree."""
    if row["type"] is JointType.FIXED:
        return {"type": ActuatorType.NONE}
    own = row.get("actuator", {})
    return {**shared, **own} if own.get("type", shared["type"]) is shared["type"] else own
