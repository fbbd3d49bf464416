"""``dh2sim exercise``: a random arm whose table is asked for."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from dh2sim.cli.common import ForceOption, SeedOption
from dh2sim.cli.output import json_text
from dh2sim.errors import OutputError
from dh2sim.messages import printable

TEXT, DRAWING, SOLUTION = "exercise.md", "arm.svg", "solution.yaml"


def exercise(
    seed: SeedOption = 0,
    level: Annotated[int, typer.Option(metavar="1-4", min=1, max=4, help="Difficulty.")] = 1,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            metavar="FOLDER",
            help="Folder for the text, a drawing and the solution.",
        ),
    ] = None,
    force: ForceOption = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, with the solution.")] = False,
) -> None:
    """Make a random arm as an exercise: its axes are described, students find the table.

    Level 1: a planar arm. 2: right angles, offsets and a slide. 3: odd angles. 4: six joints with a wrist.
    --out writes exercise.md, arm.svg and solution.yaml, which 'dh2sim grade' takes; otherwise the text is printed.
    The same seed and level give the same arm, and the same bytes.

    \b
    Examples:
      dh2sim exercise --seed 7 --level 2
      dh2sim exercise --seed 7 --level 2 -o exercise_7
      dh2sim grade exercise_7/solution.yaml hand_in/
    """
    from dh2sim.compare.exercise import make_exercise

    made = make_exercise(seed, level)
    if out is not None:
        from dh2sim.draw.diagram.drawing import draw_robot
        from dh2sim.files import atomic_files

        files = {
            TEXT: made.text(DRAWING),
            DRAWING: draw_robot(made.solution, [0.0] * len(made.joints), style="stick").svg,
            SOLUTION: made.solution_text,
        }
        existing = [name for name in files if (out / name).exists()]
        if existing and not force:
            raise OutputError(f"'{out / existing[0]}' already exists; choose another folder, or give --force")
        with atomic_files(out) as staging:
            for name, text in files.items():
                (staging / name).write_text(text, encoding="utf-8")
    if as_json:
        print(json_text(made.to_dict(), ensure_ascii=False))
    elif out is None:
        print(made.text(), end="")
    else:
        print(printable(f"{out}: {TEXT}, {DRAWING}, {SOLUTION}"))
