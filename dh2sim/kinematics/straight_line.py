"""Pose and Jacobian of one joint vector, fast without compiled code: a straight line of Python for each chain.

NumPy takes microseconds a call, whatever the size; one pose is some seventy multiplications and additions of numbers.
The chain is walked with tokens in place of numbers (:mod:`dh2sim.kinematics.trace`), where zeros and ones vanish, and
what is left becomes a Python function. Until a chain has been asked often enough to repay that, the same walk is
done with the numbers themselves: it has the same operations in the same order, and so the same bits.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from dh2sim.kinematics.chain import KinematicChain
from dh2sim.kinematics.trace import (
    COSINE,
    LITERAL,
    SINE,
    VARIABLE,
    Number,
    Token,
    Trace,
    cosine,
    live_nodes,
    sine,
)
from dh2sim.typing import Array

Vector = tuple[Number, Number, Number]

CALLS_BEFORE_CODE: Final = 40
"""Calls after which code is made; making it costs as much as about a hundred walks."""
_NOTHING: Final[Vector] = (0.0, 0.0, 0.0)


class WalkFrame(NamedTuple):
    """Pose of a frame in base_link: its axes and its origin."""

    x: Vector = (1.0, 0.0, 0.0)
    y: Vector = (0.0, 1.0, 0.0)
    z: Vector = (0.0, 0.0, 1.0)
    p: Vector = _NOTHING

    def then(self, T: Array) -> WalkFrame:
        """Return the frame that has the constant pose ``T``, shape (4, 4), in this one."""
        columns = zip(*T[:3].tolist(), strict=True)
        x, y, z = (self._sum(next(columns), _NOTHING) for _ in range(3))
        return WalkFrame(x, y, z, self._sum(next(columns), self.p))

    def turned(self, s: Number, c: Number) -> WalkFrame:
        """Return the frame turned about its own z, by an angle of sine ``s`` and cosine ``c``."""
        (x1, x2, x3), (y1, y2, y3) = self.x, self.y
        x = (x1 * c + y1 * s, x2 * c + y2 * s, x3 * c + y3 * s)
        y = (y1 * c - x1 * s, y2 * c - x2 * s, y3 * c - x3 * s)
        return WalkFrame(x, y, self.z, self.p)

    def slid(self, distance: Number) -> WalkFrame:
        """Return the frame moved along its own z."""
        (p1, p2, p3), (z1, z2, z3) = self.p, self.z
        return WalkFrame(self.x, self.y, self.z, (p1 + z1 * distance, p2 + z2 * distance, p3 + z3 * distance))

    def _sum(self, factors: Sequence[float], start: Vector) -> Vector:
        """Return start + x·factors[0] + y·factors[1] + z·factors[2]; factors 0 and 1 cost nothing."""
        a, b, c = start
        for axis, factor in zip((self.x, self.y, self.z), factors, strict=True):
            if factor == 1.0:
                a, b, c = a + axis[0], b + axis[1], c + axis[2]
            elif factor != 0.0:
                a, b, c = a + axis[0] * factor, b + axis[1] * factor, c + axis[2] * factor
        return a, b, c


Turns = Sequence[tuple[Number, Number]]
"""Sine and cosine of the coordinate of each joint that moves; of a sliding joint they are not used."""


def walk(chain: KinematicChain, q: Sequence[Number], turns: Turns) -> Iterator[WalkFrame]:
    """Walk along the chain and yield the frame of each joint-placed body in base_link.

    Args:
        chain: The robot.
        q: Joint coordinates, rad and m.
        turns: Sines and cosines of them.
    """
    frame, i = WalkFrame(), 0
    for joint in chain.joints:
        frame = frame.then(joint.T_parent_joint)
        if joint.type.moves:
            if joint.type.turns:
                s, c = turns[i]
                frame = frame.turned(joint.sign * s, c)
            else:
                frame = frame.slid(joint.sign * q[i])
            i += 1
        yield frame


def _pose(
    chain: KinematicChain, carriers: int, T_joint_frame: Array, q: Sequence[Number], turns: Turns
) -> list[Number]:
    """Return the entries of a frame's pose, row by row."""
    frame = WalkFrame()
    for frame, _ in zip(walk(chain, q, turns), range(carriers), strict=False):  # noqa: B007
        pass
    x, y, z, p = frame.then(T_joint_frame)
    return [*(entry for i in range(3) for entry in (x[i], y[i], z[i], p[i])), 0.0, 0.0, 0.0, 1.0]


def _jacobian(
    chain: KinematicChain, carriers: int, T_joint_frame: Array, q: Sequence[Number], turns: Turns
) -> list[Number]:
    """Return the entries of a frame's geometric Jacobian, row by row."""
    frames = [frame for frame, _ in zip(walk(chain, q, turns), range(carriers), strict=False)]
    target = frames[-1].then(T_joint_frame).p if frames else _NOTHING
    columns: list[tuple[Number, ...]] = []
    for joint, frame in zip(chain.joints, frames, strict=False):
        if not joint.type.moves:
            continue
        z1, z2, z3 = axis = tuple(joint.sign * entry for entry in frame.z)
        if joint.type.turns:
            a, b, c = (end - start for end, start in zip(target, frame.p, strict=True))
            columns.append((z2 * c - z3 * b, z3 * a - z1 * c, z1 * b - z2 * a, *axis))
        else:
            columns.append((*axis, *_NOTHING))
    columns += [(0.0,) * 6] * (chain.n - len(columns))
    return [column[i] for i in range(6) for column in columns]


