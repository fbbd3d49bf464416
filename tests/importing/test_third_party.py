"""Files as other people write them: kinds that robot tools read, although they are not quite as the book says."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from dh2sim.errors import Dh2simError
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.importing.result import Imported
from dh2sim.importing.sources import ImportOptions, import_robot
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.refusals import refusal

FOLDER = Path(__file__).parent / "third_party"
Q = np.array([0.3, -0.5])

L2 = [[0.838386644, 0.458012711, 0.295520207, 0.191067298], [0.25934338, 0.141679934, -0.955336489, 0.059104041],
      [-0.479425539, 0.877582562, 0.0, 0.3]]  # fmt: skip
ROD = [[0.927643433, 0.140791463, 0.345912452, 0.161515277], [-0.014320694, 0.938947833, -0.343761378, 0.15463769],
       [-0.373192415, 0.313934279, 0.873025023, 0.35]]  # fmt: skip
SITE = [[0.838386644, -0.295520207, -0.458012711, 0.400663959], [0.25934338, 0.955336489, -0.141679934, 0.123939886],
        [0.479425539, 0.0, 0.877582562, 0.419856385]]  # fmt: skip


def _imported(name: str, **options: object) -> Imported:
    return import_robot(FOLDER / name, ImportOptions(**options))  # type: ignore[arg-type]


def _tool(spec: RobotSpec) -> Array:
    return np.asarray(table_tool_pose(spec, Q[None])[0])


@pytest.mark.parametrize(
    ("name", "T_base_tip"),
    [
        ("axis_with_rpy.urdf", L2),
        ("blank_line_before_declaration.urdf", L2),
        ("double_dash_in_comment.urdf", L2),
        ("joint_extension_element.urdf", L2),
        ("limit_extra_attribute.urdf", L2),
        ("thin_rod_inertia.urdf", ROD),
        ("xacro_leftover.urdf", L2),
        ("mjcf_position_without_kv.xml", SITE),
    ],
)
def test_the_tip_is_where_pinocchio_and_mujoco_found_it(name: str, T_base_tip: list[list[float]]) -> None:
    assert _tool(_imported(name).spec)[:3] == pytest.approx(np.array(T_base_tip), abs=1e-8)


def test_an_include_from_a_parent_folder_needs_a_wider_root() -> None:
    name = "parent_include/cell/cell.xml"
    imported = _imported(name, root=FOLDER / "parent_include")
    assert _tool(imported.spec)[:3] == pytest.approx(np.array(SITE), abs=1e-8)
    assert [(row.actuator.kp, row.actuator.kv) for row in imported.spec.rows] == [(50.0, 5.0), (30.0, 3.0)]
    assert refusal(Dh2simError, _imported, name).endswith(f"allow others with root='{FOLDER / 'parent_include'}'")
    assert refusal(Dh2simError, _imported, name, root=FOLDER / "parent_include" / "no").endswith(
        "files in and below it"
    )


def test_a_servo_without_damping_comes_out_of_the_export_without_damping() -> None:
    spec = _imported("mjcf_position_without_kv.xml").spec
    assert [(row.actuator.kp, row.actuator.kv) for row in spec.rows] == [(50.0, 0.0), (30.0, 0.0)]
    model = mujoco.MjModel.from_xml_string(to_mjcf(build_model(spec)))
    assert model.actuator_biasprm[:, :3].tolist() == [[0.0, -50.0, 0.0], [0.0, -30.0, 0.0]]
    assert model.actuator_gainprm[:, 0].tolist() == [50.0, 30.0]


def test_the_inertia_of_a_thin_rod_is_kept_and_its_robot_can_be_exported() -> None:
    imported = _imported("thin_rod_inertia.urdf")
    inertia = imported.spec.rows[1].link.inertia
    assert inertia is not None
    assert np.linalg.eigvalsh(inertia) == pytest.approx([0.0, 1e-4, 1e-4], abs=2e-12)
    assert any("thin rods" in note and "'l2'" in note for note in imported.notes)
    assert mujoco.MjModel.from_xml_string(to_mjcf(build_model(imported.spec))).njnt == 2
