"""Reads URDF files with yourdfpy, in a process of its own.

yourdfpy and trimesh, which it stands on, import scipy, networkx, shapely and more where they find them, which takes
longer than all else; poses need none of that. They are left out here, where nothing else misses them.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from dh2sim.engines.engine import present_frames, require_joints
from dh2sim.errors import EngineCapacityError, EngineError
from dh2sim.typing import Array

ROUNDING = 1e-15
"""m and rad: less is of no account."""
NEAR = 1e-3
"""m and rad: of an origin that a small motion may take back."""
NOTICED = 1e-7
"""rad or m: its scene graph keeps a transform that differs by less than 1e-8 from the one before."""
UNUSED: Final = (
    "scipy", "shapely", "networkx", "rtree", "PIL", "embreex", "manifold3d", "mapbox_earcut", "vhacdx", "collada",
    "jsonschema", "httpx", "requests", "xxhash",
)  # fmt: skip
"""Packages that trimesh does without."""


def _imported() -> Any:
    """Return the module yourdfpy; ImportError where it is not installed."""
    hidden = [name for name in UNUSED if name not in sys.modules]
    modules: dict[str, Any] = sys.modules
    modules.update(dict.fromkeys(hidden))
    try:
        import yourdfpy
    finally:
        for name in hidden:
            del modules[name]
    return yourdfpy


try:
    _yourdfpy: Any = _imported()
    _absent = ""
except ImportError as _error:
    _absent = str(_error)


class _Reader:
    """One URDF file."""

    def __init__(self, asked: Mapping[str, Any]) -> None:
        path, joints, rows = asked["name"], asked["joints"], asked["rows"]
        try:
            self._urdf: Any = _yourdfpy.URDF.load(asked["path"], load_meshes=False)
        except Exception as error:  # its parser raises many types
            raise EngineError(f"{path}: yourdfpy refuses the file: {' '.join(str(error).split())}") from error
        found = list(self._urdf.actuated_joint_names)
        require_joints(path, found, joints)
        self._order = np.array([list(joints).index(name) for name in found], dtype=int)
        self.frames = present_frames(path, list(self._urdf.link_map), rows, dh_frames_required=False)

    def frame_poses(self, q: Array) -> Array:
        """Return the poses of ``frames`` in base_link; see ``PoseEngine``.

        Raises:
            EngineCapacityError: Something is displaced so little that yourdfpy does not notice.
        """
        if self._leaves_out(q):
            raise EngineCapacityError(
                "yourdfpy leaves out displacements of less than 1e-8 m or rad, as there are here"
            )
        poses = np.empty((len(q), len(self.frames), 4, 4))
        for k, row in enumerate(q):
            new = np.array(row[self._order], dtype=np.float64)
            if (np.abs(new - self._urdf.cfg) < NOTICED).any():
                self._urdf.update_cfg(new + 1.0)
            self._urdf.update_cfg(new)
            T, before = np.eye(4), "base_link"
            for i, frame in enumerate(self.frames):
                # from frame to frame: the time for a path through its scene graph grows with the cube of its length
                T = T @ self._urdf.get_transform(frame, before)
                poses[k, i], before = T, frame
        return poses

    def _leaves_out(self, q: Array) -> bool:
        """Whether some transform from link to link is so near the identity that it is taken for that."""
        joints = self._urdf.robot.joints
        gaps = {j.name: 0.0 if j.origin is None else float(np.abs(j.origin - np.eye(4)).max()) for j in joints}
        moving = self._urdf.actuated_joint_names
        own, moved = np.array([gaps[name] for name in moving]), np.abs(q[:, self._order])
        left = np.minimum(moved, np.abs(moved - own))[:, own < NEAR]  # a slide may take back its origin
        still = [gap for name, gap in gaps.items() if name not in moving]
        return any(ROUNDING < gap < NOTICED for gap in still) or bool(((left > ROUNDING) & (left < NOTICED)).any())


def answer(request: bytes) -> bytes:
    """Return the frames of a file, and their poses at the joint vectors that follow the request's first line."""
    head, _, numbers = request.partition(b"\n")
    asked = json.loads(head)
    if _absent:
        return json.dumps({"absent": _absent}).encode() + b"\n"
    q = np.frombuffer(numbers).reshape(asked["samples"], len(asked["joints"]))
    try:
        reader = _Reader(asked)
        poses = reader.frame_poses(q).tobytes() if len(q) else b""
    except EngineCapacityError as error:
        return json.dumps({"incapable": str(error)}).encode() + b"\n"
    except EngineError as error:
        return json.dumps({"refused": str(error)}).encode() + b"\n"
    return json.dumps({"frames": reader.frames}).encode() + b"\n" + poses
