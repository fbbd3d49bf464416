"""An MJCF compiled by MuJoCo itself, also where meshes and other files that only show the robot are missing."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from dh2sim.errors import ImportedFileError, Problem
from dh2sim.formats.from_mjcf.assets import Assets, MeshFile, drop_files, drop_pictures, find_assets, mesh_files
from dh2sim.formats.from_mjcf.files import MjcfFiles
from dh2sim.formats.notes import Notes

if TYPE_CHECKING:
    import mujoco

_LINE: Final = re.compile(r",? *\b(?:line|line number) ?=? ?(\d+)", re.IGNORECASE)
_NOISE: Final = re.compile(r"^(?:XML Error: |Error: |ParseXML: )+|Error=XML_\w+ ErrorID=\d+ \(0x[0-9a-f]+\)", re.I)
_ELEMENT: Final = re.compile(r"^element (?:name )?('.*?')(?:, id \d+)?$", re.IGNORECASE)
_USERS: Final = ("body", "jnt", "geom", "site", "cam", "tendon", "actuator", "sensor")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Compiled:
    """A compiled model, and what MuJoCo does not keep in it."""

    model: mujoco.MjModel = field(repr=False)
    name: str
    """Of the model; empty where the file gives none."""
    mesh_files: Mapping[int, MeshFile]
    """By the number of the mesh."""
    lost_geoms: Mapping[int, str]
    """Geoms whose file was not used, by number, with the file's name; a ball stands for each."""
    meshes_refused: bool
    """Whether MuJoCo could not use files that are there, so that none was used."""
    unknown_masses: frozenset[int]
    """Bodies whose mass would come from such geoms."""
    unknown_damping: frozenset[int]
    """Joints whose damping and stiffness MuJoCo computes from masses, where masses are not known."""
    unknown_kv: frozenset[int]
    """Actuators, likewise."""
    keyframes: tuple[str, ...]


def compile_mjcf(files: MjcfFiles, notes: Notes) -> Compiled:
    """Let MuJoCo read and compile a model.

    Textures, skins and keyframes are left out. Meshes and height fields whose files are missing are too; where
    MuJoCo cannot use a file that is there, all are.

    Args:
        files: The model's files, looked through.
        notes: Takes MuJoCo's warnings.

    Raises:
        ImportedFileError: MuJoCo refuses the model.
    """
    with _warnings_noted(notes):
        spec = _parsed(files)
        assets = find_assets(spec, files)
        try:
            return _compiled(spec, assets, all_files=False)
        except Exception as error:  # MuJoCo's bindings raise a handful of types
            reason = error
        if not assets.has_files:
            raise _refused(files, reason) from None
        try:
            compiled = _compiled(_parsed(files), assets, all_files=True)
        except Exception:
            raise _refused(files, reason) from None
        notes.add(f"MuJoCo cannot use the model's meshes, so that none was used: {_told(reason)[0]}.")
        return compiled


def _parsed(files: MjcfFiles) -> Any:
    import mujoco

    try:
        spec = mujoco.MjSpec.from_file(str(files.path))
    except Exception as error:
        raise _refused(files, error) from None
    spec.compiler.fusestatic = False
    spec.compiler.discardvisual = False
    # what only costs memory or time
    spec.compiler.LRopt.mode = mujoco.mjtLRMode.mjLRMODE_NONE
    spec.memory = spec.nstack = spec.njmax = spec.nconmax = -1
    spec.nuserdata = 0
    for user in _USERS:
        setattr(spec, f"nuser_{user}", -1)
    return spec


def _compiled(spec: Any, assets: Assets, *, all_files: bool) -> Compiled:
    keyframes = tuple(key.name for key in spec.keys)
    drop_pictures(spec)
    lost = drop_files(spec, assets, all_files=all_files)
    springs = [joint for joint in spec.joints if min(joint.springdamper) > 0.0] if lost.masses else []
    # a damping ratio stands in place of a negative gain
    servos = [servo for servo in spec.actuators if servo.biasprm[2] > 0.0] if lost.masses else []
    model = spec.compile()
    return Compiled(
        model=model,
        name="" if spec.modelname == "MuJoCo Model" else spec.modelname,
        mesh_files=mesh_files(spec, assets),
        lost_geoms={geom.id: uri for geom, uri in lost.geoms},
        meshes_refused=all_files,
        unknown_masses=frozenset(body.id for body in lost.masses),
        unknown_damping=frozenset(joint.id for joint in springs),
        unknown_kv=frozenset(servo.id for servo in servos),
        keyframes=keyframes,
    )


def _refused(files: MjcfFiles, error: Exception) -> ImportedFileError:
    """MuJoCo's complaint, with its line where that is one of the file itself; what is included has line 0."""
    message, line = _told(error)
    if line and files.models > 1:
        message, line = f"{message} (line {line}, of this model or of one that it attaches)", 0
    problem = Problem(
        file=files.file, line=max(line, 1), column=1, path="", message=f"MuJoCo refuses the file: {message}"
    )
    return ImportedFileError([problem])


def _told(error: Exception) -> tuple[str, int]:
    """MuJoCo's words in one line, and the line that they name or 0."""
    text = str(error)
    found = _LINE.search(text)
    parts = [" ".join(_NOISE.sub("", _LINE.sub("", part)).split()) for part in text.splitlines()]
    parts = [_ELEMENT.sub(r"(element \1)", part.rstrip(":;,. ")) for part in parts if part]
    words = "; ".join(parts).replace("; (element ", " (element ") or type(error).__name__
    return words, int(found.group(1)) if found else 0


@contextmanager
def _warnings_noted(notes: Notes) -> Iterator[None]:
    """Make notes of MuJoCo's warnings, which it would print, or append to a file in the current folder."""
    import mujoco

    before = mujoco.get_mju_user_warning()
    told: list[str] = []
    mujoco.set_mju_user_warning(told.append)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            yield
        told += [str(warning.message) for warning in caught]
    finally:
        mujoco.set_mju_user_warning(before)
    for text in dict.fromkeys(told):
        notes.add(f"MuJoCo warns: {' '.join(text.split()).rstrip('.')}.")
