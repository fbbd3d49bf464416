"""The exported scenes, rendered for real without a screen."""

from __future__ import annotations

import ctypes.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent

RENDER = """
import sys, mujoco, numpy as np
model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 240, 320) as renderer:
    renderer.update_scene(data, camera="overview")
    picture = np.array(renderer.render())
    renderer.enable_segmentation_rendering()
    renderer.update_scene(data, camera="overview")
    ids = np.array(renderer.render())[:, :, 0]
geoms = [i for i in range(model.ngeom) if model.geom_bodyid[i] != 0]
seen = np.isin(ids, geoms)
rows, columns = np.nonzero(seen)
print(seen.mean(), rows.min(), rows.max(), columns.min(), columns.max(), picture[seen].std(), picture[~seen].mean())
"""


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["stanford", "scara", "ssrms", "puma560", "cylindrical_wrist", "spherical_wrist"])
def test_camera_frames_the_whole_robot(robot: str) -> None:
    if ctypes.util.find_library("EGL") is None:
        pytest.skip("EGL is not installed (Debian: libegl1 libegl-mesa0 libgl1-mesa-dri)")
    scene = ROOT / "generated" / robot / "scene.xml"
    done = subprocess.run(
        [sys.executable, "-c", RENDER, str(scene)],
        env={**os.environ, "MUJOCO_GL": "egl"},
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    share, top, bottom, left, right, contrast, background = (float(word) for word in done.stdout.split())
    assert 0.015 < share < 0.5, "the robot fills a good part of the picture"
    assert top > 2, "and is cut off nowhere"
    assert bottom < 237
    assert left > 2
    assert right < 317
    assert max(bottom - top, (right - left) * 0.75) > 90, "it is not small in it either"
    assert contrast > 10, "it is lit"
    assert background > 100
