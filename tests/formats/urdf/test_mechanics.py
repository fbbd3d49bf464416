"""Mass matrix and gravity forces composed from a URDF are those of pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest

from dh2sim.formats.urdf.mechanics import urdf_mechanics
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.formats.xml_read import parse_xml
from dh2sim.typing import Array
from tests.formats.urdf.samples import read
from tests.sample_robots import in_limits, model

GRIPPER = """\
<robot name="gripper">
  <link name="base"/>
  <link name="arm">
    <inertial>
      <origin xyz="0.2 0.03 -0.1" rpy="0.4 -0.7 1.1"/>
      <mass value="3"/>
      <inertia ixx="0.03" iyy="0.02" izz="0.04" ixy="0.002" ixz="-0.001" iyz="0.003"/>
    </inertial>
  </link>
  <link name="palm"><inertial><origin xyz="0 0 0.05"/><mass value="0.4"/>
    <inertia ixx="1e-3" iyy="1e-3" izz="2e-3" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="finger"><inertial><mass value="7"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tip"/>
  <joint name="turn" type="revolute">
    <origin xyz="0.1 0.2 0.3" rpy="0.3 1.2 -0.4"/><parent link="base"/><child link="arm"/>
    <axis xyz="1 2 -2"/><limit lower="-2" upper="2" effort="9" velocity="1"/>
  </joint>
  <joint name="slide" type="prismatic">
    <origin xyz="0.1 0.2 0.3" rpy="0.3 0.2 -0.4"/><parent link="arm"/><child link="palm"/>
    <axis xyz="0 -1 1"/><limit lower="0" upper="1" effort="9" velocity="1"/>
  </joint>
  <joint name="squeeze" type="prismatic">
    <parent link="palm"/><child link="finger"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.04" effort="9" velocity="1"/>
  </joint>
  <joint name="end" type="fixed"><origin xyz="0 0 0.1"/><parent link="palm"/><child link="tip"/></joint>
</robot>
"""


def by_pinocchio(text: str, q: Array) -> tuple[Array, Array]:
    pin = pinocchio.buildModelFromXML(text)
    data = pin.createData()
    masses, loads = [], []
    for row in q:
        values = [
            [np.cos(value), np.sin(value)] if joint.nq == 2 else [value]
            for joint, value in zip(list(pin.joints)[1:], row, strict=True)
        ]
        configuration = np.concatenate(values)
        upper = np.triu(pinocchio.crba(pin, data, configuration))
        masses.append(upper + np.triu(upper, 1).T)
        loads.append(pinocchio.computeGeneralizedGravity(pin, data, configuration))
    return np.array(masses), np.array(loads)


@pytest.mark.parametrize("name", ["odd", "stanford", "puma560", "ssrms"])
def test_a_composed_mass_matrix_is_that_of_pinocchio(name: str) -> None:
    built = model(name)
    text = to_urdf(built)
    q = in_limits(built, 5, seed=41)
    found = urdf_mechanics(parse_xml(text.encode(), file="a.urdf"), [joint.name for joint in built.moving_joints])(q)
    for ours, theirs in zip(found, by_pinocchio(text, q), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12 * np.abs(theirs).max())


def test_what_another_joint_carries_is_left_out_and_axes_may_have_any_length() -> None:
    q = np.array([[0.7, 0.3], [-1.2, 0.8]])
    arm = read(GRIPPER, tip="tip")
    assert arm.mechanics is not None
    without = GRIPPER.replace('<mass value="7"/>', '<mass value="0"/>').replace(
        'ixx="1" iyy="1" izz="1"', 'ixx="0" iyy="0" izz="0"'
    )
    mass, load = by_pinocchio(without, np.column_stack((q, np.zeros(2))))
    found = arm.mechanics(q)
    np.testing.assert_allclose(found[0], mass[:, :2, :2], rtol=0, atol=1e-13)
    np.testing.assert_allclose(found[1], load[:, :2], rtol=0, atol=1e-12)
    heavy, _ = by_pinocchio(GRIPPER, np.column_stack((q, np.zeros(2))))
    assert np.abs(found[0] - heavy[:, :2, :2]).max() > 1.0
