"""What is wrong with a robot that was made of a file is reported at that file; what need not be kept is left out."""

from __future__ import annotations

from pathlib import Path

import pytest

from dh2sim.errors import ImportedFileError
from dh2sim.importing.result import Imported
from dh2sim.importing.sources import ImportOptions, import_robot
from dh2sim.robot.row import Convention
from tests.refusals import refusal

URDF = """<robot name="r"><link name="b"/>
<link name="one"><inertial><mass value="{mass}"/>
<inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link><link name="two"/>
<joint name="j1" type="revolute"><parent link="b"/><child link="one"/><origin xyz="0.1 0.1 0.2" rpy="0.7 0.3 0.2"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="{upper}" effort="{effort}" velocity="{velocity}"/></joint>

  <joint name="j2" type="revolute"><parent link="one"/><child link="two"/><origin xyz="{y} 0.1 0.2"/>
<axis xyz="0 0.6 0.8"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>
"""
PLAIN = {"mass": "1", "y": "0.1", "upper": "1", "effort": "1", "velocity": "1"}


def imported(path: Path, text: str) -> Imported:
    path.write_text(text)
    return import_robot(path, ImportOptions(convention=Convention.STANDARD))


def refused(path: Path, text: str) -> list[str]:
    return refusal(ImportedFileError, imported, path, text).splitlines()


def test_a_length_that_a_robot_cannot_have_is_reported_at_the_joint_of_the_urdf(tmp_path: Path) -> None:
    path = tmp_path / "far.urdf"
    lines = refused(path, URDF.format(**{**PLAIN, "y": "3e9"}))
    assert any(line.startswith(f"{path}:7:3: joint[j2].") or ":4:1: joint[j1]." in line for line in lines)
    for line in lines:
        assert line.startswith(f"{path}:")
        assert "must be from -1e6 to 1e6 m, found " in line


def test_a_number_that_a_robot_cannot_have_is_reported_at_the_row_of_the_table(tmp_path: Path) -> None:
    path = tmp_path / "far.md"
    head = "| a [m] | alpha [rad] | d [m] | theta [rad] |\n|---|---|---|---|\n"
    assert refused(path, f"{head}| 1 | 1e7 | 0 | q1 |\n| 1e9 | 1 | 0 | q2 |\n") == [
        f"{path}:3:3: row 1, alpha: must be from -1e6 to 1e6 rad, found 10000000.0",
        f"{path}:4:3: row 2, a: must be from -1e6 to 1e6 m, found 1000000000.0",
    ]


def test_a_number_that_a_robot_cannot_have_is_reported_with_the_calibration(tmp_path: Path) -> None:
    path = tmp_path / "far.yaml"
    poses = "".join(f"  joint_{i}: {{x: 1e9, y: 0, z: 0.1, roll: 0.1, pitch: 0, yaw: 0}}\n" for i in range(3))
    lines = refused(path, f"kinematics:\n{poses}")
    assert [line.partition(": ")[0] for line in lines] == [f"{path}:{line}:16" for line in (2, 3, 4)]
    assert all("must be from -1e6 to 1e6" in line for line in lines)


def test_gravity_that_a_robot_cannot_have_is_reported_with_the_mjcf(tmp_path: Path) -> None:
    path = tmp_path / "heavy.xml"
    body = '<body name="one"><joint name="j1"/><geom size="0.1"/></body>'
    text = f'<mujoco><option gravity="0 0 -1e9"/><worldbody><body name="b">{body}</body></worldbody></mujoco>'
    assert refused(path, text) == [f"{path}:1:1: gravity[2]: must be from -1e6 to 1e6 m/s², found -1000000000.0"]


@pytest.mark.parametrize(
    ("key", "value", "note"),
    [
        ("upper", "1e16", "Left out, as a robot cannot have such a limit: that of 'j1' (1e+16)."),
        ("velocity", "1e9", "Left out, as a robot cannot have such a limit of velocity: that of 'j1' (1e+09)."),
        ("effort", "1e-30", "Left out, as a robot cannot have such an effort: that of 'j1' (1e-30)."),
        ("mass", "1e40", "Left out, as a robot cannot have such a mass: that of 'one' (1e+40)."),
        ("mass", "1e-30", "Left out, as a robot cannot have such a mass: that of 'one' (1e-30)."),
    ],
)
def test_what_files_give_without_bound_is_left_out_and_noted(tmp_path: Path, key: str, value: str, note: str) -> None:
    found = imported(tmp_path / "odd.urdf", URDF.format(**{**PLAIN, key: value}))
    assert note in found.notes
    row = found.spec.rows[0]
    limits = row.limits
    kept = {"upper": limits.position, "velocity": limits.velocity, "effort": limits.effort, "mass": row.link.mass}
    assert kept.pop(key) is None
    assert None not in kept.values()
