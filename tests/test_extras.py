"""What comes with extras is optional: without it the core works, and what needs it says how to get it."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Collection
from pathlib import Path

import pytest

from dh2sim.errors import Dh2simError, MissingExtraError
from dh2sim.extras import require_extra
from tests.program import Outcome, dh2sim, environment

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
MODULES = {
    "view": {"viser", "websockets", "msgspec"},
    "plot": {"matplotlib", "xarray"},
    "video": {"PIL", "imageio_ffmpeg", "xarray"},
    "data": {"xarray", "pyarrow", "h5netcdf", "h5py"},
    "engines": {"yourdfpy"},
    "toppra": {"toppra"},
    "xacro": {"xacro"},
    "s3": {"obstore"},
    "cluster": {"distributed"},
    "fast": {"numba"},
    "warp": {"warp", "mujoco_warp"},
}
"""What is imported of each extra's libraries."""
BROUGHT = {
    "pinocchio",
    "pybullet",
    "pandas",
    "scipy",
    "requests",
    "imageio",
    "lxml",
    "shapely",
    "embreex",
}
"""Some of what they bring along, and engines that come with none of them."""
OPTIONAL = {*BROUGHT, *(module for modules in MODULES.values() for module in modules)}
AXES = """\
name: two_joints
axes:
  - {type: revolute, point: [0, 0, 0], direction: [0, 0, 1]}
  - {type: prismatic, direction: [1, 0, 0]}
"""


