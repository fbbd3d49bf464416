"""An MJCF compiled by MuJoCo itself, even if meshes and other files that only show the robot are missing.

Missing meshes, height fields and pictures are removed from MuJoCo's ``MjSpec``, the model before it is compiled.
"""

from __future__ import annotations

import math
import os
import re
import stat
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from dh2sim.errors import ImportedFileError, Problem
from dh2sim.formats.mjcf.includes import MjcfFiles
from dh2sim.messages import Notes

if TYPE_CHECKING:
    import mujoco

MAX_ASSET_BYTES: Final = 500_000_000
"""Of a mesh or a height field; a larger file counts as missing."""
_BALL: Final = 0.01
"""Radius of the ball that replaces a geom without its mesh, m."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeshFile:
    """A mesh of the model that comes from a file."""

    uri: str
    """As the MJCF names it."""
    path: Path
    """The file, absolute; it exists."""
    scale: tuple[float, ...]
    """Along x, y and z."""
    refpos: tuple[float, ...]
    """Taken off the file's positions before they are scaled; x, y, z."""
    refquat: tuple[float, ...]
    """The inverse of this rotation is applied last; (w, x, y, z), of any length."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MissingParts:
    """What a model lacks because files are missing; elements are numbered only once it is compiled."""

    geoms: tuple[tuple[Any, str], ...]
    """Geoms, and the names of their files; a ball replaces each."""
    masses: tuple[Any, ...]
    """Bodies whose mass would come from such geoms."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Assets:
    """The files of a model's meshes and height fields, by name of the asset; None where a file is missing."""

    meshes: dict[str, Path | None] = field(repr=False)
    fields: dict[str, Path | None] = field(repr=False)

    @property
    def has_files(self) -> bool:
        """Whether a file was found for anything."""
        return any((*self.meshes.values(), *self.fields.values()))


def find_assets(spec: Any, files: MjcfFiles) -> Assets:
    """Look for the files that a model's meshes and height fields come from."""
    return Assets(
        meshes={mesh.name: _found(mesh, spec, files) for mesh in spec.meshes if mesh.file},
        fields={field.name: _found(field, spec, files) for field in spec.hfields if field.file},
    )


def _found(asset: Any, spec: Any, files: MjcfFiles) -> Path | None:
    """Return the file of an asset; MuJoCo does not say which of several attached models names it."""
    name = asset.file.replace("\\", "/")
    if spec.strippath:
        name = name.rpartition("/")[2]
    for folder in files.folders:
        path = folder / asset.compiler.meshdir.replace("\\", "/") / name
        try:
            status = path.stat()
        except (OSError, ValueError):  # ValueError: a name that no file can have
            continue
        if stat.S_ISREG(status.st_mode) and status.st_size <= MAX_ASSET_BYTES:
            return Path(os.path.normpath(path))
    return None


def mesh_files(spec: Any, assets: Assets) -> dict[int, MeshFile]:
    """Return the meshes of a compiled model that come from files, by number."""
    files = {}
    for mesh in spec.meshes:
        path = assets.meshes.get(mesh.name) if mesh.file else None
        if path is not None:
            files[mesh.id] = MeshFile(
                uri=mesh.file,
                path=path,
                scale=tuple(mesh.scale.tolist()),
                refpos=tuple(mesh.refpos.tolist()),
                refquat=tuple(mesh.refquat.tolist()),
            )
    return files


def drop_pictures(spec: Any) -> None:
    """Remove textures, skins and keyframes: a serial arm does not need them, and their files may be missing."""
    for texture in list(spec.textures):
        spec.delete(texture)
    for material in spec.materials:
        material.textures = [""] * len(material.textures)
    for left_out in [*spec.skins, *spec.keys]:
        spec.delete(left_out)
    spec.nkey = 0


