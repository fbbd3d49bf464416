#!/usr/bin/env python3
"""Measure what dh2sim and each of its extras take on the disk.

    scripts/install_sizes.py               core, every extra and all (minutes, and GB of temporary files)
    scripts/install_sizes.py view plot     only these, and core
    scripts/install_sizes.py --write       write the table into docs/dependencies.md; of some extras, their rows

Each is installed in a fresh virtual environment. Counted are the files of the installed distributions, as their
wheels unpack; compiled bytecode, pip and the environment itself come on top.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import venv
from dataclasses import dataclass
from importlib.metadata import distributions
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "dependencies.md"
TABLE = re.compile(r"(<!-- sizes: begin -->\n)(.*)(<!-- sizes: end -->)", flags=re.DOTALL)
HEAD = """\
| installed | packages | MB unpacked | beyond the core | MB of the environment | largest packages, MB |
|---|---:|---:|---:|---:|---|
"""
CORE = ""
EXTRAS = ("view", "plot", "video", "data", "engines", "toppra", "xacro", "s3", "cluster", "fast", "warp", "all")
LARGEST = 5
"""Packages that are named for each row."""


@dataclass(frozen=True)
class Installed:
    """What one installation holds."""

    extra: str
    packages: dict[str, float]
    """Size of each distribution, MB."""
    environment: float
    """Size of the whole virtual environment, MB."""


def install(extra: str, folder: Path) -> Installed:
    """Install dh2sim with an extra in a fresh virtual environment and measure it."""
    venv.create(folder, with_pip=True)
    target = f"{ROOT}[{extra}]" if extra else str(ROOT)
    pip = [str(folder / "bin" / "python"), "-m", "pip", "--disable-pip-version-check"]
    subprocess.run([*pip, "install", "-qq", target], check=True)
    [site] = (folder / "lib").glob("python*/site-packages")
    packages = {}
    for distribution in distributions(path=[str(site)]):
        files = [Path(str(file.locate())) for file in distribution.files or () if file.suffix != ".pyc"]
        packages[distribution.name] = sum(file.stat().st_size for file in files if file.is_file()) / 1e6
    del packages["pip"]
    packages.pop("setuptools", None)
    every = (path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
    return Installed(extra=extra, packages=packages, environment=sum(path.stat().st_size for path in every) / 1e6)


def row(installed: Installed, core: Installed) -> str:
    """Return a line of the table; the packages of an extra are those that the core lacks."""
    own = {name: size for name, size in installed.packages.items() if installed is core or name not in core.packages}
    largest = sorted(own, key=lambda name: -own[name])[:LARGEST]
    size = sum(installed.packages.values())
    beyond = "" if installed is core else f"+{size - sum(core.packages.values()):.0f}"
    named = ", ".join(f"{name} {own[name]:.0f}" for name in largest if own[name] >= 0.5)
    numbers = f"{len(installed.packages)} | {size:.0f} | {beyond} | {installed.environment:.0f}"
    return f"| {title(installed.extra)} | {numbers} | {named} |"


def title(extra: str) -> str:
    """Return what the row of an extra begins with."""
    return f"`dh2sim[{extra}]`" if extra else "`dh2sim`"


def main() -> int:
    """Measure, print, and write the table if asked to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("extras", nargs="*", metavar="EXTRA", help=f"of {', '.join(EXTRAS)}; default: all of them")
    parser.add_argument("--write", action="store_true", help=f"write the table into {PAGE.relative_to(ROOT)}")
    arguments = parser.parse_args()
    unknown = set(arguments.extras) - set(EXTRAS)
    if unknown:
        parser.error(f"unknown extra {', '.join(sorted(unknown))}; allowed: {', '.join(EXTRAS)}")
    rows: dict[str, str] = {}
    core: Installed | None = None
    for extra in (CORE, *(arguments.extras or EXTRAS)):
        with TemporaryDirectory() as folder:
            print(f"installing {extra or 'core'} …", file=sys.stderr)
            installed = install(extra, Path(folder) / "venv")
        core = core or installed
        rows[title(extra)] = row(installed, core)
        print(rows[title(extra)], file=sys.stderr)
    page = PAGE.read_text(encoding="utf-8")
    found = TABLE.search(page)
    if found is None:
        parser.error(f"{PAGE} does not contain the two marks of the table")
    written = {line.split(" | ")[0].removeprefix("| "): line for line in found[2].splitlines()[2:]}
    known = {**written, **rows} if arguments.write else rows
    table = "".join(f"{known[name]}\n" for name in map(title, (CORE, *EXTRAS)) if name in known)
    print(HEAD + table, end="")
    if arguments.write:
        page = page[: found.start()] + found[1] + HEAD + table + found[3] + page[found.end() :]
        PAGE.write_text(page, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
