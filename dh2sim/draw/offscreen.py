"""MuJoCo's renderer where there is no screen: OpenGL by way of EGL or OSMesa, whichever works.

MuJoCo takes the one that MUJOCO_GL names, without trying whether it works, and PyOpenGL stays with its first choice
for the life of a process. So each is tried in a process of its own before it is chosen.
"""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import mujoco
from mujoco.rendering.classic import gl_context

from dh2sim.errors import PictureError
from dh2sim.files import signals_deferred

OFF = ("disable", "disabled", "off", "false", "0")
"""Values of MUJOCO_GL with which MuJoCo renders nothing."""
NAMES = {"egl": "EGL", "osmesa": "OSMesa"}
ADVICE = (
    "On Debian and Ubuntu: apt install libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri (for EGL), or libosmesa6 (for "
    "OSMesa). MUJOCO_GL=egl or MUJOCO_GL=osmesa tries one of them alone"
)
TRIAL = """
import mujoco
model = mujoco.MjModel.from_xml_string("<mujoco/>")
with mujoco.Renderer(model, 8, 8) as renderer:
    renderer.update_scene(mujoco.MjData(model))
    renderer.render()
"""
PATIENCE = 60.0
"""s: a driver that takes longer does not work."""


@contextmanager
def open_renderer(model: Any, width: int, height: int, *, max_geom: int = 10_000) -> Iterator[Any]:
    """Open a ``mujoco.Renderer`` that needs no screen.

    MUJOCO_GL decides if it is set: egl, osmesa, or glfw, which needs a screen. Elsewhere than on Linux
    MuJoCo's default is taken.

    Args:
        model: ``mujoco.MjModel``; its offscreen buffer is made large enough.
        width: of the pictures, pixels.
        height: of the pictures, pixels.
        max_geom: the largest number of geoms in the scene.

    Raises:
        PictureError: nothing can render here; the text names the Debian packages to install.
    """
    backend = os.environ.get("MUJOCO_GL", "").strip().lower() or _working_backend()
    if backend in OFF:
        raise PictureError(f"MUJOCO_GL={backend} switches rendering off; unset it, or set it to egl or osmesa")
    model.vis.global_.offwidth = max(width, model.vis.global_.offwidth)
    model.vis.global_.offheight = max(height, model.vis.global_.offheight)
    try:
        # an interrupted call of a driver would look like one that does not work
        with signals_deferred(), _mujoco_gl(backend):
            renderer = mujoco.Renderer(model, height, width, max_geom)
    except Exception as error:  # a driver raises whatever it trips over
        raise PictureError(f"{_backend_failure(backend, str(error))}. {ADVICE}") from error
    with renderer:
        yield renderer


@cache
def _working_backend() -> str:
    """Return the first of EGL and OSMesa that renders; elsewhere than on Linux an empty text, for MuJoCo's default.

    Raises:
        PictureError: neither does.
    """
    if not sys.platform.startswith("linux"):
        return ""
    failures = []
    for backend in NAMES:
        reason = _try(backend)
        if reason is None:
            return backend
        failures.append(_backend_failure(backend, reason))
    raise PictureError(f"nothing can render here without a screen: {'; '.join(failures)}. {ADVICE}")


def _try(backend: str) -> str | None:
    """Render a picture in another process; return why that failed, or None."""
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-c", TRIAL],
            env={**os.environ, "MUJOCO_GL": backend},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"no picture within {PATIENCE:g} s"
    if done.returncode == 0:
        return None
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    return lines[-1].partition(": ")[2] if lines else f"exit status {done.returncode}"


def _backend_failure(backend: str, reason: str) -> str:
    """Return one line that says that a backend does not work, and why."""
    reason = " ".join(reason.split()).rstrip(" .()")
    if not reason or "'NoneType' object has no attribute" in reason:  # what PyOpenGL says of missing libraries
        reason = "its libraries cannot be loaded"
    name = NAMES.get(backend, f"MUJOCO_GL={backend}")
    return f"{name} does not work ({reason if len(reason) <= 120 else reason[:117] + '...'})"


@contextmanager
def _mujoco_gl(backend: str) -> Iterator[None]:
    """Let MuJoCo render with a backend, although it was imported with another one, or with none."""
    before = os.environ.get("MUJOCO_GL")
    if backend:
        os.environ["MUJOCO_GL"] = backend
    try:
        importlib.reload(gl_context)
        yield
    finally:
        if before is None:
            os.environ.pop("MUJOCO_GL", None)
        else:
            os.environ["MUJOCO_GL"] = before
