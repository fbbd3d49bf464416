"""Damaged files of strangers, many of them: imported and exported, or refused by name, within bounds of time.

    python -m tests.importing.campaign files 1000 [SEED]
    python -m tests.importing.campaign meshes 1000 [SEED]

Prints a line of JSON, how often what was found, and the files that fell short to standard error. Files are those of
the tests, what is exported of the robots that come with dh2sim, and those of installed packages of robots.
"""

from __future__ import annotations

import json
import random
import re
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from functools import cache
from pathlib import Path

import trimesh

from dh2sim.errors import Dh2simError, ImportedFileError, MeshError, MismatchError
from dh2sim.export import export_robot
from dh2sim.importing.sources import ImportOptions, import_robot
from dh2sim.model.build import build_model
from dh2sim.model.meshes import load_mesh
from dh2sim.robot.links import MeshSpec
from dh2sim.robot.row import Convention
from scripts.real_arms.arms import ARMS
from scripts.real_arms.packages import installed

HERE = Path(__file__).parent
REPOSITORY = HERE.parents[1]
MOST_SECONDS = 2.0
"""Of processor time for a file that is refused."""
NUMBERS = [
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e300",
    "1e-320",
    "1e30",
    "1e9",
    "-1",
    "0",
    "2147483648",
    "1e16",
    "3.14159",
]
TEXTS = ["", "0 0 0", "1 0", "true", "one", "world", "../x", "package://a/../b.stl", "\0", "é", "${x}", "$(arg y)"]


@cache
def sources() -> tuple[tuple[str, bytes], ...]:
    """Return names and contents of files that can be imported; moderate ones, as thousands are read."""
    folders = [HERE / "third_party", HERE.parent / "formats" / "table" / "printouts", REPOSITORY / "generated"]
    paths = [path for folder in folders for path in sorted(folder.rglob("*")) if path.is_file()]
    packages = [(arm, installed(arm.package)) for arm in ARMS]
    paths += [arm.path(root) for arm, root in packages if root is not None]
    closed = {path.stem for path in (REPOSITORY / "robots" / "mechanisms").glob("*.yaml")}
    found = {}
    for path in paths:
        if (
            path.parent.name not in closed
            and path.suffix in (".urdf", ".xml", ".txt")
            and path.name != "scene.xml"
            and path.stat().st_size < 60_000
        ):
            found[f"{path.parent.name}-{path.name}"] = path.read_bytes()
    return tuple(found.items())


@cache
def meshes() -> tuple[tuple[str, bytes], ...]:
    """Return names and contents of mesh files."""
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    kinds = {"stl": "a.stl", "stl_ascii": "b.stl", "obj": "c.obj", "ply": "d.ply", "glb": "e.glb", "dae": "f.dae"}
    made = {name: box.export(file_type=kind) for kind, name in kinds.items()}
    made["g.ply"] = box.export(file_type="ply", encoding="ascii")
    return tuple((name, data if isinstance(data, bytes) else data.encode()) for name, data in made.items())


def damaged(data: bytes, rng: random.Random) -> bytes:
    """Return a file with one to three things changed: numbers, values, elements, lines or bytes."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        kind = rng.choice(("number", "number", "number", "value", "element", "line", "bytes", "cut"))
        pattern = {
            "number": rb"-?\d+\.?\d*(?:e[-+]?\d+)?",
            "value": rb'"([^"]*)"',
            "element": rb"<[^<>]+/>",
            "line": rb"[^\n]*\n",
        }.get(kind)
        spans = [match.span() for match in re.finditer(pattern, data)] if pattern else []
        start, stop = rng.choice(spans) if spans else (rng.randrange(len(data) + 1),) * 2
        match kind:
            case "number":
                new = rng.choice(NUMBERS).encode()
            case "value":
                new = f'"{rng.choice((*NUMBERS, *TEXTS))}"'.encode()
            case "element" | "line":
                new = rng.choice((b"", 2 * data[start:stop], data[start:stop] * 50))
            case "cut":
                stop, new = min(len(data), start + rng.randint(0, 200)), b""
            case _:
                stop, new = min(len(data), start + rng.randint(0, 4)), rng.randbytes(rng.randint(0, 4))
        data = data[:start] + new + data[stop:]
    return data


def files(count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Import damaged files, and export what can be imported; return what was found, and failures."""

    def tried(path: Path, rng: random.Random) -> str:
        options = ImportOptions(convention=rng.choice((Convention.STANDARD, Convention.MODIFIED)))
        try:
            imported = import_robot(path, options)
        except ImportedFileError as error:
            _require(all(Path(problem.file).parent == path.parent for problem in error.problems), error)
            return "refused"
        except MismatchError:
            return "above the tolerance"
        except Dh2simError as error:
            _require(str(path) in str(error), error)
            return "refused"
        model = build_model(imported.spec)
        if len(model.links) <= 20:
            export_robot(model, path.parent / "out")
        return "imported"

    return _campaign(sources(), tried, count, seed)


def broken_meshes(count: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Read damaged meshes; return what was found, and failures."""

    def tried(path: Path, _rng: random.Random) -> str:
        try:
            load_mesh(MeshSpec(file=path), "link_1")
        except MeshError as error:
            _require(str(path) in str(error), error)
            return "refused"
        return "read"

    return _campaign(meshes(), tried, count, seed)


def _require(named: bool, error: Exception) -> None:
    if not named:
        raise AssertionError("the error does not name the file") from error


def _campaign(
    of: tuple[tuple[str, bytes], ...], tried: Callable[[Path, random.Random], str], count: int, seed: int
) -> tuple[Counter[str], list[str]]:
    found, failures = Counter[str](), list[str]()
    for number in range(count):
        rng = random.Random(f"{seed} {number}")
        name, data = rng.choice(of)
        data = damaged(data, rng)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / name
            path.write_bytes(data)
            start = time.process_time()
            try:
                outcome = tried(path, rng)
            except Exception as error:
                outcome = f"failed: {type(error).__name__}"
                failures.append(f"{number} {name}: {''.join(traceback.format_exception(error)[-4:])}")
            if outcome == "refused" and (seconds := time.process_time() - start) > MOST_SECONDS:
                failures.append(f"{number} {name}: refused after {seconds:.1f} s")
            found[outcome] += 1
    return found, failures


if __name__ == "__main__":
    made, failed = {"files": files, "meshes": broken_meshes}[sys.argv[1]](
        int(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 0
    )
    print("\n\n".join(failed), file=sys.stderr)
    print(json.dumps(made))
