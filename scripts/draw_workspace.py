#!/usr/bin/env python3
"""Draw the pictures of docs/workspace.md: ``python scripts/draw_workspace.py [FOLDER]``."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Final

import dh2sim
from dh2sim.draw.workspace import write_workspace_picture

IMAGES: Final = Path(__file__).resolve().parent.parent / "docs" / "images"


def main(folder: Path) -> None:
    """Draw the section and the voxels of the PUMA."""
    found = dh2sim.Robot.load("puma560").workspace(section=True)
    write_workspace_picture(found, folder / "workspace_section.png", dpi=90.0)
    write_workspace_picture(replace(found, section=None), folder / "workspace_voxels.png", dpi=90.0)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES)
