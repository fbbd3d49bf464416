"""A URDF's links and joints as a tree, and its numbers, poses and axes, read strictly.

The structure of the whole file is checked, whatever part of it is used. What is wrong with a number is reported, and
a harmless value comes back.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from dh2sim.formats.arm import LinkTree
from dh2sim.formats.serial_robot import GREATEST
from dh2sim.formats.xacro import NO_LINK, is_definition, unexpanded
from dh2sim.formats.xml_read import Element, XmlReport, place
from dh2sim.kinematics.transforms import identity, pose_from_rpy
from dh2sim.messages import closest, listed, shown
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

    An unknown attribute that may hold a part of the pose is a problem: it would silently be another one.
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
    """Return the one child of a tag, or None; a second is a problem, as readers differ on which one counts."""
    found = owner.all(tag)
    if len(found) > 1:
        report.add(found[1], f"{path}.{tag}", f"a second <{tag}>; the first is on line {found[0].line}")
    return found[0] if found else None


def check_attributes(element: Element, allowed: tuple[str, ...], path: str, report: XmlReport) -> None:
    """Complain of an unknown attribute in place of a missing one: a slip of the pen, or numbers in another form.

    Others are meant for other programs, and ignored by every reader.
    """
    missing = tuple(name for name in allowed if name not in element.attributes)
    for name, text in element.attributes.items():
        if name in allowed or not missing:
            continue
        if closest(name, missing) or len(text.split()) >= 3:
            hint = report.guess(name, missing)
            report.add(element, path, f"unknown attribute {shown(name)}.{hint} Allowed: {listed(allowed)}")


def _number(text: str) -> float:
    """Return the number that a word is, or NaN."""
    value = float(text) if _NUMBER.fullmatch(text) else math.nan
    return value if abs(value) <= GREATEST else math.nan


def _wrong(expected: str, text: str) -> str:
    """Return the message on what was found instead of numbers."""
    if any(abs(_plain(word)) > GREATEST for word in text.split()):
        return f"expected {expected} no greater than {GREATEST:g}, found {shown(text)}"
    comma = "; decimals are set off with a point" if re.search(r"[0-9],[0-9]", text) else ""
    return f"expected {expected}, found {shown(text)}{comma}"


def _plain(word: str) -> float:
    return float(word) if _NUMBER.fullmatch(word) else 0.0


DYNAMICS: Final = ("damping", "friction")
"""What a URDF holds of a joint's dynamics, by the names of a robot file."""
JOINT_TYPES: Final = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfJoint:
    """A joint as the file has it."""

    name: str
    type: str
    """One of JOINT_TYPES."""
    parent: str
    """Name of the link that it is on."""
    child: str
    """Name of the link that it carries."""
    element: Element = field(repr=False)

    @property
    def moves(self) -> bool:
        """Whether its child can move on its parent."""
        return self.type != "fixed"

    @property
    def path(self) -> str:
        """The start of the path of a problem."""
        return place("joint", self.name)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfTree:
    """All links and joints of a file: one root, one way to every link."""

    robot: Element = field(repr=False)
    links: LinkTree[str] = field(repr=False)
    """By name."""
    elements: Mapping[str, Element] = field(repr=False)
    """Of the links."""
    above: Mapping[str, UrdfJoint] = field(repr=False)
    """The joint that carries a link; the root has none."""
    below: Mapping[str, tuple[UrdfJoint, ...]] = field(repr=False)
    """The joints on a link, in the order of the file."""


def read_tree(robot: Element, report: XmlReport) -> UrdfTree:
    """Return the tree of a URDF's links and joints.

    Args:
        robot: The root element.
        report: Takes the problems.

    Raises:
        ImportedFileError: The structure is wrong; the error holds everything that is.
    """
    _check_root(robot, report)
    _check_expanded(robot, report)
    report.check()
    links = _links(robot, report)
    joints = _joints(robot, links, report)
    above = _above(joints, report)
    report.check()
    root = _root(links, above, report)
    below: dict[str, list[UrdfJoint]] = {name: [] for name in links}
    for joint in joints:
        below[joint.parent].append(joint)
    tree = LinkTree(
        root=root,
        noun="link",
        names={name: name for name in links},
        parents={name: joint.parent for name, joint in above.items()},
        children={name: tuple(joint.child for joint in on_it) for name, on_it in below.items()},
        moving={name: int(name in above and above[name].moves) for name in links},
        ends_at_frame=True,
    )
    return UrdfTree(
        robot=robot,
        links=tree,
        elements=links,
        above=above,
        below={name: tuple(on_it) for name, on_it in below.items()},
    )


