"""Which of EGL and OSMesa draws; each case in a process of its own, with libraries that really are not found."""

from __future__ import annotations

import ctypes.util
import subprocess
import sys

import pytest

from tests.program import Outcome, environment

PROGRAM = """
import ctypes, ctypes.util, os, sys
gone = [name for name in os.environ.get("GONE", "").split(",") if name]
load, find = ctypes.CDLL.__init__, ctypes.util.find_library

def init(self, name, *args, **kwargs):
    if name and any(part in os.path.basename(str(name)) for part in gone):
        raise OSError(f"{name}: cannot open shared object file: No such file or directory")
    load(self, name, *args, **kwargs)

ctypes.CDLL.__init__ = init
ctypes.util.find_library = lambda name: None if any(part in "lib" + name for part in gone) else find(name)
if os.environ.get("BEFORE"):
    import mujoco
from dh2sim.errors import PictureError
from dh2sim.draw import offscreen
try:
    mujoco = offscreen.import_mujoco()
    model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    for _ in range(2):
        with offscreen.gl_context(model, 2500, 64) as resources:
            print(*offscreen._working, resources.offWidth, resources.offHeight)
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


def draw(**variables: str) -> Outcome:
    before = {name: value for name, value in environment().items() if name not in ("MUJOCO_GL", "PYOPENGL_PLATFORM")}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env={**before, **variables}, capture_output=True, text=True, timeout=120
    )
    return Outcome(status=done.returncode, out=done.stdout, err=done.stderr)


@needs_egl
@pytest.mark.parametrize("before", ["", "1"], ids=["MuJoCo not imported yet", "MuJoCo imported already"])
def test_egl_is_taken_where_it_works_and_the_buffer_is_as_large_as_the_picture(before: str) -> None:
    run = draw(BEFORE=before)
    assert (run.status, run.out.splitlines()[:2]) == (0, ["egl 2500 480"] * 2), run.err
    assert run.out.splitlines()[2] == "None", "the environment is as it was"


@needs_osmesa
@pytest.mark.parametrize("before", ["", "1"], ids=["MuJoCo not imported yet", "MuJoCo imported already"])
def test_osmesa_is_taken_where_there_is_no_egl(before: str) -> None:
    run = draw(BEFORE=before, GONE="libEGL")
    assert (run.status, run.out.splitlines()) == (0, ["osmesa 2500 480"] * 2 + ["None"]), run.err


@needs_osmesa
def test_the_environment_decides_if_it_says_something() -> None:
    run = draw(MUJOCO_GL="osmesa")
    assert run.out.splitlines() == ["osmesa 2500 480"] * 2 + ["osmesa"]


def test_where_nothing_draws_the_error_names_the_packages() -> None:
    run = draw(GONE="libEGL,libOSMesa")
    assert run.err == f"nothing can draw here without a screen: {NO_EGL}; {NO_OSMESA}{ADVICE}"
    assert (run.status, run.out) == (0, "")


def test_a_choice_that_does_not_work_is_not_replaced_in_silence() -> None:
    assert draw(GONE="libEGL", MUJOCO_GL="egl").err == f"{NO_EGL}{ADVICE}"
    assert draw(GONE="libOSMesa", MUJOCO_GL="osmesa").err == f"{NO_OSMESA}{ADVICE}"


def test_drawing_that_is_switched_off_is_told() -> None:
    expected = "MUJOCO_GL=off switches drawing off; unset it, or set it to egl or osmesa\n"
    assert draw(MUJOCO_GL="off").err == expected


def test_a_value_that_mujoco_does_not_know_is_told() -> None:
    told = "MUJOCO_GL=foo does not work (invalid value for environment variable MUJOCO_GL: foo)"
    assert draw(MUJOCO_GL="foo").err == told + ADVICE
