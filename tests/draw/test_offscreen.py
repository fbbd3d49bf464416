"""Which of EGL and OSMesa renders; each case in a process of its own, with libraries that really are not found."""

from __future__ import annotations

import ctypes.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.program import Outcome, environment

pytestmark = pytest.mark.slow

WITHOUT = """
import ctypes, ctypes.util, os
gone = [name for name in os.environ.get("GONE", "").split(",") if name]
load, find = ctypes.CDLL.__init__, ctypes.util.find_library

def init(self, name, *args, **kwargs):
    if name and any(part in os.path.basename(str(name)) for part in gone):
        raise OSError(f"{name}: cannot open shared object file: No such file or directory")
    load(self, name, *args, **kwargs)

ctypes.CDLL.__init__ = init
ctypes.util.find_library = lambda name: None if any(part in "lib" + name for part in gone) else find(name)
"""
"""A module that every process imports at its start."""
PROGRAM = """
import os, sys
import mujoco
from dh2sim.errors import PictureError
from dh2sim.draw.offscreen import open_renderer
try:
    model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    for _ in range(2):
        with open_renderer(model, 2500, 64) as renderer:
            renderer.update_scene(mujoco.MjData(model))
            used = [name for name in ("egl", "osmesa") if f"mujoco.{name}" in sys.modules]
            print(*used, renderer.render().shape)
    print(os.environ.get("MUJOCO_GL"))
except PictureError as error:
    print(error, file=sys.stderr)
"""
ADVICE = (
    ". On Debian and Ubuntu: apt install libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri (for EGL), or libosmesa6 (for "
    "OSMesa). MUJOCO_GL=egl or MUJOCO_GL=osmesa tries one of them alone\n"
)
NO_EGL = "EGL does not work (its libraries cannot be loaded)"
NO_OSMESA = "OSMesa does not work (its libraries cannot be loaded)"

needs_egl = pytest.mark.skipif(ctypes.util.find_library("EGL") is None, reason="needs libegl1")
needs_osmesa = pytest.mark.skipif(ctypes.util.find_library("OSMesa") is None, reason="needs libosmesa6")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "sitecustomize.py").write_text(WITHOUT, encoding="utf-8")
    return tmp_path


def run(folder: Path, *command: str, **variables: str) -> Outcome:
    kept = {name: value for name, value in environment().items() if name not in ("MUJOCO_GL", "PYOPENGL_PLATFORM")}
    path = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, *command],
        cwd=folder,
        env={**kept, "PYTHONPATH": path, **variables},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    return Outcome(status=done.returncode, out=done.stdout, err=done.stderr)


@needs_egl
def test_egl_is_taken_where_it_works_and_the_buffer_is_as_large_as_the_picture(folder: Path) -> None:
    done = run(folder, "-c", PROGRAM)
    assert done.out.splitlines() == ["egl (64, 2500, 3)"] * 2 + ["None"], "the environment is as it was"


@needs_osmesa
def test_osmesa_is_taken_where_egl_does_not_work(folder: Path) -> None:
    assert run(folder, "-c", PROGRAM, GONE="libEGL").out.splitlines() == ["osmesa (64, 2500, 3)"] * 2 + ["None"]


@needs_osmesa
def test_mujoco_gl_decides(folder: Path) -> None:
    done = run(folder, "-c", PROGRAM, MUJOCO_GL="osmesa")
    assert done.out.splitlines() == ["osmesa (64, 2500, 3)"] * 2 + ["osmesa"]


def test_where_nothing_renders_the_error_names_the_packages(folder: Path) -> None:
    done = run(folder, "-c", PROGRAM, GONE="libEGL,libOSMesa")
    assert done.err == f"nothing can render here without a screen: {NO_EGL}; {NO_OSMESA}{ADVICE}"
    assert (done.status, done.out) == (0, "")


@pytest.mark.parametrize(("backend", "library"), [("egl", "libEGL"), ("osmesa", "libOSMesa")])
def test_a_choice_that_does_not_work_is_not_replaced_in_silence(folder: Path, backend: str, library: str) -> None:
    done = run(folder, "-m", "dh2sim", "render", "rpr", GONE=library, MUJOCO_GL=backend)
    assert (done.status, done.out) == (2, "")
    assert done.err.startswith(f"dh2sim: MuJoCo cannot be imported with MUJOCO_GL={backend}: ")


def test_rendering_that_is_switched_off_is_reported(folder: Path) -> None:
    expected = "MUJOCO_GL=off switches rendering off; unset it, or set it to egl or osmesa\n"
    assert run(folder, "-c", PROGRAM, MUJOCO_GL="off").err == expected


def test_modules_in_the_current_folder_are_not_run(folder: Path) -> None:
    """Finding out what renders starts another Python, perhaps in a stranger's checkout."""
    (folder / "mujoco.py").write_text("import pathlib; pathlib.Path('ran').touch()\n", encoding="utf-8")
    code = "from dh2sim.draw import offscreen; offscreen._try('egl')"
    subprocess.run([sys.executable, "-P", "-c", code], cwd=folder, env=environment(), timeout=300, check=True)
    assert not (folder / "ran").exists()
