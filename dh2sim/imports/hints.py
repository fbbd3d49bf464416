"""What could make a table simpler."""

from __future__ import annotations

import math
from collections.abc import Iterator

from dh2sim.robot.spec import Convention, RobotSpec

_STEP = math.radians(15.0)
_LOOKS_MEANT = 1e-5
"""rad: 1.5708, 3.1416 and 0.7854 are nearer to what they stand for; calibrated angles seldom are."""


def simpler_with(spec: RobotSpec, tolerance: float) -> str | None:
    """Return a sentence on angles that the source seems to have rounded, or None.

    Args:
        spec: A table within the tolerance.
        tolerance: That it was made with.
    """
    gaps = {where: gap for where, angle in _angles(spec) if tolerance < (gap := _gap(angle)) <= _LOOKS_MEANT}
    if not gaps:
        return None
    where = max(gaps, key=gaps.__getitem__)
    wider = 10.0 ** math.ceil(math.log10(10.0 * gaps[where]))
    return (
        f"Angles look rounded in the source: {where} is {gaps[where]:.1e} rad off a multiple of 15 degrees. "
        f"--tolerance {wider:.0e} makes such numbers simple, if a residual of that size is good enough."
    )


def _angles(spec: RobotSpec) -> Iterator[tuple[str, float]]:
    for row in spec.rows:
        yield f"theta of {row.name}", row.theta
        if row.convention is not Convention.HAYATI:  # whose twists are small on purpose
            yield f"alpha of {row.name}", row.alpha


def _gap(angle: float) -> float:
    return abs(angle - _STEP * round(angle / _STEP))
