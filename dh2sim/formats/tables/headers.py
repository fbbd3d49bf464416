"""What a column holds, from its heading as people write it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from dh2sim.formats.tables.grid import Cell
from dh2sim.formats.tables.plain import plain
from dh2sim.robot.units import AngleUnit, LengthUnit


class Quantity(StrEnum):
    """What a column can hold."""

    THETA = "theta"
    D = "d"
    A = "a"
    ALPHA = "alpha"
    BETA = "beta"
    R = "r"
    """a in some books, d in Khalil's."""
    OFFSET = "offset"
    """Adds to the coordinate; in a table without d it is d."""
    TYPE = "type"
    NAME = "name"
    JOINT = "joint"
    """Numbers, names or types of the joints."""
    LOWER = "lower limit"
    UPPER = "upper limit"
    LIMITS = "limits"
    FLIP = "flip"
    SIGN = "sign"
    VARIABLE = "variable"


PARAMETERS: Final = (Quantity.THETA, Quantity.D, Quantity.A, Quantity.ALPHA, Quantity.BETA, Quantity.R)
"""The columns that tell a table of Denavit-Hartenberg parameters from others."""

ANGLE_WORDS: Final = {
    **dict.fromkeys(("°", "deg", "degs", "degree", "degrees"), AngleUnit.DEG),
    **dict.fromkeys(("rad", "rads", "radian", "radians"), AngleUnit.RAD),
}
LENGTH_WORDS: Final = {
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), LengthUnit.MM),
    **dict.fromkeys(("cm", "centimeter", "centimeters", "centimetre", "centimetres"), LengthUnit.CM),
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), LengthUnit.M),
    **dict.fromkeys(("in", "inch", "inches"), LengthUnit.IN),
}
UNIT: Final = "°|" + "|".join(sorted((*ANGLE_WORDS.keys() - {"°"}, *LENGTH_WORDS), key=len, reverse=True))

_NAMES: Final = {
    Quantity.THETA: "theta|th|joint angle|theta angle",
    Quantity.D: "d|s|link offset|offset distance",
    Quantity.A: "a|link length|length",
    Quantity.ALPHA: "alpha|alp|twist|twist angle|link twist|link twist angle",
    Quantity.BETA: "beta|second twist",
    Quantity.R: "r",
    Quantity.OFFSET: "offset|off|joint offset|theta offset|thetaoffset|theta0|offset theta|q offset|angle offset",
    Quantity.TYPE: "type|joint type|jointtype|sigma|kind|r/p|rp|p/r",
    Quantity.NAME: "name|joint name|link name|jointname|joint names",
    Quantity.JOINT: "joint|joints|joint no|joint number|joint id|link|links|link no|link number|no|nr|num|number|#|"
    "axis|frame|row|idx|index|id",
    Quantity.LOWER: "min|lower|qmin|q min|q-|lower limit|min limit|limit min|limit lower|theta min|thetamin|"
    "joint min|lower bound|minimum|min angle|qlow",
    Quantity.UPPER: "max|upper|qmax|q max|q+|upper limit|max limit|limit max|limit upper|theta max|thetamax|"
    "joint max|upper bound|maximum|max angle|qhigh",
    Quantity.LIMITS: "limits|limit|range|joint limits|joint limit|joint range|position limits|motion range|"
    "range of motion|working range|qlim",
    Quantity.FLIP: "flip|flipped",
    Quantity.SIGN: "sign|direction|dir",
    Quantity.VARIABLE: "variable|joint variable|joint var|var|q|coordinate|joint coordinate",
}
KNOWN: Final = {name: quantity for quantity, names in _NAMES.items() for name in names.split("|")}
_PHRASES: Final = ("link twist angle", "twist angle", "link twist", "link length", "link offset", "joint offset")
_PHRASES_TOO: Final = ("joint angle", "joint variable", "offset distance", "twist", "length", "offset", "angle")
_BRACKETED: Final = re.compile(rf"\s*[\[(]\s*(?:in\s+)?({UNIT})\s*[\])]")
_TRAILING: Final = re.compile(rf"\s*[,/;]\s*(?:in\s+)?({UNIT})$|\s+in\s+({UNIT})$|[\s_]({UNIT})$|\s*(°)$")
_INDEXED: Final = re.compile(r"(.*?)[\s_]*[\[(]?\s*([ijkn])\s*(-\s*1)?\s*[\])]?")


@dataclass(frozen=True, slots=True, kw_only=True)
class Heading:
    """A heading, read."""

    cell: Cell
    quantity: Quantity | None
    """None where it is not known."""
    index: int | None = None
    """0 for an index i, -1 for i - 1, None where the heading has none."""
    angle: AngleUnit | None = None
    length: LengthUnit | None = None


def read_heading(cell: Cell) -> Heading:
    r"""Return what a heading says: ``$\alpha_{i-1}$ (deg)`` is alpha, of index i - 1, in degrees."""
    name = plain(cell.text).casefold().rstrip("*:. ")
    name, unit = _without_unit(name)
    quantity, index = _quantity(name)
    return Heading(
        cell=cell, quantity=quantity, index=index, angle=ANGLE_WORDS.get(unit), length=LENGTH_WORDS.get(unit)
    )


def _without_unit(name: str) -> tuple[str, str]:
    """Return a heading without its unit, and the unit or nothing."""
    if name in KNOWN:
        return name, ""
    if found := _BRACKETED.search(name):
        return f"{name[: found.start()]} {name[found.end() :]}".strip(), found[1]
    if found := _TRAILING.search(name):
        return name[: found.start()].strip(), next(unit for unit in found.groups() if unit)
    return name, ""


def _quantity(name: str) -> tuple[Quantity | None, int | None]:
    """Return what a name without unit stands for, and its index."""
    quantity, index = _symbol(name)
    if quantity is not None or len(name) > 60:
        return quantity, index
    for phrase in (*_PHRASES, *_PHRASES_TOO):
        before, found, after = name.partition(phrase)
        if not found:
            continue
        rest = f"{before} {after}".strip(" ()[]:,=-_")
        other, index = _symbol(rest) if rest else (None, None)
        said = KNOWN.get(phrase)
        if said in (other, None) or not rest:
            return other or said, index
        if said is Quantity.OFFSET and other in (Quantity.THETA, Quantity.VARIABLE, Quantity.D):
            return (Quantity.D if other is Quantity.D else Quantity.OFFSET), index
        if said is Quantity.A and other is Quantity.R:
            return Quantity.A, index
        return None, None
    return None, None


def _symbol(name: str) -> tuple[Quantity | None, int | None]:
    words = " ".join(name.replace("_", " ").replace(".", " ").split())
    if words in KNOWN:
        return KNOWN[words], None
    if name in ("", "i", "j", "k", "n"):
        return Quantity.JOINT, None
    if (found := _INDEXED.fullmatch(name)) and (quantity := KNOWN.get(found[1].replace("_", " ").strip())):
        return quantity, -1 if found[3] else 0
    return None, None
