"""The robot as it is simulated: a compiled model, with what controllers and recorders need to know of it."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import EngineError
from dh2sim.formats.mjcf.mechanism import ARM, GAP, HELPER, HELPERS
from dh2sim.kinematics.loop_motion import actuated_joints
from dh2sim.model.actuators import seen_inertias
from dh2sim.model.mechanism import MechanismModel
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.variants import unloaded_gains
from dh2sim.mujoco_warnings import mujoco_warnings
from dh2sim.robot.spec import RobotSpec
from dh2sim.simulate.closed_loops import ClosedLoops
from dh2sim.typing import Array, read_only

FREE_TURN: Final = math.pi
"""rad: half the range of a joint that turns without limits."""
FREE_SLIDE: Final = 1.0
"""m: half the range of a joint that slides without limits."""


_HINGE: Final = int(mujoco.mjtJoint.mjJNT_HINGE)

Columns: TypeAlias = slice | NDArray[np.intp]
"""Which of MuJoCo's positions or velocities."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GapSensor:
    """Where a closure's gap is read from."""

    closure: str
    places: tuple[int, ...]
    """First of three numbers each, among MuJoCo's sensor data: m."""
    turns: tuple[int, ...]
    """First of four numbers each, a unit quaternion."""
    arm: float
    """m: by which an angle becomes a distance."""

    def gap(self, data: Array) -> Array:
        """Return the gap, m, shape (…), from sensor data of shape (…, sensors)."""
        found = np.zeros(data.shape[:-1])
        for k in self.places:
            x, y, z = (data[..., k + i] for i in range(3))
            found = np.maximum(found, np.sqrt(x * x + y * y + z * z))
        for k in self.turns:
            x, y, z = (data[..., k + i] for i in (1, 2, 3))
            found = np.maximum(found, self.arm * 2.0 * np.sqrt(x * x + y * y + z * z))
        return found


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plant:
    """A compiled model with its limits, joints and actuators in the order of the table.

    Where the rollouts of a batch have designs of their own, all arrays have shape (batch, n) or (batch, actuators).

    Of a mechanism there are two: that of all its joints, which is simulated and recorded; and ``controlled``, which
    has the driven joints alone, since the others follow.
    """

    model: mujoco.MjModel = field(repr=False)
    spec: RobotSpec = field(repr=False)
    """The robot as its file describes it."""
    timestep: float
    """s."""
    floating: bool
    """Whether base_link floats; then its seven positions and six velocities come before those of the joints."""
    joints: tuple[str, ...]
    """Names of the n moving joints."""
    turns: tuple[bool, ...]
    """Which of them turn (rad), the others slide (m)."""
    actuators: tuple[str, ...]
    driven: tuple[int, ...]
    """For each actuator the number of the joint that it drives, from 0."""
    lower: Array
    """Least joint positions, rad or m, shape (n,); -inf where unlimited."""
    upper: Array
    """Greatest joint positions; inf where unlimited."""
    velocity: Array
    """Velocity limits, rad/s or m/s, shape (n,)."""
    kp: Array
    """Stiffness for controllers with motors, N·m/rad or N/m, shape (n,)."""
    kv: Array
    """Damping for controllers with motors, N·m·s/rad or N·s/m, shape (n,)."""
    home: Array
    """Home configuration, shape (n,)."""
    control_lower: Array
    """Least controls, shape (actuators,); -inf where unlimited."""
    control_upper: Array
    """Greatest controls; inf where unlimited."""
    each: tuple[Plant, ...] = field(default=(), repr=False)
    """The plant of each rollout of a batch whose rollouts have designs of their own; ``model`` is that of the first,
    and they all have its bodies, joints and actuators."""
    positions: Columns = field(repr=False)
    """Where the joints are among MuJoCo's positions."""
    velocities: Columns = field(repr=False)
    """Where they are among its velocities."""
    loops: ClosedLoops | None = field(default=None, repr=False)
    """Of a mechanism."""
    gaps: tuple[GapSensor, ...] = ()
    """What measures how far each of its closures is open."""
    helpers: frozenset[int] = frozenset()
    """Bodies that are no links: they stand for closures."""
    independent: tuple[int, ...] | None = None
    """Which of the joints a controller sees; None for all."""

    @property
    def models(self) -> tuple[mujoco.MjModel, ...]:
        """The model of each rollout where they have designs of their own, or the one of all of them."""
        return tuple(plant.model for plant in self.each) or (self.model,)

    @property
    def may_touch(self) -> bool:
        """Whether there are shapes that can touch each other."""
        model = self.model
        return bool(model.npair or (model.geom_contype.any() and model.geom_conaffinity.any()))

    @property
    def n(self) -> int:
        """Number of moving joints."""
        return len(self.joints)

    @property
    def following(self) -> frozenset[str]:
        """Names of the joints of a mechanism that follow those that a controller sees."""
        return frozenset(row.name for row in self.spec.moving_rows) - set(self.joints)

    @property
    def controlled(self) -> Plant:
        """The robot as a controller sees it: of a mechanism, the joints that are driven."""
        if self.independent is None:
            return self
        which = list(self.independent)
        assert not isinstance(self.velocities, slice)
        assert not isinstance(self.positions, slice)
        return replace(
            self,
            joints=tuple(self.joints[k] for k in which),
            turns=tuple(self.turns[k] for k in which),
            driven=tuple(which.index(k) for k in self.driven),
            lower=read_only(self.lower[which]),
            upper=read_only(self.upper[which]),
            velocity=read_only(self.velocity[which]),
            kp=read_only(self.kp[which]),
            kv=read_only(self.kv[which]),
            home=read_only(self.home[which]),
            positions=self.positions[which],
            velocities=self.velocities[which],
            independent=None,
        )

    @property
    def size(self) -> float:
        """Of a mechanism, m; 1 for a serial robot."""
        return 1.0 if self.loops is None else self.loops.size

    @property
    def free_half_ranges(self) -> Array:
        """Half of the range that each joint is given where it has no limits, rad or m, shape (n,)."""
        return np.where(np.array(self.turns, dtype=bool), FREE_TURN, FREE_SLIDE)


