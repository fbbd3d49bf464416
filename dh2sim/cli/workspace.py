"""``dh2sim workspace``: what a robot reaches inside its limits."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dh2sim.cli.common import JsonOption, QuietOption, RobotArgument, build_serial
from dh2sim.cli.output import json_text, progress_bar, table_lines, wrapped
from dh2sim.errors import OutputError
from dh2sim.files import require_folder
from dh2sim.messages import printable, shown
from dh2sim.progress import Advance

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from dh2sim.robot.units import Units
    from dh2sim.workspace.workspace import Workspace

PICTURES = (".png", ".svg", ".pdf")
DATA = (".npz", ".csv", ".ply")


def workspace(
    robot: RobotArgument,
    frame: Annotated[
        str, typer.Option(metavar="FRAME", help="Frame whose origin is followed: tool0, dh_i or link_i.")
    ] = "tool0",
    section: Annotated[
        bool,
        typer.Option(
            "--section",
            help="Find the section and its exact boundary: in r and z where the first joint turns, in its plane "
            "where the arm is planar.",
        ),
    ] = False,
    dexterity: Annotated[
        bool,
        typer.Option("--dexterity", help="Find in which share of orientations each voxel is reached; takes minutes."),
    ] = False,
    orientations: Annotated[
        int | None, typer.Option(metavar="N", help="Orientations that --dexterity tries. [default: 24]")
    ] = None,
    size: Annotated[
        float | None,
        typer.Option(metavar="M", help="Edge of the voxels, m. [default: by the reach; 0.04 for 0.9 m]"),
    ] = None,
    samples: Annotated[int, typer.Option(metavar="N", help="Random configurations.")] = 200_000,
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the random number generator.")] = 0,
    threads: Annotated[
        int, typer.Option(metavar="N", help="Number of threads; 0: one for each processor; changes no result.")
    ] = 0,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FILE",
            help="File to write: a picture as .png, .svg or .pdf; numbers as .npz, .csv or .ply.",
        ),
    ] = None,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Find what a robot reaches inside its joints' limits.

    Random configurations fill voxels, searches from voxel to voxel complete them. Each voxel has its count of random
    configurations, and the best manipulability with the configuration that has it.

    \b
    Examples:
      dh2sim workspace puma560
      dh2sim workspace puma560 --section -o section.svg
      dh2sim workspace planar_2r --section --json
      dh2sim workspace stanford --size 0.02 -o voxels.ply
      dh2sim workspace puma560 --size 0.1 --dexterity -o dexterity.csv
    """
    if orientations is not None and not dexterity:
        raise typer.BadParameter("needs --dexterity", param_hint="--orientations")
    picture = _require_file(out)
    model = build_serial(robot)

    from dh2sim.workspace.workspace import ORIENTATIONS, compute_workspace

    def stage(doing: str, what: str, total: int) -> AbstractContextManager[Advance]:
        return progress_bar(doing, what, total, quiet=quiet)

    found = compute_workspace(
        model,
        frame=frame,
        size=size,
        samples=samples,
        seed=seed,
        threads=threads,
        section=section,
        dexterity=dexterity,
        orientations=ORIENTATIONS if orientations is None else orientations,
        stage=stage,
    )
    if out is not None:
        if picture:
            from dh2sim.draw.workspace import write_workspace_picture

            write_workspace_picture(found, out)
        else:
            from dh2sim.workspace.files import write_workspace

            write_workspace(found, out)
    if as_json:
        print(json_text(_as_json(found)))
    elif not quiet:
        print("\n".join(_lines(found, model.spec.units)))
        if out is not None:
            print(printable(f"\nwritten: {out}"))


def _require_file(out: Path | None) -> bool:
    """Check the name of the file to write before anything is computed; return whether it is a picture."""
    if out is None:
        return False
    ending = out.suffix.lower()
    if ending not in (*PICTURES, *DATA):
        raise OutputError(f"cannot write {shown(out.name)}: allowed endings: {', '.join((*PICTURES, *DATA))}")
    require_folder(out)
    if ending in PICTURES:
        from dh2sim.draw.plot_style import require_plot

        require_plot(out, what="drawing a workspace")
        return True
    return False


