"""Does it move: MJCF and controller to rollouts, to a dataset and pictures.

Names are imported when they are first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from dh2sim.simulate.controllers.protocol import ClosedLoop, Controller, Lanes, Observation, OpenLoop
    from dh2sim.simulate.run import rollout
    from dh2sim.simulate.store.reader import open_dataset

__all__ = ["ClosedLoop", "Controller", "Lanes", "Observation", "OpenLoop", "open_dataset", "rollout"]

_HOMES = {
    "ClosedLoop": "controllers.protocol",
    "Controller": "controllers.protocol",
    "Lanes": "controllers.protocol",
    "Observation": "controllers.protocol",
    "OpenLoop": "controllers.protocol",
    "open_dataset": "store.reader",
    "rollout": "run",
}


def __getattr__(name: str) -> object:
    """Import a public name from where it is defined."""
    if name not in _HOMES:
        raise AttributeError(f"module 'dh2sim.simulate' has no attribute '{name}'")
    return getattr(import_module(f"dh2sim.simulate.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)
