"""Masses and inertias that stand for nothing in a file."""

from __future__ import annotations

from pathlib import Path

from dh2sim import build_model, parse_robot, to_urdf
from dh2sim.importing.sources import import_robot

URDF = """\
<robot name="r">
  <link name="a"/>
  <link name="b">
    <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="j" type="continuous">
    <parent link="a"/><child link="b"/><origin xyz="1 0 3" rpy="0.3 0 0"/><axis xyz="0 0 1"/>
  </joint>
</robot>
"""


def test_a_link_that_weighs_nothing_weighs_nothing_after_an_export_and_an_import(tmp_path: Path) -> None:
    text = "name: r\nconvention: standard\njoints:\n  - {type: R, link: {mass: 0}}\n  - {type: R, a: 1}\n"
    path = tmp_path / "r.urdf"
    path.write_text(to_urdf(build_model(parse_robot(text))))
    imported = import_robot(path)
    assert imported.spec.rows[0].link.mass == 0.0
    assert any("'link_1' (2e-14)" in note for note in imported.notes)


def test_the_inertia_of_a_placeholder_becomes_one_that_simulators_read(tmp_path: Path) -> None:
    path = tmp_path / "r.urdf"
    path.write_text(URDF.replace('ixx="1" iyy="1" izz="1"', 'ixx="1e-20" iyy="1e-20" izz="1e-20"'))
    imported = import_robot(path)
    assert "Inertias of less than 2e-14 kg·m² are made greater by that, of links 'b'." in imported.notes
    inertia = imported.spec.rows[0].link.inertia
    assert inertia is not None
    assert min(inertia.diagonal()) >= 2e-14
