"""Which robot files a repository contains, and which of them changed."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path

from dh2sim.errors import Dh2simError, UnknownRobotError
from dh2sim.messages import shown
from dh2sim.robot.yaml_tree import MAX_BYTES

_SUFFIXES = (".yaml", ".yml")
_TOP_LEVEL_JOINTS = re.compile(rb"^(\{.*)?[\"']?joints[\"']?\s*:", re.MULTILINE)


def find_robot_files(paths: Sequence[Path]) -> list[Path]:
    """Return the robot files among paths: files themselves, and those in folders, sorted.

    In a folder a robot file is a YAML file with the key ``joints`` at its top level, whether it is right or wrong.
    Hidden folders and virtual environments are not searched; links to folders are not followed.

    Raises:
        UnknownRobotError: A path does not exist.
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            found += sorted(_in_folder(path))
        elif os.path.lexists(path):
            found.append(path)
        else:
            raise UnknownRobotError(f"no file or folder named {shown(str(path))}")
    unique = {os.path.abspath(path): path for path in reversed(found)}
    return [path for path in found if unique[os.path.abspath(path)] is path]


def _in_folder(folder: Path) -> Iterator[Path]:
    for where, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        if "pyvenv.cfg" in names:
            folders.clear()
            continue
        for name in names:
            path = Path(where, name)
            if name.endswith(_SUFFIXES) and not name.startswith(".") and path.is_file() and _is_robot_file(path):
                yield path


def _is_robot_file(path: Path) -> bool:
    try:
        with path.open("rb") as stream:
            text = stream.read(MAX_BYTES)
    except OSError:
        return True  # whoever reads it reports that
    return _TOP_LEVEL_JOINTS.search(text) is not None


def changed_files(revision: str, folder: Path) -> set[Path]:
    """Return the files that differ from where the branch left a revision, with those that git does not know yet.

    Args:
        revision: A commit, branch or tag.
        folder: A folder of the repository.

    Returns:
        Absolute paths, with links resolved; of files that were removed, too.

    Raises:
        Dh2simError: The folder is in no repository of git, there is no such revision, or git is not installed.
    """
    root = Path(os.fsdecode(_git(folder, "rev-parse", "--show-toplevel").rstrip(b"\n"))).resolve()
    commit = _git(root, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}", of=revision)
    base = _git(root, "merge-base", commit.decode().strip(), "HEAD", of=revision).decode().strip()
    names = _git(root, "diff", "--name-only", "--no-renames", "--no-ext-diff", "-z", base, "--").split(b"\0")
    names += _git(root, "ls-files", "--others", "--exclude-standard", "-z").split(b"\0")
    return {root / os.fsdecode(name) for name in names if name}


def text_before(revision: str, path: Path) -> bytes | None:
    """Return the content of a file where the branch left a revision; None if it was not there.

    Raises:
        Dh2simError: As in ``changed_files``.
    """
    folder = path.resolve().parent
    root = Path(os.fsdecode(_git(folder, "rev-parse", "--show-toplevel").rstrip(b"\n"))).resolve()
    base = _git(root, "merge-base", revision, "HEAD", of=revision).decode().strip()
    name = path.resolve().relative_to(root).as_posix()
    done = _call(root, "show", f"{base}:{name}")
    return done.stdout if done.returncode == 0 else None


def _git(folder: Path, *arguments: str, of: str | None = None) -> bytes:
    done = _call(folder, *arguments)
    if done.returncode != 0:
        if of is not None:
            raise Dh2simError(f"git knows no revision {shown(of)} in {str(folder)!r}; a shallow clone has only one")
        detail = done.stderr.decode("utf-8", "replace").strip().removeprefix("fatal: ")
        raise Dh2simError(f"git cannot say what changed in {str(folder)!r}: {detail}")
    return done.stdout


def _call(folder: Path, *arguments: str) -> subprocess.CompletedProcess[bytes]:
    # no paging, no hooks of the repository's own configuration
    command = ["git", "-c", "core.fsmonitor=false", "-C", os.fspath(folder), *arguments]
    try:
        return subprocess.run(command, capture_output=True, check=False)
    except FileNotFoundError:
        raise Dh2simError("git, which knows what changed since a revision, is not installed") from None
