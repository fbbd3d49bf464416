"""MJCF file -> SerialRobot, read by MuJoCo itself; what of the file has no place in a serial arm is noted.

An arm whose bodies are tied together by constraints or tendons, besides its joints, is refused.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from dh2sim.errors import ImportedFileError, Problem
from dh2sim.formats.arm import described, note_gravity, note_left_out
from dh2sim.formats.mjcf.chain import Selection, names_of, select_chain
from dh2sim.formats.mjcf.compile import Compiled, compile_mjcf
from dh2sim.formats.mjcf.includes import MjcfFiles, scan_files
from dh2sim.formats.mjcf.joints import check_joints, joint_names, note_solver, read_drives, read_joints
from dh2sim.formats.mjcf.links import read_inertial, read_look, weight_of
from dh2sim.formats.mjcf.mechanics import mjcf_mechanics
from dh2sim.formats.mjcf.tree import WORLD, MjcfBody, MjcfJoint, MjcfTree, read_tree
from dh2sim.formats.serial_robot import GREATEST, SerialLink, SerialRobot
from dh2sim.formats.xml_read import place
from dh2sim.messages import Notes, listed, shown
from dh2sim.typing import Array, read_only

if TYPE_CHECKING:
    import mujoco

_ADVICE: Final = "no table can say that. Choose a base or tip that leaves it out, or remove it"


def _check_constraints(
    model: mujoco.MjModel, tree: MjcfTree, selection: Selection, files: MjcfFiles, notes: Notes
) -> None:
    """Check that the joints between base and tip move as if nothing else tied the bodies together.

    A constraint between two bodies closes a loop through the joints between them; if none of these is on the arm,
    the arm moves freely. A mocap body, which is moved from outside, closes no loop.

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
        """Return how joint ``first`` is coupled to ``second``, or held still, if it is one of the arm."""
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
        """Return the joints between two bodies."""
        up, down = (set(self._tree.links.way(WORLD, body) or ()) for body in (one, other))
        return self._tree.joints_of(sorted(up ^ down))

    def _of_tendon(self, tendon: int) -> list[MjcfJoint]:
        """Return the joints of the arm that a tendon may act on."""
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


def _note_unused(compiled: Compiled, tree: MjcfTree, selection: Selection, notes: Notes) -> None:
    """Note what is merged, what is not on the arm, and what a robot file has no place for."""
    starts = [selection.base, *(body for body in selection.bodies if body.joints)]
    for body in starts:
        merged = [tree.bodies[part].label for part in tree.rigid(body.id)[1:]]
        if merged and body.id != WORLD:
            notes.group(
                "Bodies that are fixed to a link of the arm were merged into it: {}.",
                body.name or body.label,
                f"with {listed(merged)}",
            )
    for body in selection.bodies:
        if len(body.joints) > 1:
            sentence = "Bodies with several joints were split; the links between have no mass: {}."
            notes.group(sentence, body.name or body.label, names_of(body.joints))
    _note_branches(compiled, tree, selection, [body.id for body in starts], notes)
    _note_elements(compiled, notes)


def _note_branches(
    compiled: Compiled, tree: MjcfTree, selection: Selection, starts: Sequence[int], notes: Notes
) -> None:
    if others := [body for body in tree.links.not_below(selection.base.id) if body != WORLD]:
        what = weight_of(compiled, tree, others)
        notes.add(f"What is not below the base {selection.base.label} is left out: {what}.")
    arm = {body.id for body in selection.bodies}
    rigid = {part for start in starts for part in tree.rigid(start)}

    def describe(child: int) -> str:
        body = tree.bodies[child]
        how = f"with {names_of(body.joints)}" if body.joints else "as a mocap body"
        return f"{how} on {_on(tree, body.parent)}: {weight_of(compiled, tree, tree.links.below(child))}"

    note_left_out(
        notes,
        [
            partial(describe, child)
            for part in sorted(rigid)
            for child in tree.links.children[part]
            if child not in arm and child not in rigid
        ],
    )


def _on(tree: MjcfTree, body: int) -> str:
    return "the world" if body == WORLD else tree.bodies[body].label


def _note_elements(compiled: Compiled, notes: Notes) -> None:
    """Note what a model holds besides bodies, joints and actuators."""
    model = compiled.model
    if compiled.keyframes:
        names = listed(shown(name) for name in compiled.keyframes if name) if any(compiled.keyframes) else ""
        notes.add(f"Keyframes are not carried over{names and f': {names}'}.")
    counts = {
        "camera": model.ncam,
        "light": model.nlight,
        "sensor": model.nsensor,
        "contact pair": model.npair,
        "contact exclusion": model.nexclude,
        "soft body": model.nflex,
    }
    others = [f"{count} {what if count == 1 else _plural(what)}" for what, count in counts.items() if count]
    if others:
        notes.add(f"Not carried over: {listed(others)}.")
    if model.opt.density or model.opt.viscosity or any(model.opt.wind.tolist()):
        notes.add("The medium around the robot (density, viscosity, wind) is not carried over.")


