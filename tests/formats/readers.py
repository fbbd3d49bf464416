"""What others make of an exported text; each reader fails loudly, and so does anything it complains of."""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from xml.etree.ElementTree import Element

import defusedxml.ElementTree
import mujoco
import numpy as np
import pinocchio
import yourdfpy

from dh2sim.typing import Array


def parsed(text: str) -> Element:
    """The root element."""
    root = defusedxml.ElementTree.fromstring(text)
    assert isinstance(root, Element)
    return root


def floats(element: Element | None, attribute: str) -> list[float]:
    """The numbers of an attribute that must be there."""
    assert element is not None
    return [float(word) for word in element.attrib[attribute].split()]


def normal(values: Array | float) -> list[float]:
    """Numbers as they are written: subnormal ones, which MuJoCo cannot read, as zero."""
    return [0.0 if abs(value) < sys.float_info.min else value for value in np.ravel(values).tolist()]


@contextmanager
def no_mujoco_warnings() -> Iterator[None]:
    """Fail on anything that MuJoCo warns of, at compile or at run time."""
    warnings: list[str] = []
    mujoco.set_mju_user_warning(warnings.append)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(None)
    assert warnings == []


def in_mujoco(text: str) -> mujoco.MjModel:
    """A model that was compiled without a warning; pytest makes errors of Python's warnings."""
    with no_mujoco_warnings():
        return mujoco.MjModel.from_xml_string(text)


def in_check_urdf(text: str) -> str:
    """What check_urdf, ROS's own parser, prints of a file that it has nothing against."""
    tool = shutil.which("check_urdf", path=str(Path(sys.executable).parent))
    assert tool is not None
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "robot.urdf"
        file.write_text(text, encoding="utf-8")
        done = subprocess.run([tool, str(file)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def in_yourdfpy(text: str) -> yourdfpy.URDF:
    """A robot that yourdfpy finds valid."""
    robot = yourdfpy.URDF.load(io.BytesIO(text.encode()), load_meshes=False)
    assert robot.validate()
    return robot


def in_pinocchio(text: str) -> pinocchio.Model:
    """A robot as pinocchio reads it."""
    return pinocchio.buildModelFromXML(text)


def site_poses(mj: mujoco.MjModel, q: Array, names: list[str]) -> Array:
    """Poses of sites in the world, shape (N, names, 4, 4), q of shape (N, n)."""
    return _poses(mj, q, [mj.site(name).id for name in names], "site_xpos", "site_xmat")


def body_poses(mj: mujoco.MjModel, q: Array, names: list[str]) -> Array:
    """Likewise of bodies."""
    return _poses(mj, q, [mj.body(name).id for name in names], "xpos", "xmat")


def _poses(mj: mujoco.MjModel, q: Array, ids: list[int], position: str, rotation: str) -> Array:
    data = mujoco.MjData(mj)
    poses = np.tile(np.eye(4), (len(q), len(ids), 1, 1))
    for k, row in enumerate(q):
        data.qpos[:] = row
        mujoco.mj_kinematics(mj, data)
        poses[k, :, :3, 3] = getattr(data, position)[ids]
        poses[k, :, :3, :3] = getattr(data, rotation)[ids].reshape(-1, 3, 3)
    return poses
