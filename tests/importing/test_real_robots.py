"""Third-party robots, from packages that may be installed: from file to table and back.

What stands against the import reads the same files by itself: pinocchio and MuJoCo.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from dh2sim.formats.urdf.write import to_urdf
from dh2sim.importing.result import Imported
from dh2sim.importing.sources import ImportOptions, import_robot
from dh2sim.model.build import build_model
from dh2sim.robot.read import parse_robot
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from scripts.real_arms.arm import TOLERANCE, Arm
from scripts.real_arms.arms import ARMS, IIWA, IIWA_OFFSET, PANDA, UR5, XARM6, XARM7
from scripts.real_arms.packages import installed
from scripts.real_arms.reading import joint_vectors, poses_from_file

CONFIGURATIONS = 20
every_arm = pytest.mark.parametrize("arm", ARMS, ids=[arm.key for arm in ARMS])
every_urdf = pytest.mark.parametrize(
    "arm", [arm for arm in ARMS if arm.file.endswith(".urdf")], ids=[a.key for a in ARMS if a.file.endswith(".urdf")]
)


def file_of(arm: Arm) -> Path:
    root = installed(arm.package)
    if root is None:
        pytest.skip(f"{arm.package.name} {arm.package.version} is not installed")
    return arm.path(root)


@functools.cache
def imported_arm(arm: Arm) -> Imported:
    return import_robot(file_of(arm), arm.options)


def as_urdf(arm: Arm, folder: Path) -> Path:
    path = folder / "arm.urdf"
    path.write_text(to_urdf(build_model(parse_robot(imported_arm(arm).text))), encoding="utf-8")
    return path


def file_joints(arm: Arm) -> list[str]:
    chain = imported_arm(arm).chain
    assert chain is not None
    return [joint.name for joint in chain.joints]


@pytest.mark.slow
@every_arm
def test_an_arm_has_a_table_within_the_tolerance(arm: Arm) -> None:
    residual = imported_arm(arm).residual
    assert residual is not None
    assert residual.configurations == 1000
    assert residual.largest <= arm.tolerance


@every_arm
def test_an_arm_runs_from_the_named_base_to_the_named_tip(arm: Arm) -> None:
    imported = imported_arm(arm)
    assert f", from {arm.base} to {arm.tip} (SHA-256 " in imported.spec.source
    assert [row.name for row in imported.spec.rows] == file_joints(arm)


@pytest.mark.slow
@every_arm
def test_rows_are_of_the_wanted_convention_but_where_axes_are_nearly_parallel(arm: Arm) -> None:
    rows = imported_arm(arm).spec.rows
    assert tuple(row.name for row in rows if row.convention is Convention.HAYATI) == arm.hayati
    assert {row.convention for row in rows} <= {arm.convention, Convention.HAYATI}


@pytest.mark.slow
@every_arm
def test_the_table_as_a_urdf_puts_the_tool_where_others_find_the_tip_in_the_file(arm: Arm, tmp_path: Path) -> None:
    spec = imported_arm(arm).spec
    q = joint_vectors(spec, CONFIGURATIONS)
    expected = poses_from_file(file_of(arm), arm.base, arm.tip, file_joints(arm), q)
    tool = poses_from_file(as_urdf(arm, tmp_path), "base_link", "tool0", [row.name for row in spec.rows], q)
    np.testing.assert_allclose(tool, expected, rtol=0, atol=arm.tolerance)


@every_urdf
def test_limits_are_those_that_pinocchio_reads(arm: Arm) -> None:
    model = pin.buildModelFromXML(file_of(arm).read_text(encoding="utf-8"))
    rows = imported_arm(arm).spec.rows
    for row, name in zip(rows, file_joints(arm), strict=True):
        joint = model.joints[model.getJointId(name)]
        if row.limits.position is not None:
            expected = (model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q])
            assert row.limits.position == pytest.approx(expected, abs=arm.tolerance)
        if row.limits.velocity is not None:
            assert row.limits.velocity == pytest.approx(model.upperVelocityLimit[joint.idx_v])
        if row.limits.effort is not None:
            assert row.limits.effort == pytest.approx(model.upperEffortLimit[joint.idx_v])


def weights(path: Path, base: str, joints: list[str], q: Array) -> list[Any]:
    """Mass, centre of mass and inertia of every moving link, in the base, by pinocchio."""
    model = pin.buildModelFromXML(path.read_text(encoding="utf-8"))
    data = model.createData()
    configuration = pin.neutral(model)
    for name, value in zip(joints, q.tolist(), strict=True):
        joint = model.joints[model.getJointId(name)]
        turned = (math.cos(value), math.sin(value)) if joint.nq == 2 else (value,)
        configuration[joint.idx_q : joint.idx_q + joint.nq] = turned
    pin.framesForwardKinematics(model, data, configuration)
    T_base_world = data.oMf[model.getFrameId(base, pin.FrameType.BODY)].inverse()
    ids = [model.getJointId(name) for name in joints]
    return [(T_base_world * data.oMi[i]).act(model.inertias[i]) for i in ids]


@pytest.mark.slow
@every_urdf
def test_every_link_weighs_what_it_weighs_in_the_file_and_where_it_is_there(arm: Arm, tmp_path: Path) -> None:
    rows = imported_arm(arm).spec.rows
    q = joint_vectors(imported_arm(arm).spec, 1)[0]
    expected = weights(file_of(arm), arm.base, file_joints(arm), q)
    found = weights(as_urdf(arm, tmp_path), "base_link", [row.name for row in rows], q)
    changed = any("mpossible inertias" in note for note in imported_arm(arm).notes)
    for row, own, theirs in zip(rows, found, expected, strict=True):
        if row.link.mass is None:  # not in the file; estimated from the shapes
            continue
        assert own.mass == pytest.approx(theirs.mass, rel=1e-12)
        np.testing.assert_allclose(own.lever, theirs.lever, rtol=0, atol=10 * arm.tolerance)
        if row.link.inertia is not None and not changed:
            atol = 10 * arm.tolerance * np.trace(theirs.inertia)
            np.testing.assert_allclose(own.inertia, theirs.inertia, rtol=0, atol=atol)


Numbers = tuple[float, float, float, float]


def table(spec: RobotSpec) -> list[Numbers]:
    """a, alpha in degrees, d, theta in degrees: as a publication has them."""
    return [(row.a, math.degrees(row.alpha), row.d, math.degrees(row.theta)) for row in spec.rows]


def assert_table(spec: RobotSpec, expected: Sequence[Numbers]) -> None:
    np.testing.assert_allclose(table(spec), expected, rtol=0, atol=1e-12)
    for pose in (spec.base.pose, spec.tool):
        np.testing.assert_array_equal([*pose.xyz, *pose.rpy], np.zeros(6))


def test_the_panda_has_the_table_of_franka_robotics() -> None:
    expected = [
        (0, 0, 0.333, 0),
        (0, -90, 0, 0),
        (0, 90, 0.316, 0),
        (0.0825, 90, 0, 0),
        (-0.0825, -90, 0.384, 0),
        (0, 90, 0, 0),
        (0.088, 90, 0.107, 0),  # with the flange, which has a row of its own there
    ]
    assert_table(imported_arm(PANDA).spec, expected)


def iiwa_14(flange: float, offset: float = 0.0) -> list[Numbers]:
    return [
        (0, 0, 0.36, 0),
        (-offset, -90, 0, 0),
        (0, 90, 0.42, 0),
        (offset, 90, 0, 0),
        (0, -90, 0.4, 0),
        (0, -90, 0, 0),
        (0, 90, flange, 0),
    ]


def test_the_iiwa_has_the_published_table_up_to_where_its_file_ends() -> None:
    assert_table(imported_arm(IIWA).spec, iiwa_14(flange=0.081))


def test_the_iiwa_whose_axes_do_not_meet_has_the_published_table_but_for_that() -> None:
    assert_table(imported_arm(IIWA_OFFSET).spec, iiwa_14(flange=0.126, offset=0.00043624))


def test_in_the_standard_convention_the_iiwa_has_the_twists_of_the_literature() -> None:
    spec = import_robot(file_of(IIWA_OFFSET), ImportOptions(convention=Convention.STANDARD)).spec
    assert [round(math.degrees(row.alpha), 9) for row in spec.rows] == [-90, 90, 90, -90, -90, 90, 0]
    assert [row.d for row in spec.rows] == [0.36, 0, 0.42, 0, 0.4, 0, 0.126]


def test_the_ur5_has_the_numbers_of_universal_robots_with_every_x_turned_round() -> None:
    expected = [
        (0, -90, 0.089159, 0),
        (0.425, 0, 0, 0),
        (0.39225, 0, 0, 0),
        (0, -90, 0.10915, 0),
        (0, 90, 0.09465, 0),
        (0, 0, 0.0823, 180),
    ]
    assert_table(imported_arm(UR5).spec, expected)


def test_the_xarm6_has_the_table_of_ufactory_with_the_tolerance_that_its_rounded_angles_need() -> None:
    elbow = math.degrees(math.atan(284.5 / 53.5))
    expected = [
        (0, -90, 0.267, 0),
        (math.sqrt(284.5**2 + 53.5**2) / 1000, 0, 0, -elbow),
        (0.0775, -90, 0, elbow),
        (0, 90, 0.3425, 0),
        (0.076, -90, 0, 0),
        (0, 0, 0.097, 0),
    ]
    np.testing.assert_allclose(table(imported_arm(XARM6).spec), expected, rtol=0, atol=1e-9)


def test_the_xarm7_has_the_table_of_ufactory() -> None:
    expected = [
        (0, -90, 0.267, 0),
        (0, 90, 0, 0),
        (0.0525, 90, 0.293, 0),
        (0.0775, 90, 0, 0),
        (0, 90, 0.3425, 0),
        (0.076, -90, 0, 0),
        (0, 0, 0.097, 0),
    ]
    assert_table(imported_arm(XARM7).spec, expected)


def test_nearly_parallel_axes_are_noted_and_vanish_with_a_tolerance_that_has_room_for_them() -> None:
    strict, loose = (arm for arm in ARMS if arm.robot == "Lynxmotion AL5D")
    assert (strict.tolerance, loose.tolerance) == (TOLERANCE, 1e-7)
    parallel = [note for note in imported_arm(strict).notes if "nearly parallel" in note]
    assert [note.partition(",")[0] for note in parallel] == [
        "The axes of j2 and j3 are nearly parallel",
        "The axes of j3 and j4 are nearly parallel",
    ]
    assert not any("nearly parallel" in note for note in imported_arm(loose).notes)
