"""The table turned once into a chain of joint-placed bodies; nothing after it knows of conventions.

Also what functions of a robot are given: the robot in one of its forms, and joint vectors.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.errors import ConfigurationError, ModelError
from dh2sim.kinematics.transforms import compose, identity, joint_part, link_part, pose_from_rpy, second_twist
from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec, SpecLike, not_a_robot, spec_of
from dh2sim.typing import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Joint:
    """A joint and where it sits on its parent; it moves about or along its own z axis."""

    name: str
    type: JointType
    sign: float
    """+1, or -1 for a flipped row, which moves about or along -z."""
    T_parent_joint: Array = field(repr=False)
    """Pose of the joint frame at q = 0 in the parent joint frame (base_link for the first), shape (4, 4)."""
    T_joint_dh: Array = field(repr=False)
    """Pose of the row's DH frame in the joint frame, shape (4, 4)."""


class CodeCache:
    """Functions that were made for a chain, by the name of the frame that they are of; not copied, nor pickled."""

    __slots__ = ("_calls", "compiled", "jacobian", "places", "pose")

    def __init__(self) -> None:
        self.pose: dict[str, Callable[[object], Array | None]] = {}
        """Take one joint vector."""
        self.jacobian: dict[str, Callable[[object], Array | None]] = {}
        self.compiled: dict[object, Callable[[Array, Array], bool] | None] = {}
        """Take a batch; of the numba backend."""
        self.places: dict[str, tuple[int, Array]] = {}
        """How many joints carry a frame, and its pose in the last of them."""
        self._calls: Counter[object] = Counter()

    def __reduce__(self) -> tuple[type[CodeCache], tuple[()]]:
        """Copy, and pickle, as a cache that is empty."""
        return CodeCache, ()

    def is_due(self, kind: object, frame: str, calls: int) -> bool:
        """Count a call, and return whether there were ``calls`` of them."""
        self._calls[kind, frame] += 1
        return self._calls[kind, frame] >= calls


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KinematicChain:
    """A serial chain: one joint-placed body for every row of the table."""

    joints: tuple[Joint, ...]
    T_base_link_dh0: Array = field(repr=False)
    """Pose of DH frame 0 in base_link, shape (4, 4)."""
    T_dhn_tool0: Array = field(repr=False)
    """Pose of tool0 in the last DH frame, shape (4, 4)."""
    code: CodeCache = field(default_factory=CodeCache, init=False, repr=False)
    """What was made to compute with it, no part of its value."""

    def __repr__(self) -> str:
        return f"<KinematicChain: {', '.join(joint.name for joint in self.joints)}>"

    @property
    def moving_joints(self) -> tuple[Joint, ...]:
        """The joints that have a coordinate, in the order of a joint vector."""
        return tuple(joint for joint in self.joints if joint.type.moves)

    @property
    def n(self) -> int:
        """Number of joint coordinates."""
        return len(self.moving_joints)


ChainLike: TypeAlias = KinematicChain | SpecLike


def serial_spec_of(robot: SpecLike) -> RobotSpec:
    """Return the specification of a serial robot, whatever form it is given in.

    Raises:
        ModelError: The robot has branches or closures.
        ArgumentError: It is not a robot.
    """
    spec = spec_of(robot)
    if spec.is_mechanism:
        more = "closed loops" if spec.closures else "branches"
        raise ModelError(f"{spec.name}: has {more}: this works on serial robots")
    return spec


def chain_of(robot: ChainLike) -> KinematicChain:
    """Return the chain of a robot, whatever form it is given in.

    Raises:
        ArgumentError: It is not a robot.
    """
    if isinstance(robot, KinematicChain):
        return robot
    chain = getattr(robot, "chain", None)
    if isinstance(chain, KinematicChain):
        return chain
    spec = robot if isinstance(robot, RobotSpec) else getattr(robot, "spec", None)
    if not isinstance(spec, RobotSpec):
        raise not_a_robot(robot, "a Robot, a RobotSpec or a KinematicChain")
    return build_chain(spec)


def mechanism_of(robot: ChainLike) -> RobotSpec | None:
    """Return the specification of a robot with branches or closed loops; None of a serial one, and of no robot."""
    spec = robot if isinstance(robot, RobotSpec) else getattr(robot, "spec", None)
    return spec if isinstance(spec, RobotSpec) and spec.is_mechanism else None


def configuration_of(robot: ChainLike, q: ArrayLike) -> ArrayLike:
    """Return joint vectors, which may be given by the name of one of the robot's configurations."""
    return spec_of(robot).configuration(q) if isinstance(q, str) and not isinstance(robot, KinematicChain) else q