_OWN: Final = ("lower", "upper", "velocity", "kp", "kv", "home", "control_lower", "control_upper")
"""What each design has."""


def batch_plant(plants: Sequence[Plant]) -> Plant:
    """Return the plant of a batch whose rollouts have these plants."""
    own: dict[str, Any] = {name: read_only(np.stack([getattr(plant, name) for plant in plants])) for name in _OWN}
    return replace(plants[0], **own, each=tuple(plants))


def compile_plant(mjcf: str, robot: RobotModel | MechanismModel) -> Plant:
    """Compile the text that ``to_mjcf`` wrote of a robot.

    Raises:
        EngineError: MuJoCo refuses it.
    """
    try:
        # a rollout says itself what becomes of it; of a description MuJoCo warns by Python's warnings
        with mujoco_warnings(), warnings.catch_warnings(action="ignore"):
            described = mujoco.MjSpec.from_string(mjcf)
            _name_pairs(described)
            compiled = described.compile()
    except ValueError as error:
        raise EngineError(
            f"MuJoCo refuses the robot as it would be simulated: {' '.join(str(error).split())}"
        ) from error
    return make_plant(compiled, robot)


MOST_PAIRS: Final = 100
"""Pairs of shapes that are named; among more, MuJoCo's search for those that are near is faster."""


def _name_pairs(described: mujoco.MjSpec) -> None:
    """Name the pairs of shapes that may touch, so that MuJoCo need not look for links that are near each other.

    That takes an eighth of a small arm's step. Contacts are the same to the last bit. Which pairs those are follows
    from https://mujoco.readthedocs.io/en/stable/computation/index.html#selection: not those of links that are fixed
    to each other, that a joint connects, or that are excluded.
    """
    moved_by, carrier = {"world": "world"}, {"world": "world"}
    shapes: dict[str, list[Any]] = {}
    for body in described.bodies:
        if body.name != "world":
            above = moved_by[body.parent.name]
            moved_by[body.name] = body.name if body.joints else above
            carrier[body.name] = above if body.joints else carrier[body.parent.name]
        shapes[body.name] = [geom for geom in body.geoms if geom.contype and geom.conaffinity]
    excluded = {frozenset((exclude.bodyname1, exclude.bodyname2)) for exclude in described.excludes}

    def may_touch(one: str, other: str) -> bool:
        first, second = moved_by[one], moved_by[other]
        adjacent = "world" not in (first, second) and (carrier[one] == second or carrier[other] == first)
        return first != second and not adjacent and frozenset((one, other)) not in excluded

    everything = list(itertools.chain.from_iterable(shapes.values()))
    number = {id(shape): k for k, shape in enumerate(everything)}
    pairs: list[list[Any]] = []
    for one, other in itertools.combinations(shapes, 2):
        if may_touch(one, other):
            # MuJoCo has contacts of two links in the order of their shapes, the one of the simpler type first
            product = itertools.product(shapes[one], shapes[other])
            both = [sorted(pair, key=lambda shape: int(shape.type)) for pair in product]
            pairs += sorted(both, key=lambda pair: [number[id(shape)] for shape in pair])
    if len(pairs) > MOST_PAIRS:
        return
    for shape in everything:
        shape.name = shape.name or f"{number[id(shape)]}/"  # no name that a robot has
        shape.contype = shape.conaffinity = 0
    for shape, another in pairs:
        described.add_pair(geomname1=shape.name, geomname2=another.name)


