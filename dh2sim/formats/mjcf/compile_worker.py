"""Compiles an MJCF with MuJoCo, in a process of its own, even if files that only show the robot are missing.

Missing meshes, height fields and pictures are removed from MuJoCo's ``MjSpec``, the model before it is compiled. What
MuJoCo does not keep in the compiled model is returned beside it.
"""

from __future__ import annotations

import json
import math
import os
import stat
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import mujoco
import numpy as np

from dh2sim.formats.mesh_paths import is_inside
from dh2sim.formats.mjcf.includes import MAX_POINTS

MAX_ASSET_BYTES: Final = 100_000_000
"""Of a mesh or a height field; a larger file counts as missing."""
_BALL: Final = 0.01
"""Radius of the ball that replaces a geom without its mesh, m."""
_USERS: Final = ("body", "jnt", "geom", "site", "cam", "tendon", "actuator", "sensor")
_NO_MEMORY: Final = ("could not allocate", "bad_alloc", "out of memory", "unknown exception")
"""In messages of MuJoCo, which calls an allocation that fails an unknown exception."""


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
    outside: tuple[str, ...]
    """Names of files that exist where they may not be used."""

    @property
    def has_files(self) -> bool:
        """Whether a file was found for anything."""
        return any((*self.meshes.values(), *self.fields.values()))


def find_assets(spec: Any, folders: Sequence[Path], allowed: Sequence[Path]) -> Assets:
    """Look for the files that a model's meshes and height fields come from.

    Args:
        spec: The model, not compiled yet.
        folders: Of the models that it is made of.
        allowed: Folders, without links, in and below which files are used.
    """
    outside: dict[str, None] = {}

    def found(asset: Any) -> Path | None:
        """Return the file of an asset; MuJoCo does not say which of several attached models names it."""
        name = asset.file.replace("\\", "/")
        if spec.strippath:
            name = name.rpartition("/")[2]
        for folder in folders:
            path = folder / asset.compiler.meshdir.replace("\\", "/") / name
            if not _can_be_read(path):
                continue
            if is_inside(path, allowed):
                return Path(os.path.normpath(path))
            outside.setdefault(asset.file)
        return None

    return Assets(
        meshes={mesh.name: found(mesh) for mesh in spec.meshes if mesh.file},
        fields={field.name: found(field) for field in spec.hfields if field.file},
        outside=tuple(outside),
    )


def _can_be_read(path: Path) -> bool:
    """Whether there is a file of moderate size."""
    try:
        status = path.stat()
        return stat.S_ISREG(status.st_mode) and status.st_size <= MAX_ASSET_BYTES and _pixels(path) <= MAX_POINTS
    except (OSError, ValueError):  # ValueError: a name that no file can have
        return False


def _pixels(path: Path) -> int:
    """Return the number of pixels of a PNG file, 0 for other files."""
    if path.suffix.lower() != ".png":
        return 0
    with path.open("rb") as stream:
        head = stream.read(24)
    return int.from_bytes(head[16:20]) * int.from_bytes(head[20:24])


def _mesh_files(spec: Any, assets: Assets) -> dict[int, dict[str, Any]]:
    """Return the meshes of a compiled model that come from files, by number."""
    files = {}
    for mesh in spec.meshes:
        path = assets.meshes.get(mesh.name) if mesh.file else None
        if path is not None:
            vectors = {name: getattr(mesh, name).tolist() for name in ("scale", "refpos", "refquat")}
            files[mesh.id] = {"uri": mesh.file, "path": str(path), **vectors}
    return files


def drop_pictures(spec: Any) -> None:
    """Remove textures, skins and what keyframes hold: an arm does not need them, and their files may be missing."""
    for texture in list(spec.textures):
        spec.delete(texture)
    for material in spec.materials:
        material.textures = [""] * len(material.textures)
    for skin in list(spec.skins):
        spec.delete(skin)
    for key in spec.keys:  # which takes MuJoCo no time, as deleting them would
        for what in ("qpos", "qvel", "act", "ctrl", "mpos", "mquat"):
            setattr(key, what, [])
    spec.nkey = 0


