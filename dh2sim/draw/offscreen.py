"""Something to draw with where there is no screen: OpenGL by way of EGL or OSMesa, whichever works.

MuJoCo takes its choice from MUJOCO_GL when it is imported, without trying whether it works. Here each is tried for
real, at the first picture, whether MuJoCo is imported already or not.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

from dh2sim.errors import PictureError

PACKAGES = "libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri"
"""Debian's packages for EGL without a graphics card."""
PACKAGES_OSMESA = "libosmesa6"
OFF = ("disable", "disabled", "off", "false", "0")
"""Values of MUJOCO_GL with which MuJoCo draws nothing."""
_NAMES = {"egl": "EGL", "osmesa": "OSMesa"}

_working: list[str] = []
"""The backend that drew the last picture: it is the first to be tried again."""


def import_mujoco() -> ModuleType:
    """Import MuJoCo, which fails if MUJOCO_GL names what it does not know or cannot load.

    Raises:
        PictureError: it does.
    """
    try:
        return importlib.import_module("mujoco")
    except Exception as error:
        chosen = os.environ.get("MUJOCO_GL")
        if not chosen:
            raise
        raise PictureError(f"{_refused(chosen, error)}. {_advice()}") from error


@contextmanager
def gl_context(model: Any, width: int, height: int) -> Iterator[Any]:
    """Make an OpenGL context without a screen, and MuJoCo's resources for a model in it.

    MUJOCO_GL decides if it is set: egl, osmesa, glfw (which needs a screen). Elsewhere than on Linux MuJoCo's default
    is taken.

    Args:
        model: the compiled model; its offscreen buffer is made large enough.
        width: of the pictures, pixels.
        height: of the pictures, pixels.

    Yields:
        A ``mujoco.MjrContext``, current in this thread.

    Raises:
        PictureError: nothing works here; the text names the Debian packages.
    """
    mujoco = import_mujoco()
    chosen = os.environ.get("MUJOCO_GL", "").strip().lower()
    if chosen in OFF:
        raise PictureError(f"MUJOCO_GL={chosen} switches drawing off; unset it, or set it to egl or osmesa")
    model.vis.global_.offwidth = max(width, model.vis.global_.offwidth)
    model.vis.global_.offheight = max(height, model.vis.global_.offheight)
    failures: list[str] = []
    for backend in _candidates(chosen):
        try:
            context, resources = _open(mujoco, backend, model, width, height)
        except Exception as error:  # whatever a driver makes of it, another may work
            failures.append(_refused(backend, error))
            _forget()
            continue
        _working[:] = [backend]
        try:
            yield resources
        finally:
            resources.free()
            context.free()
        return
    raise PictureError(f"nothing can draw here without a screen: {'; '.join(failures)}. {_advice()}")


def _candidates(chosen: str) -> list[str]:
    if not sys.platform.startswith("linux"):
        return ["default"]
    if chosen:
        return [chosen]
    return [*_working, *(name for name in ("egl", "osmesa") if name not in _working)]


def _open(mujoco: ModuleType, backend: str, model: Any, width: int, height: int) -> tuple[Any, Any]:
    if backend == "default":
        module = importlib.import_module("mujoco.rendering.classic.gl_context")
    else:
        module = importlib.import_module(f"mujoco.{backend if backend in _NAMES else 'glfw'}")
    context = module.GLContext(width, height)
    try:
        context.make_current()
        with _told(backend):
            resources = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, resources)
        if resources.currentBuffer != mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value:
            resources.free()
            raise RuntimeError("no offscreen buffer")
    except BaseException:
        context.free()
        raise
    return context, resources


@contextmanager
def _told(backend: str) -> Iterator[None]:
    """Tell MuJoCo where to look OpenGL's functions up; it reads the environment."""
    before = os.environ.get("MUJOCO_GL")
    if backend in _NAMES:
        os.environ["MUJOCO_GL"] = backend
    try:
        yield
    finally:
        if before is None:
            os.environ.pop("MUJOCO_GL", None)
        else:
            os.environ["MUJOCO_GL"] = before


def _forget() -> None:
    """Unload PyOpenGL, which chooses its platform once, so that it may choose another one."""
    for name in [name for name in sys.modules if name.partition(".")[0] == "OpenGL"]:
        del sys.modules[name]
    for name in ("mujoco.egl", "mujoco.egl.egl_ext", "mujoco.osmesa"):
        sys.modules.pop(name, None)
    if _chose_platform:
        os.environ.pop("PYOPENGL_PLATFORM", None)


_chose_platform = "PYOPENGL_PLATFORM" not in os.environ
"""Whether PYOPENGL_PLATFORM was not the user's but, if it is set now, MuJoCo's."""


def _refused(backend: str, error: Exception) -> str:
    """Say that a backend does not work, and why, in one line."""
    try:
        told = " ".join(str(error).split()).rstrip(" .()")
    except Exception:  # PyOpenGL's errors have no text if their library is missing
        told = ""
    if not told or "'NoneType' object has no attribute" in told:
        told = "its libraries cannot be loaded"
    name = _NAMES.get(backend, f"MUJOCO_GL={backend}")
    return f"{name} does not work ({told if len(told) <= 120 else told[:117] + '...'})"


def _advice() -> str:
    return (
        f"On Debian and Ubuntu: apt install {PACKAGES} (for EGL), or {PACKAGES_OSMESA} (for OSMesa). MUJOCO_GL=egl "
        "or MUJOCO_GL=osmesa tries one of them alone"
    )
