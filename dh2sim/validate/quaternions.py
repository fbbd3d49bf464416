"""Quaternions as an MJCF writes them: engines normalise them in silence, so a file that is off shows nowhere else."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path

from dh2sim.validate.report import Check, Quantity, Worst

TOLERANCE = 1e-12


def check_unit_quaternions(path: Path) -> Check:
    """Check that every quaternion in a file has length 1."""
    worst, where, unreadable = 0.0, "", ""
    for element in ET.parse(path).iter():
        text = element.get("quat")
        if text is None:
            continue
        name = f"{element.tag} {element.get('name', '')}".strip()
        try:
            error = abs(math.sqrt(math.fsum(float(x) ** 2 for x in text.split())) - 1.0)
        except ValueError:
            unreadable = name
            continue
        if not error <= worst:
            worst, where = error, name
    return Check(
        engine="mjcf-file",
        quantity=Quantity.UNIT_QUATERNIONS,
        ok=bool(worst <= TOLERANCE) and not unreadable,
        reference="1",
        max_error=worst,
        tolerance=TOLERANCE,
        reason=f"{unreadable}: its quaternion is no list of numbers" if unreadable else None,
        worst=Worst(where=where, q=()),
    )
