"""Whether a run on disk is the one that is asked for: what may differ, and what may not."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, Final

from dh2sim.messages import listed, shown
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.store.seal import Seal, stored_variables

_OF_ROBOT: Final = ("home", "velocity_limits", "kp", "kv")
"""Settings that come from the robot."""
_DIGESTS: Final = {
    "controller_digest": ("controller", "what the controller reads, or its code, is another than it was"),
    "start_digest": ("start", "the states to start from are others than they were"),
}
_NAMES: Final = {"velocity_limits": "velocity limit"}
"""Of settings that are not named like the option."""
_PACKAGES: Final = {"dh2sim": "dh2sim", "mujoco": "MuJoCo", "numpy": "NumPy"}
_SHOWN_DIGITS: Final = 12


def differences(attributes: Mapping[str, Any], seal: Seal, layout: Layout) -> list[str]:
    """Return how a run on disk differs from the one that a layout describes, in a user's words; empty: not at all.

    What follows from a difference that is named already is not named.

    Args:
        attributes: those of the run on disk.
        seal: what its blocks are made of.
        layout: the run that is asked for; the size of its blocks does not matter.
    """
    there, here = attributes, json.loads(json.dumps(dict(layout.attributes)))
    found = list(_robot(there, here))
    settings = list(_settings(there.get("settings") or {}, here.get("settings") or {}, same_robot=not found))
    physics = [_is(name, there.get(name), here.get(name)) for name in ("timestep", "integrator")]
    found += [
        *dict.fromkeys([*settings, *filter(None, physics)]),
        *_versions(there.get("versions") or {}, here.get("versions") or {}),
    ]
    if not found and there.get("mjcf") != here.get("mjcf"):
        found.append("the model is another one")
    if not found and dict(seal.variables) != stored_variables(layout):
        names = listed(seal.variables), listed(variable.name for variable in layout.variables)
        found.append(f"it holds {names[0]} there and would hold {names[1]} here")
    return found


def _robot(there: Mapping[str, Any], here: Mapping[str, Any]) -> Iterator[str]:
    if there.get("robot") != here.get("robot"):
        yield _is("robot", there.get("robot"), here.get("robot"))
    elif there.get("robot_file_sha256") != here.get("robot_file_sha256"):
        digests = [_digest(side.get("robot_file_sha256")) for side in (there, here)]
        yield f"the robot file is another one (SHA-256 {digests[0]} there and {digests[1]} here)"


def _settings(there: Mapping[str, Any], here: Mapping[str, Any], *, same_robot: bool) -> Iterator[str]:
    differing = [name for name in {**there, **here} if there.get(name) != here.get(name)]
    for name in differing:
        if name in _DIGESTS:
            origin, words = _DIGESTS[name]
            if origin not in differing:
                yield words
        elif same_robot or name not in _OF_ROBOT:
            yield _is(name, there.get(name), here.get(name))


def _versions(there: Mapping[str, Any], here: Mapping[str, Any]) -> Iterator[str]:
    for package, name in _PACKAGES.items():
        if there.get(package) != here.get(package):
            yield f"{name} is {there.get(package)} there and {here.get(package)} here"


def _is(name: str, there: object, here: object) -> str:
    """Return the words for one difference, or the empty string."""
    if there == here:
        return ""
    return f"{_NAMES.get(name, name)} is {_value(there)} there and {_value(here)} here"


def _value(value: object) -> str:
    match value:
        case dict():
            return ",".join(f"{key}={number}" for key, number in value.items()) or "nothing"
        case list() | tuple():
            return listed(map(str, value), between=",")
        case _:
            return shown(value)


def _digest(value: object) -> str:
    return f"{value[:_SHOWN_DIGITS]}…" if isinstance(value, str) and value else "of none"