def make_plant(compiled: mujoco.MjModel, robot: RobotModel | MechanismModel) -> Plant:
    """Describe a robot that was compiled from what ``to_mjcf`` wrote.

    Args:
        compiled: The compiled model.
        robot: The robot, which has what an MJCF cannot hold: velocity limits, home, and gains where it has motors.
    """
    floating = compiled.njnt > 0 and compiled.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE
    first = 1 if floating else 0
    ids = np.arange(first, compiled.njnt)
    more: dict[str, Any] = {"positions": slice(7 * first, None), "velocities": slice(6 * first, None)}
    if isinstance(robot, MechanismModel):
        ids = np.array([compiled.joint(joint.name).id for joint in robot.moving_joints], dtype=np.intp)
        more = _of_mechanism(compiled, robot, ids)
        seen, home = more.pop("seen"), robot.q
    else:
        seen, home = seen_inertias(robot.chain, robot.bodies, robot.home), robot.home
    limited = compiled.jnt_limited[ids].astype(bool)
    ranges = compiled.jnt_range[ids].reshape(-1, 2)
    controlled = compiled.actuator_ctrllimited.astype(bool)
    controls = compiled.actuator_ctrlrange.reshape(-1, 2)
    gains = unloaded_gains(robot, seen)
    place = {joint: k for k, joint in enumerate(ids.tolist())}
    return Plant(
        model=compiled,
        spec=robot.spec,
        timestep=float(compiled.opt.timestep),
        floating=bool(floating),
        joints=tuple(mujoco.mj_id2name(compiled, mujoco.mjtObj.mjOBJ_JOINT, i) for i in place),
        turns=tuple(kind == _HINGE for kind in compiled.jnt_type[ids].tolist()),
        actuators=tuple(mujoco.mj_id2name(compiled, mujoco.mjtObj.mjOBJ_ACTUATOR, i) for i in range(compiled.nu)),
        driven=tuple(place[joint] for joint in compiled.actuator_trnid[:, 0].tolist()),
        lower=read_only(np.where(limited, ranges[:, 0], -np.inf)),
        upper=read_only(np.where(limited, ranges[:, 1], np.inf)),
        velocity=read_only([joint.velocity for joint in robot.moving_joints]),
        kp=read_only([kp for kp, _ in gains]),
        kv=read_only([kv for _, kv in gains]),
        home=home,
        control_lower=read_only(np.where(controlled, controls[:, 0], -np.inf)),
        control_upper=read_only(np.where(controlled, controls[:, 1], np.inf)),
        **more,
    )


def _of_mechanism(compiled: mujoco.MjModel, robot: MechanismModel, ids: NDArray[np.intp]) -> dict[str, Any]:
    """Return what a plant has of a mechanism, and under ``seen`` the inertia that each joint moves at home."""
    start = np.array(compiled.qpos0)
    driven = sorted(actuated_joints(robot.spec))
    loops = ClosedLoops(compiled, ids[driven], start, robot.size)
    seen = np.zeros(len(ids))  # the passive ones have no gains
    seen[driven] = np.diag(loops.inertia(start))
    helpers = {f"{closure.name}{HELPER}" for closure in robot.tree.closures if closure.type in HELPERS}
    gaps = []
    for closure in robot.tree.closures:
        names = [closure.name, f"{closure.name}_1", f"{closure.name}_2"]
        places = [_address(compiled, f"{name}{GAP}") for name in names]
        turns = [_address(compiled, f"{closure.name}{GAP}_turn")]
        gaps.append(
            GapSensor(
                closure=closure.name,
                places=tuple(k for k in places if k is not None),
                turns=tuple(k for k in turns if k is not None),
                arm=ARM * robot.size,
            )
        )
    return {
        "positions": ids,
        "velocities": ids,
        "loops": loops,
        "gaps": tuple(gaps),
        "helpers": frozenset(k for k in range(compiled.nbody) if compiled.body(k).name in helpers),
        "independent": tuple(driven),
        "seen": np.maximum(seen - compiled.dof_armature[ids], 0.0).tolist(),
    }


def _address(compiled: mujoco.MjModel, sensor: str) -> int | None:
    number = mujoco.mj_name2id(compiled, mujoco.mjtObj.mjOBJ_SENSOR, sensor)
    return int(compiled.sensor_adr[number]) if number >= 0 else None
