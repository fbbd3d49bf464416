"""What the physics checks report."""

from __future__ import annotations

from dh2sim.validate.report import Check, Quantity, Worst

ENGINE = "mujoco-rollout"
"""Name under which the checks stand in a report."""


def finding(
    quantity: Quantity,
    error: float,
    tolerance: float,
    *,
    samples: int,
    failure: str,
    reference: str = "physics",
    worst: Worst | None = None,
) -> Check:
    """Report a measured error; ``failure`` says in words what fell short, if it did."""
    ok = bool(error <= tolerance)
    return Check(
        engine=ENGINE,
        quantity=quantity,
        ok=ok,
        reference=reference,
        samples=samples,
        max_error=error,
        tolerance=tolerance,
        reason=None if ok else failure,
        worst=worst,
    )


def impossible(quantity: Quantity, reason: str) -> Check:
    """Report that something could not be checked, and why."""
    return Check(engine=ENGINE, quantity=quantity, ok=None, reason=f"{quantity.value}: {reason}")
