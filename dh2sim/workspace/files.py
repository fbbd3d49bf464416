"""Workspaces as files of numbers: NPZ, CSV, and PLY for viewers of point clouds."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np

from dh2sim.errors import OutputError
from dh2sim.files import atomic_file
from dh2sim.typing import Array
from dh2sim.workspace.section import SINGULAR
from dh2sim.workspace.workspace import Workspace

ENDINGS: Final = (".npz", ".csv", ".ply")
_COLORS: Final = (
    (68, 1, 84), (71, 44, 122), (59, 81, 139), (44, 113, 142), (33, 144, 141), (39, 173, 129), (92, 200, 99),
    (170, 220, 50), (253, 231, 37),
)  # fmt: skip
"""Of viridis, which matplotlib has from the same places; evenly spaced."""


def write_workspace(workspace: Workspace, out: Path) -> None:
    """Write voxels, and the section where there is one, whole or not at all; the ending chooses the format.

    A CSV holds the corners of the section's boundary where there is a section, else the voxels.

    Raises:
        OutputError: The ending is unknown, or the file cannot be written.
    """
    writers = {".npz": _write_npz, ".csv": _write_csv, ".ply": _write_ply}
    writer = writers.get(out.suffix.lower())
    if writer is None:
        raise OutputError(f"cannot write '{out}': the ending must be one of {', '.join(ENDINGS)}")
    with atomic_file(out) as draft:
        writer(workspace, draft)


def held_by_name(workspace: Workspace, number: int) -> str:
    """Return what bounds a section at a corner: 'singular', or a joint's limit."""
    return "singular" if number == SINGULAR else workspace.joints[number]


def shade(values: Array) -> Array:
    """Return colours from dark to bright, red, green, blue from 0 to 1, shape (N, 3), of values from 0 to 1."""
    scale = np.clip(values, 0.0, 1.0) * (len(_COLORS) - 1)
    table = np.array(_COLORS) / 255.0
    return np.stack([np.interp(scale, np.arange(len(_COLORS)), column) for column in table.T], axis=-1)


def relative_manipulability(workspace: Workspace) -> Array:
    """Return manipulabilities as shares of the greatest, shape (N,)."""
    top = float(workspace.manipulability.max(initial=0.0))
    return workspace.manipulability / top if top > 0.0 else np.zeros(len(workspace.manipulability))


def _write_npz(workspace: Workspace, draft: Path) -> None:
    arrays: dict[str, Any] = {
        "robot": np.array(workspace.robot),
        "frame": np.array(workspace.frame),
        "joints": np.array(workspace.joints),
        "size": np.array(workspace.size),
        "axes": workspace.axes,
        "center": workspace.centers,
        "count": workspace.count.astype(np.int64),
        "manipulability": workspace.manipulability,
        "q": workspace.q,
    }
    if workspace.dexterity is not None:
        arrays["dexterity"] = workspace.dexterity.share
    section = workspace.section
    if section is not None:
        arrays |= {
            "section_labels": np.array(section.labels),
            "section_origin": section.axis_point,
            "section_directions": section.directions,
            "section_line": section.line,
            "section_singular": section.singular,
            "section_singular_q": section.singular_q,
        }
        for k, (curve, held) in enumerate(zip(section.curves, section.held_by, strict=True)):
            arrays |= {f"boundary_{k}": curve.points, f"boundary_{k}_held_by": held}
    with draft.open("wb") as stream:
        np.savez_compressed(stream, **arrays)


def _write_csv(workspace: Workspace, draft: Path) -> None:
    lines = []
    section = workspace.section
    if section is not None and len(section.curves):
        lines.append(f"curve,{section.labels[0]},{section.labels[1]},held_by")
        for k, (curve, held) in enumerate(zip(section.curves, section.held_by, strict=True)):
            lines += [
                f"{k},{x!r},{y!r},{held_by_name(workspace, number)}"
                for (x, y), number in zip(curve.points.tolist(), held.tolist(), strict=True)
            ]
    else:
        shares = None if workspace.dexterity is None else workspace.dexterity.share
        names = ",".join(workspace.joints)
        lines.append(f"x,y,z,count,manipulability{'' if shares is None else ',dexterity'},{names}")
        for k, (center, q) in enumerate(zip(workspace.centers.tolist(), workspace.q.tolist(), strict=True)):
            numbers = [*map(repr, center), str(int(workspace.count[k])), repr(float(workspace.manipulability[k]))]
            numbers += [] if shares is None else [repr(float(shares[k]))]
            lines.append(",".join([*numbers, *map(repr, q)]))
    draft.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _write_ply(workspace: Workspace, draft: Path) -> None:
    names = ["x", "y", "z", "manipulability"] + (["dexterity"] if workspace.dexterity is not None else [])
    columns = [*workspace.centers.T, workspace.manipulability]
    if workspace.dexterity is not None:
        columns.append(workspace.dexterity.share)
    types = (
        [(name, "<f4") for name in names] + [(name, "u1") for name in ("red", "green", "blue")] + [("count", "<i4")]
    )
    table = np.empty(len(workspace.centers), dtype=types)
    for name, column in zip(names, columns, strict=True):
        table[name] = column
    colors = np.round(255.0 * shade(relative_manipulability(workspace)))
    for name, column in zip(("red", "green", "blue"), colors.T, strict=True):
        table[name] = column
    table["count"] = workspace.count
    words = {"<f4": "float", "u1": "uchar", "<i4": "int"}
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment workspace of {workspace.frame} of {workspace.robot}, m, in base_link",
        f"element vertex {len(table)}",
        *(f"property {words[kind]} {name}" for name, kind in types),
        "end_header",
    ]
    draft.write_bytes("\n".join(header).encode("ascii", "replace") + b"\n" + table.tobytes())
