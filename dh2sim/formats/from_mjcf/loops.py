"""What ties an MJCF's bodies together besides joints: constraints and tendons; no table has such."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final

from dh2sim.errors import ImportedFileError, Problem
from dh2sim.formats.from_mjcf.chain import Selection, names_of
from dh2sim.formats.from_mjcf.files import MjcfFiles
from dh2sim.formats.from_mjcf.tree import MjcfJoint, MjcfTree
from dh2sim.formats.notes import Notes
from dh2sim.formats.xml_tree import place
from dh2sim.robot.words import shown

if TYPE_CHECKING:
    import mujoco

_ADVICE: Final = "no table has such. Choose --base or --tip so that the arm does without, or remove it"


def check_loops(model: mujoco.MjModel, tree: MjcfTree, selection: Selection, files: MjcfFiles, notes: Notes) -> None:
    """Check that the joints between base and tip move as if nothing else tied the bodies together.

    A constraint between two bodies closes a loop through the joints between them; if none of these is on the arm,
    the arm moves freely. A mocap body, which somebody leads by the hand, closes no loop.

    Args:
        model: The compiled model.
        tree: Its bodies.
        selection: The arm.
        files: For messages.
        notes: Takes the constraints and tendons that do no harm.

    Raises:
        ImportedFileError: A constraint that is active ties joints of the arm; the error holds all that do.
    """
    loops = _Loops(model, tree, selection)
    problems: list[Problem] = []
    for i in range(model.neq):
        if not loops.is_active(i):
            notes.group("Constraints that are not active are left out: {}.", loops.name(i), loops.kind(i))
        elif (reason := loops.reason(i)) is None:
            notes.group("Constraints that do not tie the arm are left out: {}.", loops.name(i), loops.kind(i))
        else:
            given = model.equality(i).name
            path = place("equality", given) if given else "equality"
            element = (loops.kind(i), given) if given else None
            problems.append(files.problem(f"{reason}; {_ADVICE}", path=path, element=element))
    if problems:
        raise ImportedFileError(dict.fromkeys(problems))
    for i in range(model.ntendon):
        notes.group("Tendons are not carried over: {}.", model.tendon(i).name or f"tendon {i + 1}")


class _Loops:
    def __init__(self, model: mujoco.MjModel, tree: MjcfTree, selection: Selection) -> None:
        import mujoco

        self._model = model
        self._tree = tree
        self._arm = {joint.id: joint for joint in selection.joints}
        self._kinds = {
            int(kind): str(name).removeprefix("mjEQ_").lower() for name, kind in mujoco.mjtEq.__members__.items()
        }
        self._off = bool(int(model.opt.disableflags) & int(mujoco.mjtDisableBit.mjDSBL_EQUALITY))
        self._mujoco = mujoco

    def kind(self, i: int) -> str:
        """The tag of a constraint."""
        return self._kinds[int(self._model.eq_type[i])]

    def is_active(self, i: int) -> bool:
        return bool(self._model.eq_active0[i]) and not self._off

    def name(self, i: int) -> str:
        return self._model.equality(i).name or f"constraint {i + 1}"

    def reason(self, i: int) -> str | None:
        """Return how a constraint ties the arm, or None."""
        first, second = int(self._model.eq_obj1id[i]), int(self._model.eq_obj2id[i])
        match self.kind(i):
            case "joint":
                return self._coupled(first, second)
            case "tendon":
                tied = [*self._of_tendon(first), *(self._of_tendon(second) if second >= 0 else [])]
                return f"a tendon ties joints of the arm: {names_of(tied)}" if tied else None
            case "connect" | "weld":
                return self._closed(*(self._body(i, end) for end in (first, second)))
            case _:  # of soft bodies
                return None

    def _coupled(self, first: int, second: int) -> str | None:
        """Joint ``first`` follows ``second``, or stands still; it may follow a joint of the arm without being one."""
        if first not in self._arm:
            return None
        one = shown(self._model.joint(first).name)
        if second < 0:
            return f"joint {one} of the arm is held still"
        return f"joint {one} of the arm follows joint {shown(self._model.joint(second).name)}"

    def _body(self, i: int, end: int) -> int:
        is_site = int(self._model.eq_objtype[i]) == int(self._mujoco.mjtObj.mjOBJ_SITE)
        return int(self._model.site_bodyid[end]) if is_site else end

    def _closed(self, one: int, other: int) -> str | None:
        bodies = self._tree.bodies
        if bodies[one].mocap or bodies[other].mocap:
            return None
        tied = [joint for joint in self._between(one, other) if joint.id in self._arm]
        if not tied:
            return None
        return (
            f"{bodies[one].label} and {bodies[other].label} are held together, "
            f"which closes a loop through joints of the arm: {names_of(tied)}"
        )

    def _between(self, one: int, other: int) -> list[MjcfJoint]:
        """The joints on the way from one body to another."""
        up, down = (set(self._tree.way(0, body) or ()) for body in (one, other))
        return self._tree.joints_of(sorted(up ^ down))

    def _of_tendon(self, tendon: int) -> list[MjcfJoint]:
        """The joints of the arm that a tendon may pull at."""
        model, kinds = self._model, self._mujoco.mjtWrap
        found: dict[int, None] = {}
        bodies: list[int] = []
        start = int(model.tendon_adr[tendon])
        for k in range(start, start + int(model.tendon_num[tendon])):
            kind, number = int(model.wrap_type[k]), int(model.wrap_objid[k])
            if kind == int(kinds.mjWRAP_JOINT):
                found[number] = None
            elif kind == int(kinds.mjWRAP_SITE):
                bodies.append(int(model.site_bodyid[number]))
            elif kind in (int(kinds.mjWRAP_SPHERE), int(kinds.mjWRAP_CYLINDER)):
                bodies.append(int(model.geom_bodyid[number]))
        for one, other in itertools.pairwise(bodies):
            found.update(dict.fromkeys(joint.id for joint in self._between(one, other)))
        return [self._arm[number] for number in found if number in self._arm]
