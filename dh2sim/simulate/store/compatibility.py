"""Whether a run on disk has the settings that are asked for: what may differ, and what must not."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final

from dh2sim.messages import listed, shown
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.store.manifest import Manifest

_OF_ROBOT: Final = ("home", "velocity_limits", "kp", "kv")
_CONSEQUENCES: Final = {
    "robot": ("robot_file_sha256", *_OF_ROBOT),
    "robot_file_sha256": _OF_ROBOT,
    "controller": ("controller_digest",),
    "start": ("start_digest",),
    "engine": ("mujoco_warp", "warp"),
}
"""What changes with another setting, and is not reported beside it."""
_PHRASES: Final = {
    "robot_file_sha256": "the robot file has changed (SHA-256 {}, now {})",
    "controller_digest": "the controller's code or a file that it reads has changed",
    "start_digest": "the initial states have changed",
    "mjcf": "the model has changed",
    "velocity_limits": "velocity limit was {} and is now {}",
    "mujoco": "MuJoCo was {} and is now {}",
    "numpy": "NumPy was {} and is now {}",
    "mujoco_warp": "MuJoCo Warp was {} and is now {}",
    "warp": "Warp was {} and is now {}",
}
_SHOWN_DIGITS: Final = 12


def differences(manifest: Manifest, layout: Layout) -> list[str]:
    """Return how a run on disk differs from the one that a layout describes, a phrase each; empty: not at all.

    What follows from another difference is left out. The size of blocks, the time and the command may differ.
    """
    old, new = _compared(manifest.attributes), _compared(json.loads(json.dumps(dict(layout.attributes))))
    changed = [name for name in {**old, **new} if old.get(name) != new.get(name)]
    hidden = {name for cause in changed for name in _CONSEQUENCES.get(cause, ())}
    if changed != ["mjcf"]:
        hidden.add("mjcf")
    found = [
        _PHRASES.get(name, f"{name} was {{}} and is now {{}}").format(*(_value(name, side) for side in (old, new)))
        for name in changed
        if name not in hidden
    ]
    stored = {name: (each.dtype, each.dimensions, each.shape) for name, each in manifest.variables.items()}
    asked = {each.name: (each.dtype.name, each.dimensions, layout.shape(each)) for each in layout.variables}
    if not found and stored != asked:
        found.append(f"the variables were {', '.join(stored)} and are now {', '.join(asked)}")
    return found


def _compared(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the attributes that must not differ, in the order in which they are reported."""
    versions = attributes.get("versions") or {}
    return {
        **{name: attributes.get(name) for name in ("robot", "robot_file_sha256")},
        "engine": "mujoco",
        **(attributes.get("settings") or {}),
        **{name: attributes.get(name) for name in ("timestep", "integrator")},
        **{name: versions.get(name) for name in ("dh2sim", "mujoco", "numpy", "mujoco_warp", "warp")},
        "mjcf": attributes.get("mjcf"),
    }


def _value(name: str, settings: Mapping[str, Any]) -> str:
    match settings.get(name):
        case str(digest) if name.endswith("sha256"):
            return f"{digest[:_SHOWN_DIGITS]}…" if digest else "none"
        case dict(items):
            return ",".join(f"{key}={number}" for key, number in items.items()) or "none"
        case list(items):
            return listed(map(str, items), between=",")
        case value:
            return shown(value)
