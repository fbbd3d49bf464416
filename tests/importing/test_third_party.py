"""Files as other people write them: kinds that robot tools read, although they are not quite as the book says."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from dh2sim.errors import Dh2simError
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.importing.result import Imported
from dh2sim.importing.sources import ImportOptions, import_robot
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot_facade import Robot
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


def _mass_matrix(text: str, q: Array) -> Array:
    compiled = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(compiled)
    data.qpos[:] = q
    mujoco.mj_forward(compiled, data)
    M = np.zeros((compiled.nv, compiled.nv))
    mujoco.mj_fullM(compiled, data, M)
    return M


def test_several_joints_on_a_body_get_no_mass_between_them() -> None:
    imported = _imported("three_joints_on_a_body.xml")
    built = build_model(imported.spec)
    assert built.mass == 20.0
    assert [link.inertial is None for link in built.links] == [True, True, False]
    assert built.estimates == ()
    np.testing.assert_allclose(
        _mass_matrix(to_mjcf(built), np.zeros(3)), np.diag([20, 20, 0.8]), rtol=1e-12, atol=1e-14
    )
    q = np.array([0.3, -0.5, 0.2])
    source = (FOLDER / "three_joints_on_a_body.xml").read_text(encoding="utf-8")
    np.testing.assert_allclose(_mass_matrix(to_mjcf(built), q), _mass_matrix(source, q), rtol=1e-9, atol=1e-12)
    assert "Links without a mass weigh nothing, where something behind them has mass." in imported.notes


def test_a_link_that_two_joints_hang_on_gets_no_mass() -> None:
    built = build_model(_imported("massless_dummy_link.urdf").spec)
    assert built.mass == 0.3
    M = _mass_matrix(to_mjcf(built), np.zeros(2))
    np.testing.assert_allclose(M, np.diag([0.0753, 0.0033]), rtol=1e-9, atol=1e-12)
    exported = mujoco.MjModel.from_xml_string(to_urdf(built))
    assert exported.nv == 2
    assert Robot.from_spec(built.spec).validate(samples=5).ok


def test_links_at_the_end_without_mass_are_estimated_and_noted(tmp_path: Path) -> None:
    text = (FOLDER / "massless_dummy_link.urdf").read_text(encoding="utf-8")
    beyond = (
        '<link name="hand"/><joint name="twist" type="continuous"><parent link="tip"/><child link="hand"/></joint>'
    )
    file = tmp_path / "hand.urdf"
    file.write_text(text.replace("</robot>", beyond + "</robot>"), encoding="utf-8")
    imported = import_robot(file, ImportOptions())
    assert [row.link.mass for row in imported.spec.rows] == [0.0, 0.3, None]
    note = "The masses of the last links are estimated, as nothing behind them has any: 'hand'."
    assert note in imported.notes
    assert build_model(imported.spec).mass > 0.3


def test_a_file_without_any_masses_is_estimated_as_a_whole(tmp_path: Path) -> None:
    text = (FOLDER / "massless_dummy_link.urdf").read_text(encoding="utf-8")
    start, end = text.index("<inertial>"), text.index("</inertial>") + len("</inertial>")
    file = tmp_path / "bare.urdf"
    file.write_text(text[:start] + text[end:], encoding="utf-8")
    assert [row.link.mass for row in import_robot(file, ImportOptions()).spec.rows] == [None, None]