def drop_files(spec: Any, assets: Assets, *, all_files: bool) -> MissingParts:
    """Remove the meshes and height fields whose files are missing; a ball replaces each of their geoms.

    A geom that would give its body mass becomes a ball of 1 kg, so that MuJoCo accepts the body.

    Args:
        spec: The model, not compiled yet.
        assets: Its files.
        all_files: Whether to remove those whose files exist, too.
    """
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
    if body.explicitinertial and body.compiler.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        return False
    first, last = body.compiler.inertiagrouprange
    weightless = geom.density == 0.0 if math.isnan(geom.mass) else geom.mass == 0.0
    return bool(first <= geom.group <= last and not weightless)


def answer(request: bytes) -> bytes:
    """Compile an MJCF; the model comes after a line of JSON that says what MuJoCo does not keep in it.

    The request names a file (``path``, ``folders`` from which its meshes are looked for, and those in which they are
    ``allowed``). Or it has the ``text`` of one and the texts of those that it includes (``included``, by name), or it
    names a ``file``; these are compiled as they are.

    Raises:
        MemoryError: MuJoCo needs too much.
    """
    asked = json.loads(request)
    messages: list[str] = []
    mujoco.set_mju_user_warning(messages.append)
    model, facts = None, dict[str, Any]()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            if "text" in asked:
                included = {name: text.encode() for name, text in asked["included"].items()}
                model = mujoco.MjModel.from_xml_string(asked["text"], included)
            elif "file" in asked:
                model = mujoco.MjModel.from_xml_path(asked["file"])
            else:
                model, facts = _compiled_anyhow(
                    asked["path"],
                    [Path(folder) for folder in asked["folders"]],
                    [Path(folder) for folder in asked["allowed"]],
                )
        except Exception as error:  # MuJoCo's bindings raise a handful of types
            facts = {"refused": _text(error)}
    facts["warnings"] = messages + [str(warning.message) for warning in caught]
    head = json.dumps(facts).encode() + b"\n"
    return head if model is None else head + _saved(model)


def _text(error: Exception) -> str:
    """Return MuJoCo's message; an error by lack of memory goes on as such."""
    text = str(error)
    if isinstance(error, MemoryError) or any(sign in text.lower() for sign in _NO_MEMORY):
        raise MemoryError from error
    return text or type(error).__name__


def _compiled_anyhow(path: str, folders: Sequence[Path], allowed: Sequence[Path]) -> tuple[Any, dict[str, Any]]:
    """Compile a model, without its files of meshes where MuJoCo cannot use one of them."""
    spec = _parsed(path)
    assets = find_assets(spec, folders, allowed)
    try:
        return _compiled(spec, assets, all_files=False)
    except Exception as error:
        reason = error
    text = _text(reason)
    if not assets.has_files:
        raise reason
    try:
        model, facts = _compiled(_parsed(path), assets, all_files=True)
    except Exception:
        raise reason from None
    return model, {**facts, "meshes_refused": text}


def _parsed(path: str) -> Any:
    spec = mujoco.MjSpec.from_file(path)
    spec.compiler.fusestatic = False
    spec.compiler.discardvisual = False
    # settings that only cost memory or time
    spec.compiler.LRopt.mode = mujoco.mjtLRMode.mjLRMODE_NONE
    spec.memory = spec.nstack = spec.njmax = spec.nconmax = -1
    spec.nuserdata = 0
    for user in _USERS:
        setattr(spec, f"nuser_{user}", -1)
    return spec


def _compiled(spec: Any, assets: Assets, *, all_files: bool) -> tuple[Any, dict[str, Any]]:
    keyframes = [key.name for key in spec.keys]
    drop_pictures(spec)
    lost = drop_files(spec, assets, all_files=all_files)
    springs = [joint for joint in spec.joints if min(joint.springdamper) > 0.0] if lost.masses else []
    # a positive number in place of the negative gain is a damping ratio
    servos = [servo for servo in spec.actuators if servo.biasprm[2] > 0.0] if lost.masses else []
    model = spec.compile()
    return model, {
        "name": "" if spec.modelname == "MuJoCo Model" else spec.modelname,
        "mesh_files": _mesh_files(spec, assets),
        "lost_geoms": {geom.id: uri for geom, uri in lost.geoms},
        "outside": assets.outside,
        "meshes_refused": None,
        "unknown_masses": [body.id for body in lost.masses],
        "unknown_damping": [joint.id for joint in springs],
        "unknown_kv": [servo.id for servo in servos],
        "keyframes": keyframes,
    }


def _saved(model: Any) -> bytes:
    """Return a model in MuJoCo's binary format."""
    mujoco.MjData(model)  # which the caller will make, so that it is within the limits too
    buffer = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()
