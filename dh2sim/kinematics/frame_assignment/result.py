"""What frame assignment decided, link by link: the table's numbers, their tolerances, and the reasons."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from dh2sim.kinematics.frame_assignment.lines import Case
from dh2sim.typing import Array

LOOSE = 1e-6
"""rad, and of the reach: decisions that cost no accuracy, such as which way x points, are made with this, so that
noise far below it does not change them. Axes turned by less but not parallel are nearly parallel."""
LEAST_VOLUME = 1e-3
"""Of the box spanned by three directions, for a line that meets two others to be well determined."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerances:
    """What decides that axes are exactly parallel or coincident, and that a number is a simple one."""

    angle: float
    """rad."""
    length: float
    """m."""
    reach: float
    """Of the chain, m, greater than 0: what lengths are compared with."""

    @property
    def near(self) -> float:
        """Lengths below this, m, decide nothing."""
        return LOOSE * self.reach


class BaseRule(StrEnum):
    """How frame 0 was chosen; its z lies along the first axis, its origin is the point of it nearest to the base."""

    BASE_X = "x along the base's x"
    BASE_Y = "x along the base's y, for the first axis is the base's x"
    FIRST_NORMAL = "x along the first common normal, for the first axis is oblique"
    FIRST_LINK = "frame 0 is the base, and the first row leads to the first axis"


class SlideRule(StrEnum):
    """Where the axis of a sliding joint was put, of which only the direction matters."""

    NEXT_AXIS = "on the next axis, which is parallel to it"
    TIP = "through the tip"
    PREVIOUS_AXIS = "on the previous axis, which is parallel to it"
    MEETS_BOTH = "where it meets both the previous and the next axis"
    PREVIOUS_ORIGIN = "through the previous frame's origin"
    BASE_ORIGIN = "through the base's origin"


class FootRule(StrEnum):
    """Where on the joint's axis the link's x axis begins."""

    COMMON_NORMAL = "the common normal's foot"
    SAME_ORIGIN = "the previous frame's origin, so that d is zero"
    NEXT_JOINT = "the height of the next joint's own origin"


class SenseRule(StrEnum):
    """Which of two opposite ways x points."""

    FREE = "x stays as it was, so that theta is zero"
    LEAST_THETA = "the way that leaves theta the smaller"
    TOWARDS_NEXT = "towards the next axis, for both ways leave theta at 90 degrees"
    QUARTER_TURN = "the way that makes theta +90 degrees, for both ways leave it at 90 degrees"


class TipRule(StrEnum):
    """How the last frame was chosen."""

    TIP = "the last frame is the tip"
    TIP_AXES = "the last frame is turned like the tip, which is not on the axis"
    TIP_HEIGHT = "the last frame's origin is the tip's, which is turned otherwise"
    TOOL = "the tool takes the tip's pose"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkPart:
    """X: from an axis to the next along the common normal, Tx(a) Rx(alpha), with Ry(beta) where Hayati's."""

    a: float = 0.0
    """m."""
    alpha: float = 0.0
    """rad."""
    beta: float = 0.0
    """rad."""
    hayati: bool = False


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointPart:
    """Z at coordinate zero: about and along the joint's own axis, Rz(theta) Tz(d)."""

    theta: float
    """rad."""
    d: float
    """m."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Step:
    """What was found between joint i's axis and the next, i = 1 … n - 1, and what was chosen."""

    joint: str
    next_joint: str
    case: Case
    antiparallel: bool
    """Whether the next axis points the other way, in the cases where the axes are (nearly) parallel or coincident."""
    angle: float
    """Between the directions, rad in [0, pi]."""
    distance: float
    """Between the axes, m; nearly parallel ones: at the previous frame's origin."""
    foot_rule: FootRule
    sense_rule: SenseRule
    normal_at: float | None = None
    """How far from the joint's origin the common normal of nearly parallel axes is, m; None for others."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Slide:
    """Where the axis of a sliding joint was put."""

    joint: str
    rule: SlideRule


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Assignment:
    """A chain's Denavit-Hartenberg frames: base · X_0 Z_1 X_1 Z_2 … Z_n X_n · tool, and why they are so."""

    T_base_dh0: Array = field(repr=False)
    """Pose of frame 0 in the base, shape (4, 4)."""
    links: tuple[LinkPart, ...]
    """X_0 … X_n; X_0 and X_n are the identity unless the base or the tip let them be used."""
    joints: tuple[JointPart, ...]
    """Z_1 … Z_n."""
    T_dhn_tip: Array = field(repr=False)
    """Pose of the tip behind X_n, shape (4, 4)."""
    T_link_before: tuple[Array, ...] = field(repr=False)
    """Pose of the frame behind Z_i (before X_i) in link i's own frame, i = 1 … n, each of shape (4, 4)."""
    T_link_behind: tuple[Array, ...] = field(repr=False)
    """Pose of the frame behind X_i in link i's own frame, i = 1 … n, each of shape (4, 4)."""
    base_rule: BaseRule
    slides: tuple[Slide, ...]
    steps: tuple[Step, ...]
    tip_rule: TipRule