def build_chain(spec: SpecLike) -> KinematicChain:
    """Turn a Denavit-Hartenberg table into a chain of joint-placed bodies.

    With X = Tx(a) Rx(alpha) and Z = Rz(theta) Tz(d), a row's transform is Z X (standard), X Z (modified) or
    Z X Ry(beta) (Hayati). The joint moves in Z, so what follows Z in a row comes after its joint and goes in
    front of the next. A fixed row becomes a joint that does not move.

    Args:
        spec: The robot; rows of all conventions may be mixed.

    Returns:
        One joint for every row; its transforms are the same bits on every machine.

    Raises:
        ModelError: The robot has branches or closures; ``build_tree`` takes those too.
    """
    spec = serial_spec_of(spec)
    T_base_link_dh0 = pose_from_rpy(spec.base.pose.xyz, spec.base.pose.rpy)
    return KinematicChain(
        joints=placed_joints(spec.rows, T_base_link_dh0),
        T_base_link_dh0=T_base_link_dh0,
        T_dhn_tool0=pose_from_rpy(spec.tool.xyz, spec.tool.rpy),
    )


def placed_joints(rows: Iterable[Row], T_parent_dh: Array) -> tuple[Joint, ...]:
    """Turn the rows of one chain into joint-placed bodies.

    Args:
        rows: The DH table.
        T_parent_dh: Pose of the DH frame before the first row in the parent of the first joint, shape (4, 4).
    """
    joints = []
    for row in rows:
        link, joint = link_part(row.a, row.alpha), joint_part(row.theta, row.d)
        match row.convention:
            case Convention.STANDARD:
                T_dh_joint, T_joint_dh = joint, link
            case Convention.MODIFIED:
                T_dh_joint, T_joint_dh = compose(link, joint), identity()
            case Convention.HAYATI:
                T_dh_joint, T_joint_dh = joint, compose(link, second_twist(row.beta))
        joints.append(
            Joint(
                name=row.name,
                type=row.type,
                sign=-1.0 if row.flip else 1.0,
                T_parent_joint=compose(T_parent_dh, T_dh_joint),
                T_joint_dh=T_joint_dh,
            )
        )
        T_parent_dh = T_joint_dh  # of the previous row, in the parent of the next joint
    return tuple(joints)


def joint_vectors(chain: KinematicChain, q: ArrayLike, *, finite: bool = True) -> tuple[Array, tuple[int, ...]]:
    """Check joint vectors and flatten their batch shape.

    Args:
        chain: The robot.
        q: Joint coordinates, rad and m, shape (..., n).
        finite: Whether to check that the coordinates are finite; if not, ``require_finite`` does.

    Returns:
        The joint vectors, shape (count, n), and the batch shape ``...``, whose product is count.

    Raises:
        ConfigurationError: ``q`` is not an array of real numbers, its last axis does not have length n, or a
            coordinate is not finite.
    """
    array = _numbers(q)
    n = chain.n
    if array.ndim == 0 or array.shape[-1] != n:
        names = ", ".join(joint.name for joint in chain.moving_joints)
        expected = f"{n} joint coordinate{'' if n == 1 else 's'}" + (f" ({names})" if names else "")
        raise ConfigurationError(f"expected {expected} along the last axis, got shape {array.shape}")
    if finite:
        require_finite(chain, array)
    batch = array.shape[:-1]
    return array.reshape(math.prod(batch), n), batch


def require_finite(chain: KinematicChain, q: Array) -> None:
    """Check that joint vectors are finite, shape (..., n).

    Raises:
        ConfigurationError: A coordinate is not.
    """
    if _all_finite(q):
        return
    place = tuple(int(i) for i in np.argwhere(~np.isfinite(q))[0])
    where = f" of the joint vector at index {place[:-1]}" if place[:-1] else ""
    name = chain.moving_joints[place[-1]].name
    raise ConfigurationError(f"coordinate of {name}{where} is {q[place]}: it must be finite")


def joint_vector(chain: KinematicChain, q: ArrayLike) -> Array:
    """Check a single joint vector.

    Args:
        chain: The robot.
        q: Joint coordinates, rad and m, shape (n,).

    Raises:
        ConfigurationError: ``q`` has the wrong shape or is not finite.
    """
    vectors, batch = joint_vectors(chain, q)
    if batch:
        raise ConfigurationError(f"expected one joint vector of shape ({chain.n},), got shape {np.shape(q)}")
    return np.asarray(vectors[0])


def _numbers(q: ArrayLike) -> Array:
    """Return ``q`` as doubles; complex numbers, text and lists of unequal length are refused."""
    try:
        array = np.asarray(q)
    except (TypeError, ValueError):
        raise ConfigurationError("joint vectors must have equal lengths") from None
    if array.dtype.kind not in "biuf":
        raise ConfigurationError(f"joint coordinates must be real numbers, got an array of {array.dtype}")
    return array.astype(np.float64, copy=False)


def _all_finite(array: Array) -> bool:
    """Whether every element is finite; the sum is quicker to look at than each element."""
    with np.errstate(over="ignore", invalid="ignore"):
        total = array.sum()
    return bool(np.isfinite(total)) or bool(np.isfinite(array).all())
