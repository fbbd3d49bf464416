"""The line above a plot."""

from __future__ import annotations

from dh2sim.simulate.pictures.selection import RolloutData


def title(rollout: RolloutData) -> str:
    """Return robot, controller, run and rollout, and why it stopped if it did."""
    attributes = rollout.attributes
    parts = [str(attributes[name]) for name in ("robot", "controller") if attributes.get(name)]
    parts.append(rollout.label)
    if rollout.reason:
        parts.append(f"stopped: {rollout.reason}")
    return " · ".join(part if len(part) <= 40 else part[:39] + "…" for part in parts)
