"""The package's public names, and what importing and running it costs."""

from __future__ import annotations

import ast
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

import pytest

import dh2sim
from dh2sim import simulate
from tests.program import environment

URDF = Path(__file__).resolve().parent.parent / "generated" / "rpr" / "rpr.urdf"
RUNS = {"zarr", "numcodecs", "google_crc32c"}
TABLES = {"xarray", "pandas", "pyarrow", "h5netcdf", "h5py"}
PICTURES = {"matplotlib", "PIL", "imageio_ffmpeg"}
MODELS = {"trimesh", "yourdfpy", "pinocchio", "pybullet", "scipy", "lxml"}
VIEWER = {"viser", "websockets", "requests"}
HEAVY = {"numpy", "mujoco", "pydantic", "ruamel", "rich", *RUNS, *TABLES, *PICTURES, *MODELS, *VIEWER}

MODULES = """
import sys
from contextlib import redirect_stdout
{code}
print(*sorted({{name.partition(".")[0] for name, module in sys.modules.items() if module is not None}}))
"""
RUN = """
import io
from dh2sim.cli.app import app
with redirect_stdout(io.StringIO()):
    try:
        app({arguments})
    except SystemExit as end:
        assert not end.code, end.code
"""


def _imported(code: str) -> set[str]:
    """The top-level packages that are loaded when some code has run in a fresh interpreter."""
    done = subprocess.run(
        [sys.executable, "-c", MODULES.format(code=code)],
        env=environment(),
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    return set(done.stdout.split())


@pytest.mark.parametrize("package", [dh2sim, simulate], ids=lambda package: package.__name__)
def test_a_type_checker_is_shown_the_names_that_are_imported_lazily(package: ModuleType) -> None:
    tree = ast.parse(Path(str(package.__file__)).read_text(encoding="utf-8"))
    [block] = [node for node in tree.body if isinstance(node, ast.If)]
    shown = {
        str(alias.asname): str(node.module).removeprefix(f"{package.__name__}.")
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert shown == package._HOMES
    assert package.__all__ == dir(package) == sorted(shown)


@pytest.mark.parametrize(
    ("package", "name"), [(package, name) for package in (dh2sim, simulate) for name in package.__all__]
)
def test_a_public_name_is_documented_and_knows_its_home(package: ModuleType, name: str) -> None:
    value = getattr(package, name)
    if name != "Controller":  # a union
        assert value.__name__ == name
        assert value.__doc__
        assert value.__module__.startswith("dh2sim.")


@pytest.mark.parametrize("package", [dh2sim, simulate], ids=lambda package: package.__name__)
def test_an_unknown_name_is_an_attribute_error(package: ModuleType) -> None:
    with pytest.raises(AttributeError) as caught:
        getattr(package, "to_sdf")  # noqa: B009
    assert str(caught.value) == f"module '{package.__name__}' has no attribute 'to_sdf'"


def test_the_version_is_that_of_the_distribution() -> None:
    assert dh2sim.__version__ == version("dh2sim")


def test_the_package_is_typed() -> None:
    assert (Path(dh2sim.__file__).parent / "py.typed").is_file()


def test_importing_the_package_imports_nothing_but_itself() -> None:
    before = _imported("") | sys.stdlib_module_names
    assert _imported("import dh2sim") - before == {"dh2sim"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "allowed"),
    [
        ("import dh2sim; dh2sim.Dh2simError", set()),
        ("import dh2sim.cli.app", set()),
        (RUN.format(arguments=["--help"]), set()),
        (RUN.format(arguments=["export", "--help"]), {"pydantic"}),  # typer's own need, for types
        (RUN.format(arguments=["validate", "--help"]), {"pydantic"}),
        (RUN.format(arguments=["rollout", "--help"]), {"pydantic"}),
        (RUN.format(arguments=["render", "--help"]), {"pydantic"}),
        (RUN.format(arguments=["plot", "--help"]), {"pydantic"}),
        (RUN.format(arguments=["runs", "--help"]), {"pydantic"}),
        (RUN.format(arguments=["view", "--help"]), {"pydantic"}),
        (RUN.format(arguments=["import", "--help"]), {"pydantic"}),
        (RUN.format(arguments=["convert", "rpr", "--to", "standard", "-q"]), {"numpy", "pydantic", "ruamel"}),
        (RUN.format(arguments=["import", str(URDF), "-q"]), {"numpy", "pydantic", "ruamel"}),
        (RUN.format(arguments=["--version"]), set()),
        (RUN.format(arguments=["fk", "rpr", "home"]), {"numpy", "pydantic", "ruamel"}),
    ],
)
def test_light_work_imports_nothing_heavy(code: str, allowed: set[str]) -> None:
    assert _imported(code) & HEAVY <= allowed


@pytest.mark.slow
def test_an_export_imports_neither_mesh_library_nor_other_engines(tmp_path: Path) -> None:
    arguments = ["export", "stanford", "--out", str(tmp_path)]
    assert not _imported(RUN.format(arguments=arguments)) & {*MODELS, "rich"}
    assert "mujoco" in _imported(RUN.format(arguments=arguments))
    for options in (["--no-verify"], ["--check"]):
        assert "mujoco" not in _imported(RUN.format(arguments=[*arguments, *options]))
    assert not _imported(RUN.format(arguments=arguments)) & {*RUNS, *TABLES, *PICTURES}


@pytest.mark.slow
def test_code_is_written_without_an_engine_and_without_what_draws(tmp_path: Path) -> None:
    arguments = ["symbolic", "ur5e", "--what", "inverse-dynamics", "--as", "c", "-o", str(tmp_path / "ur5e.c")]
    assert not _imported(RUN.format(arguments=arguments)) & {*RUNS, *TABLES, *PICTURES, *MODELS, "mujoco", "rich"}


@pytest.mark.slow
def test_a_rollout_imports_neither_tables_nor_pictures(tmp_path: Path) -> None:
    arguments = ["rollout", "rpr", "--out", str(tmp_path / "run.zarr"), "--rollouts", "2", "--steps", "5"]
    found = _imported(RUN.format(arguments=arguments))
    assert {*RUNS, "mujoco"} <= found
    assert not found & {*TABLES, *PICTURES, *MODELS}


@pytest.mark.slow
def test_a_picture_of_a_robot_imports_nothing_of_runs(tmp_path: Path) -> None:
    arguments = ["render", "rpr", "--out", str(tmp_path / "rpr.png"), "--size", "64x64"]
    assert not _imported(RUN.format(arguments=arguments)) & {*RUNS, *TABLES, "matplotlib", "imageio_ffmpeg"}
