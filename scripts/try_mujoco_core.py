#!/usr/bin/env python3
"""Run the tests with MuJoCo from the package `mujoco-core`, in a virtual environment of their own.

    scripts/try_mujoco_core.py                                   the quick suite, with mujoco-core 4.0.1
    scripts/try_mujoco_core.py tests/engines tests/simulate      only these; whatever pytest takes may follow
    scripts/try_mujoco_core.py --environment ~/mj4 -m ''         all tests, in an environment that is kept
    scripts/try_mujoco_core.py --version 4.0.0 tests/engines     another version

Since 4.0 the package `mujoco` only names others: the library is in `mujoco-core`, without the viewer and OpenGL. Both
packages own the folder `mujoco`, so dh2sim's requirement of `mujoco` is left out here, and all others are installed.
The exit status is pytest's.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tomllib
import venv
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).resolve().parent.parent
NAME = re.compile(r"[A-Za-z0-9._-]+")
OWN = re.compile(r"dh2sim\[(.*)\]")
EXTRAS = ("test",)


def requirements(version: str) -> list[str]:
    """Return what dh2sim and the extras for tests require, with mujoco-core in place of mujoco."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras: dict[str, list[str]] = project["optional-dependencies"]

    def of_extra(name: str) -> Iterator[str]:
        for requirement in extras[name]:
            if own := OWN.fullmatch(requirement):
                for inner in own[1].split(","):
                    yield from of_extra(inner.strip())
            else:
                yield requirement

    every = [*project["dependencies"], *(one for extra in EXTRAS for one in of_extra(extra))]
    others = [one for one in every if NAME.match(one)[0] != "mujoco"]  # type: ignore[index]
    return [f"mujoco-core=={version}", *dict.fromkeys(others)]


def make_environment(folder: Path, version: str) -> Path:
    """Make a virtual environment, or bring one up to date, and return its Python."""
    if not (folder / "pyvenv.cfg").exists():
        venv.create(folder, with_pip=True)
    python = folder / "bin" / "python"
    pip = [str(python), "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    subprocess.run([*pip, *requirements(version)], check=True)
    subprocess.run([*pip, "--no-deps", "--editable", str(ROOT)], check=True)
    return python


def main() -> int:
    """Make the environment and run pytest in it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--version", default="4.0.1", help="of mujoco-core; default: %(default)s")
    parser.add_argument("--environment", type=Path, metavar="DIR", help="where to make it, and to keep it")
    arguments, of_pytest = parser.parse_known_args()
    with TemporaryDirectory() as temporary:
        python = make_environment(arguments.environment or Path(temporary) / "venv", arguments.version)
        found = subprocess.run(
            [python, "-c", "import mujoco; print(mujoco.__version__, mujoco.__file__)"],
            check=True,
            capture_output=True,
            text=True,
        )
        print(f"MuJoCo {found.stdout.strip()}", flush=True)
        return subprocess.run([python, "-W", "error", "-m", "pytest", *of_pytest], cwd=ROOT, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
