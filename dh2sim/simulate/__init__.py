"""Simulation of many rollouts of a robot in MuJoCo, recorded as a dataset.

Names are imported when they are first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

_HOMES = {
    "ClosedLoop": "controllers.protocol",
    "Controller": "controllers.protocol",
    "Observation": "controllers.protocol",
    "OpenLoop": "controllers.protocol",
    "RolloutBatch": "controllers.protocol",
    "RolloutOptions": "options",
    "open_dataset": "store.reader",
    "rollout": "run",
}
"""The module of every public name; a type checker reads the same below."""

__all__ = [*_HOMES]

if TYPE_CHECKING:
    from dh2sim.simulate.controllers.protocol import ClosedLoop as ClosedLoop
    from dh2sim.simulate.controllers.protocol import Controller as Controller
    from dh2sim.simulate.controllers.protocol import Observation as Observation
    from dh2sim.simulate.controllers.protocol import OpenLoop as OpenLoop
    from dh2sim.simulate.controllers.protocol import RolloutBatch as RolloutBatch
    from dh2sim.simulate.options import RolloutOptions as RolloutOptions
    from dh2sim.simulate.run import rollout as rollout
    from dh2sim.simulate.store.reader import open_dataset as open_dataset
else:

    def __getattr__(name: str) -> object:
        """Import a public name from its module."""
        from importlib import import_module

        if name not in _HOMES:
            raise AttributeError(f"module 'dh2sim.simulate' has no attribute '{name}'")
        return getattr(import_module(f"dh2sim.simulate.{_HOMES[name]}"), name)

    def __dir__() -> list[str]:
        """List the public names."""
        return [*_HOMES]
