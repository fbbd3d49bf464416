"""Quaternions as an MJCF writes them: engines normalise them in silence, so a file that is off shows nowhere else."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path

from dh2sim.validate.report import Check, Quantity, Worst

TOLERANCE = 1e-12


def check_unit_quaternions(path: Path) -> Check:
    """Check that every quaternion in a file has length 1."""
    try:
        elements = list(ET.parse(path).iter())
    except ET.ParseError as error:
        return _check(False, reason=f"{path}: no well-formed XML, though MuJoCo takes it: {error}")
    errors: list[tuple[float, str]] = []
    for element in elements:
        text = element.get("quat")
        if text is None:
            continue
        name = f"{element.tag} {element.get('name', '')}".strip()
        try:
            errors.append((abs(math.hypot(*map(float, text.split())) - 1.0), name))
        except ValueError:
            return _check(False, reason=f"{path}: the quaternion of {name} is no list of numbers")
    worst, where = max(errors, key=lambda error: math.inf if math.isnan(error[0]) else error[0], default=(0.0, ""))
    return _check(worst <= TOLERANCE, worst=worst, where=where)


def _check(ok: bool, *, worst: float | None = None, where: str = "", reason: str | None = None) -> Check:
    return Check(
        engine="mjcf-file",
        quantity=Quantity.UNIT_QUATERNIONS,
        ok=ok,
        reference="1",
        max_error=worst,
        tolerance=TOLERANCE,
        reason=reason,
        worst=Worst(where=where, q=()),
    )
