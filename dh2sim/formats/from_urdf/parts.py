"""What hangs on a link of the arm: the links that are fixed to it, and the branches that move and are left out."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from dh2sim.formats.from_urdf.chain import Selection
from dh2sim.formats.from_urdf.tree import UrdfJoint, UrdfTree
from dh2sim.formats.from_urdf.values import read_number, read_pose
from dh2sim.formats.notes import Notes
from dh2sim.formats.xml_tree import Element, XmlReport, place
from dh2sim.kinematics.transforms import compose, identity
from dh2sim.robot.words import shown
from dh2sim.typing import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Part:
    """A link of the file that is fixed to a link of the arm."""

    name: str
    element: Element = field(repr=False)
    T_link_part: Array = field(repr=False)
    """Its pose in the link of the arm, shape (4, 4)."""
    on_chain: bool
    """Whether the way from base to tip leads over it."""

    @property
    def path(self) -> str:
        """How the path of a problem begins."""
        return place("link", self.name)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """A link of the arm with all that is fixed to it."""

    parts: tuple[Part, ...]
    """The link itself first."""
    branches: tuple[UrdfJoint, ...]
    """Joints on it that move and are not the arm's."""

    @property
    def name(self) -> str:
        """Name of the link of the arm."""
        return self.parts[0].name


def read_bodies(tree: UrdfTree, selection: Selection, report: XmlReport, notes: Notes) -> tuple[Body, ...]:
    """Return the base and the link of every moving joint, in order, with what hangs on them.

    A fixed joint off the arm whose pose cannot be read is noted, and what hangs on it is left out.
    """
    arm = frozenset(joint.name for joint in selection.joints)
    starts = [selection.base, *(joint.child for joint in selection.joints if joint.moves)]
    return tuple(_body(tree, start, arm, report, notes) for start in starts)


def _body(tree: UrdfTree, start: str, arm: frozenset[str], report: XmlReport, notes: Notes) -> Body:
    parts, branches = [], []
    waiting = [Part(name=start, element=tree.links[start], T_link_part=identity(), on_chain=True)]
    while waiting:
        part = waiting.pop()
        parts.append(part)
        fixed = []
        for joint in tree.below[part.name]:
            if joint.moves:
                branches += [] if joint.name in arm else [joint]
                continue
            off = XmlReport(report.file)  # the arm's own joints have been read, with the arm's report
            T = compose(part.T_link_part, read_pose(joint.element, joint.path, off))
            if off.problems and joint.name not in arm:
                sentence = "Joints that cannot be read are left out with all that they carry: {}."
                note_unreadable(off, sentence, joint.name, notes)
                continue
            element, on_chain = tree.links[joint.child], joint.name in arm
            fixed.append(Part(name=joint.child, element=element, T_link_part=T, on_chain=on_chain))
        waiting += reversed(fixed)
    return Body(parts=tuple(parts), branches=tuple(branches))


def note_unreadable(report: XmlReport, sentence: str, name: str, notes: Notes) -> None:
    """Note what is wrong where it does not matter to the arm; the sentence has a ``{}`` for all such names."""
    problem = min(report.problems)
    notes.group(sentence, name, f"line {problem.line}: {problem.message}")


def weight_of(tree: UrdfTree, links: Iterable[str]) -> str:
    """Return words for some links and their mass, such as ``'finger' (0.1 kg)`` or ``3 links (0.4 kg)``."""
    names = list(links)
    mass = sum(_mass(tree.links[name]) for name in names)
    what = f"link {shown(names[0])}" if len(names) == 1 else f"{len(names)} links from {shown(names[0])} on"
    return f"{what} ({mass:.6g} kg)" if mass > 0.0 else what


def _mass(link: Element) -> float:
    """The mass that a link off the arm has, as far as it can be read."""
    inertial = link.first("inertial")
    mass = None if inertial is None else inertial.first("mass")
    value = 0.0 if mass is None else read_number(mass, "value", "", XmlReport(""))
    return value if value > 0.0 else 0.0