Entries = Callable[[KinematicChain, int, Array, Sequence[Number], Turns], list[Number]]
Evaluate = Callable[[object], Array | None]
"""Returns the result for a joint vector: None where it is not an array of doubles or a list or tuple of floats, of
the right length and finite, so that the caller checks it with words."""


class Kind(NamedTuple):
    """What is computed for a joint vector."""

    entries: Entries
    rows: int
    columns: int | None
    """None: the number of coordinates."""


POSE: Final = Kind(_pose, 4, 4)
JACOBIAN: Final = Kind(_jacobian, 6, None)


def of_one(
    kind: Kind, chain: KinematicChain, frame: str, carriers: int, T_joint_frame: Array, vector: Array
) -> Array:
    """Return the pose or the Jacobian of a frame for one joint vector.

    Args:
        kind: Which of them.
        chain: The robot; the code that is made for it is kept there.
        frame: Name of the frame.
        carriers: Number of joints that carry the frame.
        T_joint_frame: Its pose in the last of them, shape (4, 4).
        vector: Checked, shape (n,).

    Returns:
        Shape (4, 4) or (6, n).
    """
    known = chain.code.pose if kind.columns else chain.code.jacobian
    evaluate = known.get(frame)
    if evaluate is None and chain.code.is_due(kind, frame, CALLS_BEFORE_CODE):
        evaluate = known[frame] = _compiled(kind, chain, carriers, T_joint_frame)
    if evaluate is not None:
        result = evaluate(vector)
        if result is not None:
            return result
    q = vector.tolist()  # a sum of finite coordinates may overflow, and code takes that for infinite
    turns = [(math.sin(value), math.cos(value)) for value in q]
    entries = kind.entries(chain, carriers, T_joint_frame, q, turns)
    return np.array([entry + 0.0 for entry in entries]).reshape(kind.rows, kind.columns or chain.n)


def traced(kind: Kind, chain: KinematicChain, carriers: int, T_joint_frame: Array) -> tuple[Trace, list[Number]]:
    """Return the operations that compute a pose or a Jacobian, and its entries, row by row."""
    trace = Trace()
    q = trace.variables("q", chain.n)
    turns = [(sine(token), cosine(token)) for token in q]
    return trace, kind.entries(chain, carriers, T_joint_frame, q, turns)


def statements(trace: Trace, live: Iterable[int]) -> Iterator[tuple[int, str]]:
    """Yield arithmetic statements of a trace, with the node that each is of; sines and variables are left out."""
    for i in live:
        node = trace.nodes[i]
        if node.kind not in (VARIABLE, SINE, COSINE, LITERAL):
            left, right = (operand_text(trace, operand) for operand in node.operands)
            yield i, f"v{i} = {left} {node.kind} {right}"


def operand_text(trace: Trace, index: int) -> str:
    """Return the name of a node, or its number."""
    node = trace.nodes[index]
    return repr(node.value) if node.kind == LITERAL else f"v{index}"


def number_text(number: Number) -> str:
    """Return a number of a trace as an expression."""
    return f"{'-' if number.sign < 0 else ''}v{number.index}" if isinstance(number, Token) else repr(number)


def _compiled(kind: Kind, chain: KinematicChain, carriers: int, T_joint_frame: Array) -> Evaluate:
    """Return a function that computes a pose or a Jacobian."""
    trace, entries = traced(kind, chain, carriers, T_joint_frame)
    n = chain.n
    names = [f"v{i}" for i in range(n)]  # variables are the first nodes
    lines = [
        "def evaluate(q):",
        "    if q.__class__ is ndarray:",
        f"        if q.dtype is not float64 or q.shape != ({n},):",
        "            return None",
        "        q = q.tolist()",
        "    elif q.__class__ is list or q.__class__ is tuple:",
        f"        if len(q) != {n} or {{*map(type, q)}} - floats:",
        "            return None",
        "    else:",
        "        return None",
    ]
    if names:
        total = " + ".join(names)
        lines += [f"    [{', '.join(names)}] = q", f"    if not isfinite({total}):", "        return None"]
    live = live_nodes(trace, entries)
    for i in live:
        node = trace.nodes[i]
        if node.kind in (SINE, COSINE):
            lines.append(f"    v{i} = {node.kind}(v{node.operands[0]})")
    lines += (f"    {text}" for _, text in statements(trace, live))
    results = [f"{number_text(e)} + 0.0" if isinstance(e, Token) else repr(e + 0.0) for e in entries]
    lines += [
        f"    out = empty(({kind.rows}, {kind.columns or n}))",
        f"    pack_into(out, 0, {', '.join(results)})" if results else "",
        "    return out",
    ]
    scope = {
        "cos": math.cos,
        "sin": math.sin,
        "isfinite": math.isfinite,
        "ndarray": np.ndarray,
        "float64": np.dtype(np.float64),
        "floats": {float},
        "empty": np.empty,
        "pack_into": struct.Struct(f"{len(results)}d").pack_into,
    }
    exec("\n".join(lines), scope)
    evaluate: Evaluate = scope["evaluate"]  # type: ignore[assignment]
    return evaluate