class Blocked:
    """Python without some modules."""

    def __init__(self, modules: Collection[str], folder: Path) -> None:
        self._start = f"import sys; sys.modules.update(dict.fromkeys({sorted(modules)!r}))"
        self._folder = folder

    def python(self, code: str, *arguments: str) -> Outcome:
        done = subprocess.run(
            [sys.executable, "-c", f"{self._start}; {code}", *arguments],
            cwd=self._folder,
            env=environment(PYTHONPATH=str(ROOT)),
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )
        return Outcome(status=done.returncode, out=done.stdout, err=done.stderr)

    def dh2sim(self, *arguments: str) -> Outcome:
        return self.python("from dh2sim.cli.main import main; main()", *arguments)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a run and a file of axes."""
    folder = tmp_path_factory.mktemp("extras")
    out = str(folder / "run.zarr")
    assert dh2sim("rollout", "rpr", "--out", out, "--rollouts", "2", "--steps", "5", "-q").status == 0
    (folder / "axes.yaml").write_text(AXES, encoding="utf-8")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    ("extra", "command", "what"),
    [
        ("view", "view rpr --no-browser", "the viewer"),
        ("view", "view rpr --export page.html", "the viewer"),
        ("plot", "plot run.zarr", "plotting"),
        ("plot", "frames axes.yaml -q --picture frames.svg", "a picture of frames"),
        ("plot", "workspace rpr -o reach.svg", "drawing a workspace"),
        ("video", "render run.zarr", "rendering"),
        ("video", "render rpr", "rendering"),
        ("data", "runs run.zarr --to parquet", "Parquet"),
        ("data", "runs run.zarr --to hdf5", "HDF5"),
        ("data", "validate rpr --dynamics", "--dynamics"),
        ("s3", "runs s3://bucket/run.zarr", "a run in an object store"),
        ("cluster", "rollout rpr --out new.zarr --executor dask://localhost:1", "an executor of Dask"),
        ("toppra", "trajectory rpr home zero --profile optimal", "profile 'optimal'"),
    ],
)
def test_a_command_without_its_extra_says_how_to_install_it(
    folder: Path, extra: str, command: str, what: str
) -> None:
    before = sorted(folder.iterdir())
    message = f"dh2sim: {what} needs the extra '{extra}': pip install 'dh2sim[{extra}]'\n"
    expected = Outcome(status=2, out="", err=message)
    assert Blocked(MODULES[extra], folder).dh2sim(*command.split()) == expected
    assert sorted(folder.iterdir()) == before


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "extra"),
    [
        ("import dh2sim.view.server", "view"),
        ("from dh2sim.simulate import rollout; rollout('rpr', rollouts=1, steps=2)", "data"),
        ("from dh2sim.simulate import open_dataset; open_dataset('run.zarr')", "data"),
        ("from dh2sim import Robot; Robot.load('rpr').fk([[0, 0, 0]], backend='numba')", "fast"),
    ],
)
def test_the_library_without_an_extra_says_how_to_install_it(folder: Path, code: str, extra: str) -> None:
    last = Blocked(MODULES[extra], folder).python(code).err.splitlines()[-1]
    assert last.startswith("dh2sim.errors.MissingExtraError: ")
    assert last.endswith(f" needs the extra '{extra}': pip install 'dh2sim[{extra}]'")


@pytest.mark.slow
def test_nothing_is_simulated_that_could_not_be_returned(folder: Path) -> None:
    code = "from dh2sim.simulate import rollout; rollout('rpr', out='late.zarr', rollouts=1, steps=2)"
    assert Blocked({"xarray"}, folder).python(code).status == 1
    assert not (folder / "late.zarr").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [
        "list",
        "schema",
        "info stanford",
        "fk stanford home",
        "export rpr --out build",
        "validate rpr --samples 5",
        f"import {ROOT / 'generated' / 'rpr' / 'rpr.urdf'} -q",
        f"import {ROOT / 'generated' / 'rpr' / 'rpr.xml'} -q",
        "convert rpr --to modified -q",
        "frames axes.yaml -q",
        "rollout rpr --out other.zarr --rollouts 2 --steps 5",
        "runs run.zarr",
        "trajectory rpr home home -o motion.csv",
        "workspace rpr --section --samples 500 -o reach.csv",
    ],
)
def test_the_core_works_without_any_extra(folder: Path, tmp_path: Path, command: str) -> None:
    shutil.copy(folder / "axes.yaml", tmp_path)
    shutil.copytree(folder / "run.zarr", tmp_path / "run.zarr")
    done = Blocked(OPTIONAL, tmp_path).dh2sim(*command.split())
    assert (done.status, done.err) == (0, "")


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".stl", ".obj", ".ply", ".glb"])
def test_the_core_reads_meshes(tmp_path: Path, suffix: str) -> None:
    import trimesh

    trimesh.creation.box((0.1, 0.2, 0.3)).export(tmp_path / f"box{suffix}")
    joint = f"{{type: revolute, a: 1, link: {{mesh: {{file: box{suffix}}}}}}}"
    (tmp_path / "arm.yaml").write_text(f"name: arm\nconvention: standard\njoints:\n  - {joint}\n", encoding="utf-8")
    done = Blocked(OPTIONAL, tmp_path).dh2sim("export", "arm.yaml", "--out", "build")
    assert (done.status, done.err) == (0, "")


def test_frames_are_explained_without_a_picture(folder: Path) -> None:
    done = Blocked(MODULES["plot"], folder).dh2sim("frames", "axes.yaml", "--explain", "-q")
    assert done.status == 0
    assert "# " in done.out
    assert done.err == (
        "dh2sim: no picture is drawn: a picture of frames needs the extra 'plot': pip install 'dh2sim[plot]'\n"
    )


def test_a_missing_extra_is_an_error_of_dh2sim_and_of_imports() -> None:
    with pytest.raises(MissingExtraError) as caught:
        require_extra("view", "json", "no_such_module", what="this")
    assert isinstance(caught.value, Dh2simError)
    assert isinstance(caught.value, ImportError)
    assert str(caught.value) == "this needs the extra 'view': pip install 'dh2sim[view]'"
    require_extra("view", "json", what="this")


def test_every_extra_asked_for_is_one_of_the_package() -> None:
    asked = {
        extra
        for path in (ROOT / "dh2sim").rglob("*.py")
        for extra in re.findall(r"""require_extra\(\s*["'](\w+)|dh2sim\[(\w+)\]""", path.read_text(encoding="utf-8"))
    }
    assert {name for pair in asked for name in pair if name} == set(MODULES)
    assert set(MODULES) < set(PROJECT["optional-dependencies"])


def test_all_holds_every_extra_but_the_largest_and_the_tests_need_that_too() -> None:
    extras = PROJECT["optional-dependencies"]
    assert extras["all"] == [f"dh2sim[{','.join(name for name in MODULES if name not in ('fast', 'warp'))}]"]
    assert "dh2sim[all,fast]" in extras["test"]
