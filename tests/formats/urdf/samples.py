"""URDFs for tests: written by hand, and random trees with odd angles, fixed joints, branches and masses."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dh2sim.formats.serial_robot import SerialRobot
from dh2sim.formats.urdf.read import read_urdf
from dh2sim.typing import Array, read_only

Rng = np.random.Generator

FILE = "arm.urdf"


def nowhere(uri: str) -> Path | None:
    """Find no mesh."""
    return None


def anywhere(uri: str) -> Path | None:
    """Find every mesh."""
    return Path("/meshes", uri.rpartition("/")[2])


def read(text: str | bytes, *, base: str | None = None, tip: str | None = None) -> SerialRobot:
    """Read a URDF of which no mesh is found."""
    data = text.encode() if isinstance(text, str) else text
    return read_urdf(data, file=FILE, base=base, tip=tip, find_mesh=nowhere)


def robot(*elements: str, name: str = "arm") -> str:
    """Write a robot, one element a line, so that element i stands on line i + 1."""
    return "\n".join([f'<robot name="{name}">', *elements, "</robot>"])


def links(*names: str) -> str:
    """Write links, all on one line."""
    return "".join(f'<link name="{name}"/>' for name in names)


def joint(name: str, parent: str, child: str, kind: str = "revolute", inside: str = "") -> str:
    """Write a joint with everything that is not said of it left out."""
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    limit = '<limit lower="-1" upper="1" velocity="2" effort="3"/>' if kind in ("revolute", "prismatic") else ""
    return f'<joint name="{name}" type="{kind}">{ends}{inside or limit}</joint>'


def row(values: Sequence[float] | Array) -> str:
    """Write numbers so that they read back as the same doubles."""
    return " ".join(repr(float(value)) for value in values)


def random_tree(rng: Rng, size: int, *, moving: float = 0.6) -> tuple[str, list[str]]:
    """Write a robot of ``size`` joints: a way from ``link_0``, and branches on it; return it and the way's links."""
    way = ["link_0"]
    elements = [_link(rng, "link_0")]
    for i in range(1, size + 1):
        on_way = rng.random() < 0.6 or i == 1
        parent = way[-1] if on_way else f"link_{rng.integers(0, i)}"
        kind = (
            str(rng.choice(["revolute", "continuous", "prismatic"])) if rng.random() < moving or i == 1 else "fixed"
        )
        elements += [_link(rng, f"link_{i}"), _joint(rng, f"joint_{i}", parent, f"link_{i}", kind)]
        if on_way:
            way.append(f"link_{i}")
    order = rng.permutation(len(elements))
    return robot(*(elements[i] for i in order)), way


def _origin(rng: Rng) -> str:
    right = rng.integers(-2, 3, size=3) * (np.pi / 2)
    rpy = read_only(right if rng.random() < 0.3 else rng.uniform(-np.pi, np.pi, size=3))
    return "" if rng.random() < 0.1 else f'<origin xyz="{row(rng.uniform(-1, 1, size=3))}" rpy="{row(rpy)}"/>'


def _link(rng: Rng, name: str) -> str:
    if rng.random() < 0.2 and name != "link_0":
        return f'<link name="{name}"/>'
    moments = rng.uniform(0.1, 1.0, size=3)
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    I = Q @ np.diag(moments.sum() - moments) @ Q.T  # noqa: E741
    entries = " ".join(
        f'i{"xyz"[i]}{"xyz"[j]}="{float(I[i, j])!r}"' for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
    )
    mass = f'<mass value="{rng.uniform(0.1, 9.0)!r}"/>'
    return f'<link name="{name}"><inertial>{_origin(rng)}{mass}<inertia {entries}/></inertial></link>'


def _joint(rng: Rng, name: str, parent: str, child: str, kind: str) -> str:
    direction = np.eye(3)[rng.integers(3)] if rng.random() < 0.4 else rng.normal(size=3)
    axis = read_only(direction / np.linalg.norm(direction))
    inside = _origin(rng) + f'<axis xyz="{row(axis)}"/>' + '<limit lower="-2" upper="2" velocity="1" effort="9"/>'
    return joint(name, parent, child, kind, inside)
