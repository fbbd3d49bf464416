"""An MJCF compiled by MuJoCo itself, in another process (``compile_worker``), whose memory and time are limited."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from dh2sim.errors import ImportedFileError, ModelError, Problem
from dh2sim.formats.mjcf.includes import MjcfFiles
from dh2sim.limited_process import WorkerError, ask_worker, start_worker
from dh2sim.messages import Notes
from dh2sim.mujoco_warnings import warning_sentences

if TYPE_CHECKING:
    import mujoco

_WORKER: Final = "dh2sim.formats.mjcf.compile_worker"
_LINE: Final = re.compile(r",? *\b(?:line|line number) ?=? ?(\d+)", re.IGNORECASE)
_NOISE: Final = re.compile(r"^(?:XML Error: |Error: |ParseXML: )+|Error=XML_\w+ ErrorID=\d+ \(0x[0-9a-f]+\)", re.I)
_ELEMENT: Final = re.compile(r"^element (?:name )?('.*?')(?:, id \d+)?$", re.IGNORECASE)


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

    @classmethod
    def of(cls, found: dict[str, Any]) -> MeshFile:
        """Return a mesh as the worker describes it."""
        vectors = {name: tuple(found[name]) for name in ("scale", "refpos", "refquat")}
        return cls(uri=found["uri"], path=Path(found["path"]), **vectors)


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
    outside: frozenset[str]
    """Names of files that are not in the folders whose meshes are used."""
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
    """Read and compile a model with MuJoCo, in a process of its own.

    Textures, skins and keyframes are left out, and so are meshes and height fields whose files are missing; all of
    them are where MuJoCo cannot use a file that exists.

    Args:
        files: The model's files, scanned.
        notes: Takes MuJoCo's warnings.

    Raises:
        ImportedFileError: MuJoCo refuses the model, or needs too much time or memory for it.
    """
    try:
        facts, model = _compiled(
            path=str(files.path),
            folders=[str(folder) for folder in files.folders],
            allowed=[str(folder) for folder in files.allowed],
        )
    except WorkerError as error:
        raise files.error(f"MuJoCo cannot compile the file: {error}") from None
    for sentence in warning_sentences(facts["warnings"]):
        notes.add(sentence)
    if model is None:
        raise _refused(files, facts["refused"])
    if (reason := facts["meshes_refused"]) is not None:
        notes.add(f"MuJoCo cannot use the model's meshes, so that none was used: {_mujoco_message(reason)[0]}.")
    return Compiled(
        model=model,
        name=facts["name"],
        mesh_files={int(number): MeshFile.of(found) for number, found in facts["mesh_files"].items()},
        lost_geoms={int(number): uri for number, uri in facts["lost_geoms"].items()},
        outside=frozenset(facts["outside"]),
        meshes_refused=reason is not None,
        unknown_masses=frozenset(facts["unknown_masses"]),
        unknown_damping=frozenset(facts["unknown_damping"]),
        unknown_kv=frozenset(facts["unknown_kv"]),
        keyframes=tuple(facts["keyframes"]),
    )


def compile_text(text: str, included: Mapping[str, str]) -> mujoco.MjModel:
    """Compile the text of a model in a process of its own.

    Args:
        text: The model; it names no files but those.
        included: Texts that it includes, by name.

    Raises:
        ModelError: MuJoCo refuses it, or needs too much time or memory for it.
    """
    try:
        facts, model = _compiled(text=text, included=dict(included))
    except WorkerError as error:
        raise ModelError(str(error)) from None
    if model is None:
        raise ModelError(" ".join(facts["refused"].split()))
    return model


def compile_file(path: Path) -> tuple[mujoco.MjModel, list[str]]:
    """Compile a URDF or an MJCF as it is, in a process of its own; return what MuJoCo warned of, too.

    Args:
        path: The file, which names no others that may not be read.

    Raises:
        ModelError: MuJoCo refuses it, or needs too much time or memory for it.
    """
    try:
        facts, model = _compiled(file=str(path.absolute()))
    except WorkerError as error:
        raise ModelError(str(error)) from None
    if model is None:
        raise ModelError(" ".join(facts["refused"].split()))
    return model, facts["warnings"]


def _compiled(**request: Any) -> tuple[dict[str, Any], mujoco.MjModel | None]:
    """Return what the worker says of a model, and the model unless it was refused.

    Raises:
        WorkerError: It needs too much time or memory.
    """
    start_worker(_WORKER)
    import mujoco  # while the process starts

    head, _, binary = ask_worker(_WORKER, json.dumps(request).encode()).partition(b"\n")
    model = mujoco.MjModel.from_binary_path("model.mjb", {"model.mjb": binary}) if binary else None
    return json.loads(head), model


def _refused(files: MjcfFiles, text: str) -> ImportedFileError:
    """Return MuJoCo's error, with its line where that is one of the file itself; included files have line 0."""
    message, line = _mujoco_message(text)
    if line and files.models > 1:
        message, line = f"{message} (line {line}, of this model or of one that it attaches)", 0
    problem = Problem(
        file=files.file, line=max(line, 1), column=1, path="", message=f"MuJoCo refuses the file: {message}"
    )
    return ImportedFileError([problem])


def _mujoco_message(text: str) -> tuple[str, int]:
    """Return MuJoCo's message in one line, and the line that it names or 0."""
    found = _LINE.search(text)
    parts = [" ".join(_NOISE.sub("", _LINE.sub("", part)).split()) for part in text.splitlines()]
    parts = [_ELEMENT.sub(r"(element \1)", part.rstrip(":;,. ")) for part in parts if part]
    words = "; ".join(parts).replace("; (element ", " (element ")
    return words, int(found.group(1)) if found else 0