def drop_files(spec: Any, assets: Assets, *, all_files: bool) -> MissingParts:
    """Remove the meshes and height fields whose files are missing; a ball replaces each of their geoms.

    A geom that would give its body mass becomes a ball of 1 kg, so that MuJoCo accepts the body.

    Args:
        spec: The model, not compiled yet.
        assets: Its files.
        all_files: Whether to remove those whose files exist, too.
    """
    import mujoco

    meshes = {name for name, path in assets.meshes.items() if path is None or all_files}
    fields = {name for name, path in assets.fields.items() if path is None or all_files}
    uris = {mesh.name: mesh.file for mesh in spec.meshes if mesh.name in meshes}
    geoms: list[tuple[Any, str]] = []
    masses: list[Any] = []
    for geom in spec.geoms:
        if geom.meshname not in meshes and geom.hfieldname not in fields:
            continue
        geoms.append((geom, uris.get(geom.meshname, "")))
        body = geom.parent
        gives_mass = _gives_mass(geom, body)
        if gives_mass and not any(body == other for other in masses):
            masses.append(body)
        geom.type = mujoco.mjtGeom.mjGEOM_SPHERE
        geom.meshname = geom.hfieldname = ""
        geom.size = [_BALL, 0.0, 0.0]
        geom.mass = 1.0 if gives_mass else 0.0
    for site in spec.sites:
        if site.meshname in meshes:
            site.type, site.meshname, site.size = mujoco.mjtGeom.mjGEOM_SPHERE, "", [_BALL, 0.0, 0.0]
    _delete(spec, spec.meshes, meshes)
    _delete(spec, spec.hfields, fields)
    if masses and spec.compiler.settotalmass > 0.0:  # all are scaled by the sum
        masses = [body for body in spec.bodies if body.name != "world"]
    return MissingParts(geoms=tuple(geoms), masses=tuple(masses))


def _delete(spec: Any, assets: Iterable[Any], names: set[str]) -> None:
    for asset in list(assets):
        if asset.name in names:
            spec.delete(asset)


def _gives_mass(geom: Any, body: Any) -> bool:
    """Whether MuJoCo would infer some of the body's mass from a geom."""
    import mujoco

    if body.explicitinertial and body.compiler.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        return False
    first, last = body.compiler.inertiagrouprange
    weightless = geom.density == 0.0 if math.isnan(geom.mass) else geom.mass == 0.0
    return bool(first <= geom.group <= last and not weightless)


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
    """Geoms whose file was not used, by number, with the file's name; a ball replaces each."""
    meshes_refused: bool
    """Whether MuJoCo could not use files that exist, so that none was used."""
    unknown_masses: frozenset[int]
    """Bodies whose mass would come from such geoms."""
    unknown_damping: frozenset[int]
    """Joints whose damping and stiffness MuJoCo computes from masses, where masses are unknown."""
    unknown_kv: frozenset[int]
    """Actuators, likewise."""
    keyframes: tuple[str, ...]


def compile_mjcf(files: MjcfFiles, notes: Notes) -> Compiled:
    """Read and compile a model with MuJoCo.

    Textures, skins and keyframes are left out, and so are meshes and height fields whose files are missing; all of
    them are where MuJoCo cannot use a file that exists.

    Args:
        files: The model's files, scanned.
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
        notes.add(f"MuJoCo cannot use the model's meshes, so that none was used: {_mujoco_message(reason)[0]}.")
        return compiled


def _parsed(files: MjcfFiles) -> Any:
    import mujoco

    try:
        spec = mujoco.MjSpec.from_file(str(files.path))
    except Exception as error:
        raise _refused(files, error) from None
    spec.compiler.fusestatic = False
    spec.compiler.discardvisual = False
    # settings that only cost memory or time
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
    # a positive number in place of the negative gain is a damping ratio
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
    """Return MuJoCo's error, with its line where that is one of the file itself; included files have line 0."""
    message, line = _mujoco_message(error)
    if line and files.models > 1:
        message, line = f"{message} (line {line}, of this model or of one that it attaches)", 0
    problem = Problem(
        file=files.file, line=max(line, 1), column=1, path="", message=f"MuJoCo refuses the file: {message}"
    )
    return ImportedFileError([problem])


def _mujoco_message(error: Exception) -> tuple[str, int]:
    """Return MuJoCo's message in one line, and the line that it names or 0."""
    text = str(error)
    found = _LINE.search(text)
    parts = [" ".join(_NOISE.sub("", _LINE.sub("", part)).split()) for part in text.splitlines()]
    parts = [_ELEMENT.sub(r"(element \1)", part.rstrip(":;,. ")) for part in parts if part]
    words = "; ".join(parts).replace("; (element ", " (element ") or type(error).__name__
    return words, int(found.group(1)) if found else 0


@contextmanager
def _warnings_noted(notes: Notes) -> Iterator[None]:
    """Note MuJoCo's warnings, which it would print, or append to a file in the current folder."""
    import mujoco

    before = mujoco.get_mju_user_warning()
    messages: list[str] = []
    mujoco.set_mju_user_warning(messages.append)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            yield
        messages += [str(warning.message) for warning in caught]
    finally:
        mujoco.set_mju_user_warning(before)
    for text in dict.fromkeys(messages):
        notes.add(f"MuJoCo warns: {' '.join(text.split()).rstrip('.')}.")
