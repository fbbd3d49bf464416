"""MJCF file -> SerialRobot: the arm of a model that somebody else described; MuJoCo itself reads the file."""

from __future__ import annotations

from pathlib import Path

from dh2sim.formats.from_mjcf.actuators import read_drives
from dh2sim.formats.from_mjcf.chain import Selection, select_chain
from dh2sim.formats.from_mjcf.compile import Compiled, compile_mjcf
from dh2sim.formats.from_mjcf.files import MjcfFiles, look_through
from dh2sim.formats.from_mjcf.joints import check_joints, joint_names, note_solver, read_joints
from dh2sim.formats.from_mjcf.leftovers import note_leftovers
from dh2sim.formats.from_mjcf.looks import read_look
from dh2sim.formats.from_mjcf.loops import check_loops
from dh2sim.formats.from_mjcf.masses import read_mass
from dh2sim.formats.from_mjcf.tree import WORLD, MjcfBody, MjcfTree, tree_of
from dh2sim.formats.notes import Notes
from dh2sim.formats.serial_robot import GREATEST, SerialLink, SerialRobot
from dh2sim.robot.words import shown
from dh2sim.typing import Array, read_only


def read_mjcf(path: Path, *, file: str, base: str | None = None, tip: str | None = None) -> SerialRobot:
    """Return the serial arm that an MJCF describes.

    MuJoCo parses and compiles the file, after its text and those that it includes were looked through: defaults,
    angles, frames and repetitions are its business. Bodies without a joint are merged: poses are multiplied, and
    masses are combined into the body that carries them. Link frames are the bodies' frames, coordinates count as in
    the file's ``qpos``.

    Args:
        path: The file. Files that it includes must be in its folder or below; meshes and textures may be missing.
        file: Its name, for messages.
        base: Name of the body that the arm begins at, or ``world``. By default the topmost body above the arm,
            where that has no joint or floats; else the world.
        tip: Name of the site or else the body that it ends at. By default the site ``tool0``, or the only one of
            ``attachment_site``, ``ee_site``, ``end_effector`` and ``tcp``; else where the only way with joints ends,
            or at a hand: a fork behind three joints or more, into branches of fewer joints.

    Raises:
        ImportedFileError: The file is refused, by MuJoCo or before, or it holds no such arm.
        Dh2simError: The file, or one that it includes, cannot be read.
    """
    notes = Notes()
    files = look_through(path, file=file)
    compiled = compile_mjcf(files, notes)
    tree = tree_of(compiled.model)
    selection = select_chain(tree, base, tip, files, notes)
    check_joints(tree, selection, files)
    check_loops(compiled.model, tree, selection, files, notes)
    names = joint_names(selection, notes)
    drives = read_drives(compiled, selection, names, notes)
    joints = read_joints(compiled, selection, names, drives, notes)
    note_solver(compiled, selection.joints, names, notes)
    links = _links(compiled, tree, selection, names, notes)
    gravity = _gravity(compiled, tree, selection, files, notes)
    note_leftovers(compiled, tree, selection, notes)
    return SerialRobot(
        name=compiled.name or Path(file).name.partition(".")[0],
        description=f"MJCF {Path(file).name}, from {_plain(links[0].name)} to {_plain(_tip(selection, links))}",
        chain=joints.chain,
        base=links[0],
        links=links[1:],
        limits=joints.limits,
        dynamics=joints.dynamics,
        actuators=tuple(drive.actuator for drive in drives) if compiled.model.nactuator else None,
        gravity=gravity,
        notes=notes.sentences(),
    )


def _links(
    compiled: Compiled, tree: MjcfTree, selection: Selection, names: tuple[str, ...], notes: Notes
) -> tuple[SerialLink, ...]:
    """Return the base and a link for every joint: the body for its last joint, one without mass for those before."""
    # nobody uses the base's mass, so that nothing is said of it
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
    weight = read_mass(compiled, tree, body, name, mass_notes)
    look = read_look(compiled, tree, body, name, notes)
    return SerialLink(
        name=name, mass=weight.mass, com=weight.com, inertia=weight.inertia, mesh=look.mesh, color=look.color
    )


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
        words = ", ".join(f"{value:.6g}" for value in gravity)
        notes.add(f"Gravity is ({words}) m/s² in the base {base.label}, as that stands in the world.")
    return read_only(gravity)


def _tip(selection: Selection, links: tuple[SerialLink, ...]) -> str:
    if selection.site is not None and selection.site.name:
        return selection.site.name
    return selection.tip.name or links[-1].name


def _plain(name: str) -> str:
    """A name as it is, if that is fit for a line of text."""
    return name if name.isprintable() and len(name) <= 60 else shown(name)
