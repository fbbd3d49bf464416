"""What is wrong with STL, OBJ, PLY and GLB files that cannot be read as what their names say, and what to do.

Libraries that read them answer a broken file with no faces, with a part of them, or with words of their own code.
"""

from __future__ import annotations

import json
import math
import re
import struct
from typing import Final

from dh2sim.messages import shown

_AGAIN: Final = "copy or export it again"
_STL_HEADER, _STL_FACE = 84, 50
_GLB_HEADER: Final = 20
_FORMATS: Final = (
    (".glb", re.compile(rb"glTF"), "a GLB file"),
    (".ply", re.compile(rb"ply\r?\n"), "a PLY file"),
    (".dae", re.compile(rb"\s*<(?:\?xml.{0,200}?<)?COLLADA", re.DOTALL), "a COLLADA file"),
    (".obj", re.compile(rb"(?:\s*#[^\n]*\n)*\s*(?:mtllib|o|v)[ \t]"), "an OBJ file"),
)
_OTHERS: Final = (
    (re.compile(rb"version https://git-lfs"), "it is a pointer of Git LFS, not the mesh: run 'git lfs pull'"),
    (re.compile(rb"\s*<(?:!doctype )?html", re.IGNORECASE), "it is a web page, not a mesh: download the file itself"),
    (re.compile(rb"PK\x03\x04|\x1f\x8b"), "it is compressed: unpack it"),
)
_ZERO_CORNER: Final = re.compile(rb"^[ \t]*f[ \t][^\n]*?(?<=[ \t])0+(?=[/\s]|\Z)", re.MULTILINE)


def defect_of(suffix: str, data: bytes) -> str | None:
    """Return what is plainly wrong with the content of a mesh file, or None; quick also for large files.

    Args:
        suffix: Of its name, such as ``.stl``.
        data: Its content.
    """
    if suffix == ".stl" and _is_whole_stl(data):
        return None
    if not data.strip():
        return "it is empty"
    for pattern, words in _OTHERS:
        if pattern.match(data):
            return words
    for other, pattern, name in _FORMATS:
        if other != suffix and pattern.match(data):
            return f"it is {name}: name it *{other}"
    match suffix:
        case ".stl":
            return _stl(data)
        case ".obj":
            found = _ZERO_CORNER.search(data)
            return found and f"line {_line(data, found.start())}: a face refers to corner 0; corners count from 1"
        case ".ply":
            return _ply(data)
        case ".glb":
            return _glb(data)
    return None


def reason_of(suffix: str, data: bytes) -> str:
    """Return why a mesh file, without plain defects, could not be read."""
    reason = _obj(data) if suffix == ".obj" else ascii_stl_defect(data) if suffix == ".stl" else None
    return reason or f"it is not a valid {suffix[1:].upper()} file, or only a part of one: {_AGAIN}"


def _line(data: bytes, place: int) -> int:
    return data.count(b"\n", 0, place) + 1


def _faces_of(data: bytes) -> int:
    return int(struct.unpack_from("<I", data, _STL_HEADER - 4)[0])


def _is_whole_stl(data: bytes) -> bool:
    return len(data) >= _STL_HEADER and len(data) == _STL_HEADER + _STL_FACE * _faces_of(data)


def _stl(data: bytes) -> str | None:
    if re.match(rb"\s*solid\b", data, re.IGNORECASE) and (b"facet" in data[:2000] or len(data) < _STL_HEADER):
        if re.search(rb"endsolid", data[-2000:], re.IGNORECASE) is None:
            last = _line(data.rstrip(), len(data))
            return f"it ends in line {last} without 'endsolid', so that a part is missing: {_AGAIN}"
        return None
    if len(data) < _STL_HEADER:
        return f"it has {len(data)} bytes, and is not an STL file: a binary one has at least {_STL_HEADER}"
    faces = _faces_of(data)
    size = _STL_HEADER + _STL_FACE * faces
    what = (
        "is only a part of an STL file, or none"
        if size > len(data)
        else "is not an STL file, or has more after its end"
    )
    return (
        f"as an STL file it announces {faces} faces in {size} bytes, but has {len(data)} bytes: it {what}; {_AGAIN}"
    )