def _check_root(robot: Element, report: XmlReport) -> None:
    if robot.tag == "robot":
        return
    others = {"mujoco": "an MJCF", "sdf": "an SDF", "COLLADA": "a COLLADA file"}
    what = f": this is {others[robot.tag]}, not a URDF" if robot.tag in others else ""
    report.add(robot, "", f"expected <robot>, found <{robot.tag[:60]}>{what}")


def _check_expanded(robot: Element, report: XmlReport) -> None:
    """Complain of the first thing that xacro has not replaced."""
    found = unexpanded(robot)
    if found is not None:
        report.add(found.element, "", f"found {found.what}: this is xacro. Expand it first: xacro FILE > out.urdf")


def _links(robot: Element, report: XmlReport) -> dict[str, Element]:
    links: dict[str, Element] = {}
    for element in robot.all("link"):
        name = _name(element, report)
        if name in links:
            report.add(
                element, place("link", name), f"a second link of this name; the first is on line {links[name].line}"
            )
        elif name:
            links[name] = element
    if not links and not report.problems:
        only_definitions = any(is_definition(element, robot) for element in robot.children)
        report.add(robot, "", NO_LINK if only_definitions else "the file has no <link>")
    return links


def _joints(robot: Element, links: Mapping[str, Element], report: XmlReport) -> list[UrdfJoint]:
    joints: dict[str, UrdfJoint] = {}
    for element in robot.all("joint"):
        name = _name(element, report)
        path = place("joint", name) if name else "joint"
        kind = _joint_type(element, path, report)
        parent, child = (_end(element, tag, path, links, report) for tag in ("parent", "child"))
        if name in joints:
            line = joints[name].element.line
            report.add(element, path, f"a second joint of this name; the first is on line {line}")
        elif name and kind and parent and child:
            joints[name] = UrdfJoint(name=name, type=kind, parent=parent, child=child, element=element)
    return list(joints.values())


def _name(element: Element, report: XmlReport) -> str:
    name = element.attributes.get("name", "")
    if not name:
        report.add(element, element.tag, f"<{element.tag}> has no name")
    return name


def _joint_type(element: Element, path: str, report: XmlReport) -> str:
    kind = element.attributes.get("type")
    if kind in JOINT_TYPES:
        return kind
    if kind is None:
        report.add(element, path, f"<joint> has no type. Allowed: {listed(JOINT_TYPES)}")
    else:
        guess = report.guess(kind, JOINT_TYPES)
        report.add(element, f"{path}.type", f"found {shown(kind)}.{guess} Allowed: {listed(JOINT_TYPES)}")
    return ""


def _end(joint: Element, tag: str, path: str, links: Mapping[str, Element], report: XmlReport) -> str:
    """Return the name of the parent or the child link; empty where it is wrong."""
    element = read_only_child(joint, tag, path, report)
    name = None if element is None else element.attributes.get("link")
    if element is None or name is None:
        missing = f"no <{tag}>" if element is None else f"a <{tag}> without the attribute 'link'"
        report.add(element or joint, path, f"the joint has {missing}")
        return ""
    if name not in links:
        report.add(element, f"{path}.{tag}", f"the file has no link {shown(name)}.{report.guess(name, links)}")
        return ""
    return name


def _above(joints: list[UrdfJoint], report: XmlReport) -> dict[str, UrdfJoint]:
    above: dict[str, UrdfJoint] = {}
    for joint in joints:
        first = above.setdefault(joint.child, joint)
        if first is not joint:
            message = (
                f"link {shown(joint.child)} is the child of joint {shown(first.name)} already "
                f"(line {first.element.line}); a link of a URDF has one parent"
            )
            report.add(joint.element, f"{joint.path}.child", message)
    return above


def _root(links: Mapping[str, Element], above: Mapping[str, UrdfJoint], report: XmlReport) -> str:
    """Return the one link that no joint carries."""
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        names = listed(map(shown, roots))
        report.add(
            links[roots[1]], place("link", roots[1]), f"several links have no parent: {names}; a URDF has one root"
        )
    for loop in _loops(links, above):
        names = listed(shown(joint.name) for joint in loop)
        what = "these joints form a loop" if len(loop) > 1 else "the joint joins a link to itself"
        report.add(loop[0].element, loop[0].path, f"{what}: {names}; a URDF is a tree")
    report.check()
    return roots[0]


def _loops(links: Mapping[str, Element], above: Mapping[str, UrdfJoint]) -> list[list[UrdfJoint]]:
    """Return the joints of every loop; a link has one parent at most, so that loops share nothing."""
    loops = []
    seen: set[str] = set()
    for start in links:
        way: dict[str, UrdfJoint] = {}
        link = start
        while link not in seen and link in above:
            seen.add(link)
            way[link] = above[link]
            link = above[link].parent
        if link in way:
            names = list(way)
            loops.append([way[name] for name in reversed(names[names.index(link) :])])
        seen.add(link)
    return loops