def _plural(word: str) -> str:
    return f"{word[:-1]}ies" if word.endswith("y") else f"{word}s"


def read_mjcf(
    path: Path, *, file: str, base: str | None = None, tip: str | None = None, root: Path | None = None
) -> SerialRobot:
    """Return the serial arm that an MJCF describes.

    MuJoCo parses and compiles the file, after its text and those that it includes were scanned: it deals with
    defaults, angles, frames and repetitions. Bodies without a joint are merged: poses are multiplied, and
    masses are combined into the body that carries them. Link frames are the bodies' frames, coordinates count as in
    the file's ``qpos``.

    Args:
        path: The file. Meshes and textures may be missing.
        file: Its name, for messages.
        base: Name of the body at which the arm begins, or ``world``. By default the topmost body above the arm,
            where that has no joint or floats; else the world.
        tip: Name of the site or else the body at which it ends. By default the site ``tool0``, or the only one of
            ``attachment_site``, ``ee_site``, ``end_effector`` and ``tcp``; else where the only way with joints ends,
            or at a hand: a fork behind three joints or more, into branches of fewer joints.
        root: Folder that holds all files that are included; by default the file's own.

    Raises:
        ImportedFileError: The file is refused, by MuJoCo or before, or it holds no such arm.
        Dh2simError: The file, or one that it includes, cannot be read.
    """
    notes = Notes()
    files = scan_files(path, file=file, root=root)
    compiled = compile_mjcf(files, notes)
    tree = read_tree(compiled.model)
    selection = select_chain(tree, base, tip, files, notes)
    check_joints(tree, selection, files)
    _check_constraints(compiled.model, tree, selection, files, notes)
    names = joint_names(selection, notes)
    drives = read_drives(compiled, selection, names, notes)
    joints = read_joints(compiled, selection, names, drives, notes)
    note_solver(compiled, selection.joints, names, notes)
    links = _links(compiled, tree, selection, names, notes)
    gravity = _gravity(compiled, tree, selection, files, notes)
    _note_unused(compiled, tree, selection, notes)
    return SerialRobot(
        name=compiled.name or Path(file).name.partition(".")[0],
        description=described("MJCF", file, links[0].name, _tip_name(selection, links)),
        chain=joints.chain,
        base=links[0],
        links=links[1:],
        limits=joints.limits,
        dynamics=joints.dynamics,
        actuators=tuple(drive.actuator for drive in drives) if compiled.model.nactuator else None,
        gravity=gravity,
        mechanics=mjcf_mechanics(compiled, selection),
        notes=notes.sentences(),
    )


def _links(
    compiled: Compiled, tree: MjcfTree, selection: Selection, names: tuple[str, ...], notes: Notes
) -> tuple[SerialLink, ...]:
    """Return the base and a link for every joint: the body for its last joint, one without mass for those before."""
    # a robot file has no mass of the base, so that nothing is noted of it
    links = [_link(compiled, tree, selection.base, selection.base.name or "base", Notes(), notes)]
    for body in selection.bodies:
        if not body.joints:
            continue
        name = body.name or f"link_{len(links) + len(body.joints) - 1}"
        between = names[len(links) - 1 : len(links) + len(body.joints) - 2]
        links += [SerialLink(name=f"{name}_{joint}") for joint in between]
        links.append(_link(compiled, tree, body, name, notes, notes))
    return tuple(links)


def _link(
    compiled: Compiled, tree: MjcfTree, body: MjcfBody, name: str, mass_notes: Notes, notes: Notes
) -> SerialLink:
    inertial = read_inertial(compiled, tree, body, name, mass_notes)
    return SerialLink.of(name, inertial, read_look(compiled, tree, body, name, notes))


def _gravity(compiled: Compiled, tree: MjcfTree, selection: Selection, files: MjcfFiles, notes: Notes) -> Array:
    """Return gravity in the base's frame, with the base as the file draws it."""
    import mujoco

    model, base = compiled.model, selection.base
    world = model.opt.gravity.tolist()
    if int(model.opt.disableflags) & int(mujoco.mjtDisableBit.mjDSBL_GRAVITY):
        notes.add("The file switches gravity off.")
        world = [0.0, 0.0, 0.0]
    columns = tree.drawn_pose(WORLD, base.id)[:3, :3].T.tolist()
    gravity = [sum(a * b for a, b in zip(column, world, strict=True)) + 0.0 for column in columns]
    if not all(abs(value) <= GREATEST for value in gravity):
        raise files.error(
            f"gravity has a number that is not finite, or greater than {GREATEST:g}", path="option.gravity"
        )
    if gravity != world:
        note_gravity(notes, gravity, base.label, "the world")
    return read_only(gravity)


def _tip_name(selection: Selection, links: tuple[SerialLink, ...]) -> str:
    if selection.site is not None and selection.site.name:
        return selection.site.name
    return selection.tip.name or links[-1].name