def _lines(found: Workspace, units: Units) -> list[str]:
    """Return what is printed, at most 80 columns wide as far as names allow."""
    from dh2sim.robot.units import AngleUnit

    kind = {3: "volume", 2: "surface", 1: "curve", 0: "point"}[found.dimension]
    if found.dimension == len(found.axes) == 2:
        kind = "part of a plane"
    name = {3: "voxels", 2: "cells", 1: "pieces"}[len(found.axes)]
    lines = [f"{found.robot}: {found.frame} reaches a {kind}", ""]
    hit = int((found.count > 0).sum())
    rows = [
        (name, f"{len(found.centers):,} of {found.size:g} m"),
        ("  reached at random", f"{hit:,} by {found.samples:,} configurations"),
        ("  found by search", f"{len(found.centers) - hit:,}"),
    ]
    section = found.section
    if section is not None:
        rows.append(("area of the section", f"{section.area:.6g} m²"))
        if section.volume is not None and section.full_turn_volume is not None:
            rows.append(("volume", f"{section.volume:.6g} m³"))
            if section.volume < section.full_turn_volume * (1.0 - 1e-9):
                rows.append((f"  {section.turns_about} all around", f"{section.full_turn_volume:.6g} m³"))
        holes = sum(curve.area < 0.0 for curve in section.curves)
        rows.append(("boundary", f"{len(section.curves) - holes} outside, {holes} around holes"))
    elif found.area is not None:
        rows.append(("area of the cells", f"{found.area:.4g} m²"))
    elif found.volume is not None:
        rows.append(("volume of the voxels", f"{found.volume:.4g} m³"))
    best = float(found.manipulability.max(initial=0.0))
    rows.append(("best manipulability", f"{best:.4g}, of the {found.measure}"))
    if found.dexterity is not None and len(found.dexterity.share):
        share = found.dexterity.share
        rows.append(
            (
                f"{found.dexterity.kind} reached",
                f"{100.0 * float(share.mean()):.1f} % on average, {100.0 * float(share.max()):.1f} % at best, "
                f"of {found.dexterity.orientations}",
            )
        )
    width = max(len(left) for left, _ in rows)
    lines += [f"{left:<{width}}  {right}" for left, right in rows]
    angle = "deg" if units.angle is AngleUnit.DEG else "rad"
    head = ("reach", "m", f"at, in {angle} and {units.length.value}")
    table = [head]
    flat = found.extremes["highest"].value - found.extremes["lowest"].value < 1e-9 * found.extremes["farthest"].value
    for word, extreme in found.extremes.items():
        if flat and word in ("highest", "lowest"):
            continue
        coordinates = [
            f"{(0.0 if abs(value) < 1e-6 else value) / units.coordinate(1.0, turns=turns):.6g}"
            for value, turns in zip(extreme.q.tolist(), found.turning, strict=True)
        ]
        table.append((word, f"{extreme.value:.6f}", " ".join(coordinates)))
    lines += ["", *(line.rstrip() for line in table_lines(table, left=3))]
    notes = [*found.notes, *(found.dexterity.notes if found.dexterity is not None else ())]
    for note in notes:
        lines += wrapped(f"Note: {note}", rest="      ")
    return [printable(line) for line in lines]


def _as_json(found: Workspace) -> dict[str, Any]:
    section, dexterity = found.section, found.dexterity
    content: dict[str, Any] = {
        "robot": found.robot,
        "frame": found.frame,
        "joints": list(found.joints),
        "dimension": found.dimension,
        "size": found.size,
        "samples": found.samples,
        "seed": found.seed,
        "voxels": len(found.centers),
        "sampled_voxels": int((found.count > 0).sum()),
        "volume": found.volume,
        "area": found.area,
        "manipulability": {"measure": found.measure, "best": float(found.manipulability.max(initial=0.0))},
        "bounds": None,
        "reach": {
            word: {"value": extreme.value, "point": extreme.point.tolist(), "q": extreme.q.tolist()}
            for word, extreme in found.extremes.items()
        },
        "section": None,
        "dexterity": None,
        "notes": list(found.notes),
    }
    if len(found.centers):
        half = 0.5 * found.size
        content["bounds"] = [
            (found.centers.min(axis=0) - half).tolist(),
            (found.centers.max(axis=0) + half).tolist(),
        ]
    if section is not None:
        from dh2sim.workspace.files import held_by_name

        content["section"] = {
            "coordinates": list(section.labels),
            "turns_about": section.turns_about,
            "origin": section.axis_point.tolist(),
            "directions": section.directions.tolist(),
            "size": section.size,
            "area": section.area,
            "volume": section.volume,
            "full_turn_volume": section.full_turn_volume,
            "boundary": [
                {
                    "area": curve.area,
                    "points": curve.points.tolist(),
                    "held_by": [held_by_name(found, number) for number in held.tolist()],
                }
                for curve, held in zip(section.curves, section.held_by, strict=True)
            ],
            "line": section.line.tolist(),
            "singular": section.singular.tolist(),
        }
    if dexterity is not None:
        content["dexterity"] = {
            "kind": dexterity.kind,
            "orientations": dexterity.orientations,
            "mean": float(dexterity.share.mean()) if len(dexterity.share) else 0.0,
            "best": float(dexterity.share.max(initial=0.0)),
            "notes": list(dexterity.notes),
        }
    return content
