"""Numbers, poses and axes of a URDF, read strictly: what is wrong is reported, and a harmless value comes back."""

from __future__ import annotations

import math
import re
from typing import Final

from dh2sim.formats.serial_robot import GREATEST
from dh2sim.formats.xml_tree import Element, XmlReport
from dh2sim.kinematics.transforms import identity, pose_from_rpy
from dh2sim.robot.words import listed, shown
from dh2sim.typing import Array, read_only

_BLANK: Final = re.compile(r"[ \t\r\n]+")
_NUMBER: Final = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_INFINITE: Final = re.compile(r"[+-]?inf(inity)?", re.IGNORECASE)


def read_number(element: Element, attribute: str, path: str, report: XmlReport) -> float:
    """Return the number of an attribute; NaN where it is wrong or missing."""
    text = element.attributes.get(attribute)
    if text is None:
        report.add(element, path, f"<{element.tag}> has no attribute '{attribute}'")
        return math.nan
    value = _number(text.strip(" \t\r\n"))
    if math.isnan(value):
        report.add(element, f"{path}.{attribute}", _wrong("a number", text))
    return value


def read_bound(element: Element, attribute: str, path: str, report: XmlReport) -> float | None:
    """Return a limit, which may be infinite; None where it is missing or wrong."""
    text = element.attributes.get(attribute)
    if text is None:
        return None
    bare = text.strip(" \t\r\n")
    if _INFINITE.fullmatch(bare):
        return -math.inf if bare.startswith("-") else math.inf
    value = read_number(element, attribute, path, report)
    return None if math.isnan(value) else value


def read_numbers(
    element: Element, attribute: str, path: str, report: XmlReport, *, count: int, default: tuple[float, ...]
) -> tuple[float, ...]:
    """Return the numbers of an attribute; ``default`` where it is missing or wrong."""
    text = element.attributes.get(attribute)
    if text is None:
        return default
    words = [word for word in _BLANK.split(text) if word]
    values = tuple(map(_number, words)) if len(words) == count else ()
    if values and not any(map(math.isnan, values)):
        return values
    report.add(element, f"{path}.{attribute}", _wrong(f"{count} numbers", text))
    return default


def read_pose(owner: Element, path: str, report: XmlReport) -> Array:
    """Return the pose that an element's ``<origin>`` gives, shape (4, 4); the identity where there is none.

    Raises nothing: an attribute that is not known is a problem, because the pose would silently be another one.
    """
    origin = read_only_child(owner, "origin", path, report)
    if origin is None:
        return identity()
    path = f"{path}.origin"
    check_attributes(origin, ("xyz", "rpy"), path, report)
    zero = (0.0, 0.0, 0.0)
    xyz = read_numbers(origin, "xyz", path, report, count=3, default=zero)
    rpy = read_numbers(origin, "rpy", path, report, count=3, default=zero)
    return pose_from_rpy(xyz, rpy)


def read_axis(joint: Element, path: str, report: XmlReport) -> tuple[Array, float]:
    """Return a joint's axis as a unit vector, shape (3,), and the length that it has in the file."""
    along_x = (1.0, 0.0, 0.0)
    element = read_only_child(joint, "axis", path, report)
    if element is None:
        return read_only(along_x), 1.0
    path = f"{path}.axis"
    check_attributes(element, ("xyz",), path, report)
    axis = read_numbers(element, "xyz", path, report, count=3, default=along_x)
    greatest = max(map(abs, axis))
    if greatest == 0.0:
        report.add(
            element, f"{path}.xyz", f"the axis of a joint that moves cannot be {shown(element.attributes['xyz'])}"
        )
        return read_only(along_x), 1.0
    if math.hypot(*axis) == 1.0:
        return read_only([value + 0.0 for value in axis]), 1.0
    scaled = [value / greatest for value in axis]  # so that no square is lost below the smallest double
    length = math.hypot(*scaled)
    return read_only([value / length + 0.0 for value in scaled]), length * greatest


def read_only_child(owner: Element, tag: str, path: str, report: XmlReport) -> Element | None:
    """Return the one child of a tag, or None; a second is a problem, for readers differ on which one counts."""
    found = owner.all(tag)
    if len(found) > 1:
        report.add(found[1], f"{path}.{tag}", f"a second <{tag}>; the first is on line {found[0].line}")
    return found[0] if found else None


def check_attributes(element: Element, allowed: tuple[str, ...], path: str, report: XmlReport) -> None:
    """Complain of every attribute that is not known."""
    for name in element.attributes:
        if name not in allowed:
            hint = report.guess(name, allowed)
            report.add(element, path, f"unknown attribute {shown(name)}.{hint} Allowed: {listed(allowed)}")


def _number(text: str) -> float:
    """The number that a word stands for, or NaN."""
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    return value if abs(value) <= GREATEST else math.nan


def _wrong(expected: str, text: str) -> str:
    """Say what was found in place of numbers."""
    if any(abs(_plain(word)) > GREATEST for word in text.split()):
        return f"expected {expected} no greater than {GREATEST:g}, found {shown(text)}"
    comma = "; decimals are set off with a point" if re.search(r"[0-9],[0-9]", text) else ""
    return f"expected {expected}, found {shown(text)}{comma}"


def _plain(word: str) -> float:
    return float(word) if _NUMBER.fullmatch(word) else 0.0
