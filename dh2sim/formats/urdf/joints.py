"""The joints of a URDF's arm: poses with fixed joints merged, axes, limits and dynamics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from dh2sim.formats.serial_robot import ChainJoints
from dh2sim.formats.urdf.chain import Selection
from dh2sim.formats.urdf.tree import (
    DYNAMICS,
    UrdfJoint,
    read_axis,
    read_bound,
    read_number,
    read_only_child,
    read_pose,
)
from dh2sim.formats.xml_read import Element, XmlReport
from dh2sim.kinematics.serial_chain import SerialChain, SerialJoint
from dh2sim.kinematics.transforms import compose, identity
from dh2sim.messages import Notes, closest, shown
from dh2sim.robot.row import Dynamics, JointType, Limits
from dh2sim.typing import read_only

_LIMITS: Final = ("lower", "upper", "effort", "velocity")
_ATTRIBUTES: Final = {"origin": ("xyz", "rpy"), "axis": ("xyz",), "limit": _LIMITS, "dynamics": DYNAMICS}
"""Of the elements that are read."""
_NEEDED: Final = ("origin", "axis", "limit", "dynamics", "mimic")
"""Elements without which a joint that moves would be another one; of a fixed joint it is the first."""
_ELEMENTS: Final = (*_NEEDED, "parent", "child", "calibration", "safety_controller")
_SLIP: Final = 0.75
"""Likeness of a name to a missing one from which it is taken for a slip of the pen."""
_SLIP_OF_OPTIONAL: Final = 0.85
"""Likewise, where what is missing need not be given."""
_UNIT: Final = 1e-3
"""By which an axis may miss length 1 without a note: files print a few digits."""


def read_joints(selection: Selection, report: XmlReport, notes: Notes) -> ChainJoints:
    """Read the joints between base and tip; every problem goes to the report."""
    T = identity()  # of the current link in the link of the last moving joint
    joints, limits, dynamics = [], [], []
    for joint in selection.joints:
        _check_elements(joint, report)
        _note_foreign(joint, notes)
        T = compose(T, read_pose(joint.element, joint.path, report))
        if not joint.moves:
            continue
        kind = _type(joint, report)
        axis, length = read_axis(joint.element, joint.path, report)
        if abs(length - 1.0) > _UNIT:
            notes.group("Axes that are not of length 1 were made so, of joints {}.", joint.name, f"{length:.6g}")
        joints.append(SerialJoint(name=joint.name, type=kind, T_parent_link=T, axis=axis, point=read_only([0, 0, 0])))
        limits.append(_limits(joint, kind, report, notes))
        dynamics.append(_dynamics(joint, report, notes))
        T = identity()
    return ChainJoints(
        chain=SerialChain(joints=tuple(joints), T_link_tip=T), limits=tuple(limits), dynamics=tuple(dynamics)
    )


def _check_elements(joint: UrdfJoint, report: XmlReport) -> None:
    """Complain of a misspelt element, without which the joint would silently be another one."""
    missing = [tag for tag in (_NEEDED if joint.moves else _NEEDED[:1]) if joint.element.first(tag) is None]
    for element in joint.element.children:
        meant = None if element.tag in _ELEMENTS else closest(element.tag, missing, likeness=_SLIP)
        if meant is not None:
            report.add(element, joint.path, f"unknown element <{element.tag[:60]}>. Did you mean <{meant}>?")


def _check_attributes(
    element: Element, known: Sequence[str], path: str, report: XmlReport, *, likeness: float = _SLIP
) -> None:
    """Complain of an attribute that is misspelt, so that one is missing; others are meant for other programs."""
    missing = [name for name in known if name not in element.attributes]
    for name in element.attributes:
        meant = None if name in _ATTRIBUTES[element.tag] else closest(name, missing, likeness=likeness)
        if meant is not None:
            report.add(element, path, f"unknown attribute {shown(name)}. Did you mean '{meant}'?")


def _note_foreign(joint: UrdfJoint, notes: Notes) -> None:
    """Note attributes of other programs; elements are noted for the whole file."""
    for element in joint.element.children:
        known = _ATTRIBUTES.get(element.tag, ())
        foreign = [name for name in element.attributes if known and name not in known]
        if foreign:
            names = f"<{element.tag} {' '.join(name[:60] for name in foreign)}>"
            notes.group("Attributes that URDF does not have are ignored, of joints {}.", joint.name, names)


def _type(joint: UrdfJoint, report: XmlReport) -> JointType:
    """Return how the joint moves; a joint that cannot be a row of a table is a problem."""
    mimic = joint.element.first("mimic")
    if mimic is not None:
        other = shown(mimic.attributes.get("joint", ""))
        message = f"the joint mimics joint {other}, which no table can; choose a base or tip that leaves it out"
        report.add(mimic, f"{joint.path}.mimic", message)
    if joint.type in ("floating", "planar"):
        message = f"a {joint.type} joint has no row in a table; choose a base or tip that leaves it out"
        report.add(joint.element, f"{joint.path}.type", message)
        return JointType.CONTINUOUS
    return JointType(joint.type)


def _limits(joint: UrdfJoint, kind: JointType, report: XmlReport, notes: Notes) -> Limits:
    path = f"{joint.path}.limit"
    element = read_only_child(joint.element, "limit", joint.path, report)
    if element is None:
        if kind is not JointType.CONTINUOUS:
            notes.group("No position limits are given for joints {}.", joint.name)
        return Limits()
    needed = _LIMITS[2:] if kind is JointType.CONTINUOUS else _LIMITS
    _check_attributes(element, needed, path, report)
    return Limits(
        position=_position(element, joint.name, kind, path, report, notes),
        velocity=_positive(element, "velocity", joint.name, path, report, notes),
        effort=_positive(element, "effort", joint.name, path, report, notes),
    )


def _position(
    limit: Element, name: str, kind: JointType, path: str, report: XmlReport, notes: Notes
) -> tuple[float, float] | None:
    lower, upper = (read_bound(limit, attribute, path, report) for attribute in ("lower", "upper"))
    if kind is JointType.CONTINUOUS:
        if lower or upper:
            notes.group("Position limits of continuous joints are left out: {}.", name, f"{lower}, {upper}")
        return None
    if lower is None and upper is None:
        notes.group("No position limits are given for joints {}.", name)
    elif lower is None or upper is None:
        notes.group("Only one of the position limits is given, so that none is used, for joints {}.", name)
    elif lower >= upper:
        sentence = "The lower position limit is not below the upper one, so that none is used, for joints {}."
        notes.group(sentence, name, f"{lower!r}, {upper!r}")
    elif math.isinf(lower) or math.isinf(upper):
        notes.group(
            "A position limit is infinite, so that none is used, for joints {}.", name, f"{lower!r}, {upper!r}"
        )
    else:
        return lower, upper
    return None


def _positive(limit: Element, attribute: str, name: str, path: str, report: XmlReport, notes: Notes) -> float | None:
    """Return a velocity or effort limit; None where the file gives none, or one that does not limit anything."""
    value = read_bound(limit, attribute, path, report)
    if value is None or value == math.inf:
        return None
    if value <= 0.0:
        notes.group(f"Limits of {attribute} that are not positive are left out, of joints {{}}.", name)
        return None
    return value


def _dynamics(joint: UrdfJoint, report: XmlReport, notes: Notes) -> Dynamics:
    element = read_only_child(joint.element, "dynamics", joint.path, report)
    if element is None:
        return Dynamics()
    _check_attributes(element, DYNAMICS, f"{joint.path}.dynamics", report, likeness=_SLIP_OF_OPTIONAL)
    values = {}
    for attribute in DYNAMICS:
        value = 0.0
        if attribute in element.attributes:
            value = read_number(element, attribute, f"{joint.path}.dynamics", report)
        if value < 0.0:
            notes.group(f"A negative {attribute} was made 0, for joints {{}}.", joint.name, f"{value!r}")
        values[attribute] = value if value > 0.0 else 0.0
    return Dynamics(**values)
