"""Whether a run on disk has the settings that are asked for: what may differ, and what must not."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, Final

from dh2sim.messages import listed, shown
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.store.manifest import Manifest

_OF_ROBOT: Final = ("home", "velocity_limits", "kp", "kv")
"""Settings that come from the robot."""
_DIGESTS: Final = {
    "controller_digest": ("controller", "the controller's code or a file that it reads has changed"),
    "start_digest": ("start", "the initial states have changed"),
}
"""Settings that are no use in a message; the setting that each comes from, and what to say instead."""
_BESIDE_SETTINGS: Final = ("timestep", "integrator")
"""Settings that are attributes of their own."""
_NAMES: Final = {"velocity_limits": "velocity limit"}
_PACKAGES: Final = {"dh2sim": "dh2sim", "mujoco": "MuJoCo", "numpy": "NumPy"}
_SHOWN_DIGITS: Final = 12


def differences(manifest: Manifest, layout: Layout) -> list[str]:
    """Return how a run on disk differs from the one that a layout describes, a phrase each; empty: not at all.

    What follows from another difference is left out. The size of blocks, the time and the command may differ.
    """
    old, new = manifest.attributes, json.loads(json.dumps(dict(layout.attributes)))
    found = list(_robot(old, new))
    found += [
        *_settings(_all_settings(old), _all_settings(new), same_robot=not found),
        *_versions(old.get("versions") or {}, new.get("versions") or {}),
    ]
    if not found and old.get("mjcf") != new.get("mjcf"):
        found.append("the model has changed")
    if not found and _variables(manifest) != _wanted_variables(layout):
        names = [", ".join(_variables(manifest)), ", ".join(_wanted_variables(layout))]
        found.append(f"the variables were {names[0]} and are now {names[1]}")
    return found


def _variables(manifest: Manifest) -> dict[str, tuple[Any, ...]]:
    return {name: (stored.dtype, stored.dimensions, stored.shape) for name, stored in manifest.variables.items()}


def _wanted_variables(layout: Layout) -> dict[str, tuple[Any, ...]]:
    return {
        variable.name: (variable.dtype.name, variable.dimensions, layout.shape(variable))
        for variable in layout.variables
    }


def _robot(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    if old.get("robot") != new.get("robot"):
        yield _change("robot", old.get("robot"), new.get("robot"))
    elif old.get("robot_file_sha256") != new.get("robot_file_sha256"):
        digests = [_digest(side.get("robot_file_sha256")) for side in (old, new)]
        yield f"the robot file has changed (SHA-256 {digests[0]}, now {digests[1]})"


def _all_settings(attributes: Mapping[str, Any]) -> dict[str, Any]:
    return {**(attributes.get("settings") or {}), **{name: attributes.get(name) for name in _BESIDE_SETTINGS}}


def _settings(old: Mapping[str, Any], new: Mapping[str, Any], *, same_robot: bool) -> Iterator[str]:
    changed = _changed(tuple({**old, **new}), old, new)
    for name in changed:
        if name in _DIGESTS:
            origin, words = _DIGESTS[name]
            if origin not in changed:
                yield words
        elif same_robot or name not in _OF_ROBOT:
            yield _change(name, old.get(name), new.get(name))


def _versions(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterator[str]:
    for name in _changed(tuple(_PACKAGES), old, new):
        yield f"{_PACKAGES[name]} was {old.get(name)} and is now {new.get(name)}"


def _changed(names: tuple[str, ...], old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    return [name for name in names if old.get(name) != new.get(name)]


def _change(name: str, old: object, new: object) -> str:
    return f"{_NAMES.get(name, name)} was {_value(old)} and is now {_value(new)}"


def _value(value: object) -> str:
    match value:
        case dict():
            return ",".join(f"{key}={number}" for key, number in value.items()) or "none"
        case list() | tuple():
            return listed(map(str, value), between=",")
        case _:
            return shown(value)


def _digest(value: object) -> str:
    return f"{value[:_SHOWN_DIGITS]}…" if isinstance(value, str) and value else "none"
