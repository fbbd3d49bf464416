"""The mass matrix of an MJCF's arm: of its own joints, without what others carry and without rotors."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from dh2sim.formats.mjcf.read import read_mjcf

ARM = """\
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <body name="base" pos="0 0 0.3" euler="0.2 0.3 0.1">
      <body name="upper" pos="0.1 0 0">
        <joint name="shoulder" axis="0 1 0.2" ref="0.4" armature="5"/>
        <geom type="capsule" fromto="0 0 0 0.3 0.1 0" size="0.05" mass="2"/>
        <body name="bracket" pos="0.1 0.1 0"><geom type="box" size="0.05 0.02 0.1" mass="0.7"/></body>
        <body name="lower" pos="0.3 0.1 0">
          <joint name="elbow" axis="0 0 1" pos="0.02 0 0" armature="3"/>
          <geom type="capsule" fromto="0 0 0 0.2 0 0.1" size="0.04" mass="1"/>
          <site name="tool0" pos="0.2 0 0.1"/>
          {finger}
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
FINGER = """<body name="finger" pos="0.2 0 0.1"><joint name="squeeze" type="slide" axis="1 0 0"/>
<geom type="sphere" size="0.03" mass="9"/></body>"""


def test_what_is_compared_is_the_arm_alone(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(ARM.format(finger=FINGER))
    arm = read_mjcf(path, file="arm.xml", tip="tool0")
    assert [joint.name for joint in arm.chain.joints] == ["shoulder", "elbow"]
    assert arm.mechanics is not None
    q = np.array([[0.7, -0.3], [-1.0, 2.0]])
    mass, load = arm.mechanics(q)
    model = mujoco.MjModel.from_xml_string(
        ARM.format(finger="").replace('armature="5"', "").replace('armature="3"', "")
    )
    data, full = mujoco.MjData(model), np.zeros((2, 2))
    for k, row in enumerate(q):
        data.qpos[:] = row
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, full)
        np.testing.assert_allclose(mass[k], full, rtol=0, atol=1e-12)
        np.testing.assert_allclose(load[k], data.qfrc_bias, rtol=0, atol=1e-12)


def test_a_rotor_that_spins_in_place_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "wheel.xml"
    path.write_text(
        '<mujoco><worldbody><body name="wheel"><joint name="spin" axis="0 0 1" armature="5"/>'
        '<geom type="cylinder" size="0.2 0.05" mass="2"/></body></worldbody></mujoco>'
    )
    arm = read_mjcf(path, file="wheel.xml")
    assert arm.mechanics is not None
    np.testing.assert_allclose(arm.mechanics(np.zeros((1, 1)))[0], [[[2 * 0.2**2 / 2]]], rtol=1e-12)
