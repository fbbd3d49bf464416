#!/usr/bin/env python3
"""Draw the pictures of docs/frame-assignment.md: ``python scripts/draw_frame_assignment.py [FOLDER]``.

One version of matplotlib draws the same bytes every time.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Final

from dh2sim.draw.frame_figure.figure import draw_assignment
from dh2sim.importing.axes import import_axes
from dh2sim.robot.axes_file import read_axes

DOCS: Final = Path(__file__).resolve().parents[1] / "docs"
PUMA: Final = DOCS / "puma560_axes.yaml"
PAGE: Final = DOCS / "frame-assignment.md"


def stanford_axes() -> bytes:
    """Return the axes of the Stanford arm, as the page gives them."""
    found = re.findall(
        r"^```yaml\n(name: stanford\n.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )
    [text] = found
    return str(text).encode()


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, data, file in (
        ("frame_assignment", PUMA.read_bytes(), PUMA.name),
        ("frame_assignment_stanford", stanford_axes(), PAGE.name),
    ):
        axes = read_axes(data, file=file, directory=DOCS)
        draw_assignment(import_axes(axes), folder / f"{name}.svg")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS / "images")