def ascii_stl_defect(data: bytes) -> str | None:
    """Return the first corner of an STL file in text that has no three numbers."""
    for number, line in enumerate(data.splitlines(), start=1):
        words = line.split()
        if words[:1] == [b"vertex"] and (wrong := _wrong_number(words[1:])) is not None:
            return f"line {number}: a corner needs three numbers, found {wrong}"
    return None


def _wrong_number(words: list[bytes]) -> str | None:
    """Return what keeps words from beginning with three finite numbers."""
    for word in words[:3]:
        try:
            if not math.isfinite(float(word)):
                return shown(word.decode("latin-1"))
        except ValueError:
            return shown(word.decode("latin-1"))
    return None if len(words) >= 3 else f"{len(words)} of them"


def _obj(data: bytes) -> str | None:
    """Return the first line of an OBJ file that is no corner or face, or refers to a corner that is not there."""
    lines = data.splitlines()
    corners = sum(line.split()[:1] == [b"v"] for line in lines)
    for number, line in enumerate(lines, start=1):
        kind, *words = line.split() or [b""]
        if kind == b"v" and (wrong := _wrong_number(words)) is not None:
            return f"line {number}: a corner needs three numbers, found {wrong}"
        if kind != b"f":
            continue
        if len(words) < 3:
            return f"line {number}: a face needs at least three corners, found {len(words)}"
        for word in words:
            first = word.split(b"/")[0]
            if not re.fullmatch(rb"-?\d{1,12}", first):
                return f"line {number}: a face names corners by numbers, found {shown(word.decode('latin-1'))}"
            if not 1 <= abs(int(first)) <= corners:
                return f"line {number}: a face refers to corner {int(first)}; the file has {corners}"
    return None


def _ply(data: bytes) -> str | None:
    if re.match(rb"ply\s", data) is None:
        return "it does not begin with 'ply', and is not a PLY file"
    end = re.search(rb"^end_header[ \t]*\r?\n?", data[:1_000_000], re.MULTILINE)
    if end is None:
        return f"it has no line 'end_header', so that a part is missing: {_AGAIN}"
    header = data[: end.start()]
    form = re.search(rb"^format[ \t]+(\S+)", header, re.MULTILINE)
    known = ("ascii", "binary_little_endian", "binary_big_endian")
    name = form[1].decode("latin-1") if form else None
    if name not in known:
        return f"its format is {shown(name)}; it must be {', '.join(known[:2])} or {known[2]}"
    if name == "ascii":
        counts = [int(digits) for digits in re.findall(rb"^element\s+\S+\s+(\d{1,18})", header, re.MULTILINE)]
        lines = sum(1 for line in data[end.end() :].splitlines() if line.strip())
        if lines < sum(counts):
            return (
                f"it announces {sum(counts)} elements, one line each, but has {lines} lines behind 'end_header', "
                f"so that a part is missing: {_AGAIN}"
            )
    return None


def _glb(data: bytes) -> str | None:
    if data[:4] != b"glTF":
        if data.lstrip()[:1] == b"{":
            return "it is a glTF file in text, which keeps its corners in other files: export it as GLB"
        return "it does not begin with 'glTF', and is not a GLB file"
    if len(data) < _GLB_HEADER:
        return f"it has {len(data)} bytes, so that a part is missing: {_AGAIN}"
    version, size, described = struct.unpack_from("<III", data, 4)
    if version != 2:
        return f"it is of version {version} of glTF; only version 2 is read: export it again"
    if size > len(data):
        return f"it should have {size} bytes, but has {len(data)}, so that a part is missing: {_AGAIN}"
    try:
        tree = json.loads(data[_GLB_HEADER : _GLB_HEADER + described])
    except (ValueError, RecursionError):
        return f"its description is not JSON: {_AGAIN}"
    if not isinstance(tree, dict):
        return f"its description is not a JSON object: {_AGAIN}"
    needed = tree.get("extensionsRequired")
    compressed = [name for name in needed if "compression" in str(name)] if isinstance(needed, list) else []
    if compressed:
        return f"its corners are compressed by {shown(str(compressed[0]))}: export it without compression"
    buffers = tree.get("buffers")
    if isinstance(buffers, list) and any(isinstance(buffer, dict) and "uri" in buffer for buffer in buffers):
        return "it keeps its corners in other files: export it as one GLB file"
    return None
