"""Robots from makers' calibration files: the geometry is the file's, all else the nominal robot's."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pytest

from dh2sim import Robot
from dh2sim.errors import Dh2simError
from dh2sim.importing.result import Imported
from dh2sim.importing.sources import ImportOptions, import_data
from dh2sim.kinematics.far_frames import far_frames
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.kinematics.transforms import pose_from_rpy
from dh2sim.model.build import build_model
from dh2sim.robot.links import LinkSpec, MeshSpec, Pose, ToolSpec
from dh2sim.robot.read import load_robot
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.refusals import refusal

Poses: TypeAlias = Sequence[tuple[float, ...]]
"""x, y, z, roll, pitch and yaw of each joint in the one before, m and rad."""
LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
SEEDS = range(4)


def turned(axis: int, angle: float) -> Array:
    """A rotation about x, y or z, as a homogeneous matrix."""
    T = np.eye(4)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    T[i, i] = T[j, j] = math.cos(angle)
    T[i, j], T[j, i] = -math.sin(angle), math.sin(angle)
    return T


def matrix(x: float, y: float, z: float, roll: float, pitch: float, yaw: float) -> Array:
    """A pose as ROS writes it: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    T = turned(2, yaw) @ turned(1, pitch) @ turned(0, roll)
    T[:3, 3] = x, y, z
    return T


def calibrated_poses(nominal: Poses, seed: int) -> Poses:
    """Poses of joints as calibration finds them: some tenths of a millimetre and milliradians off."""
    rng = np.random.default_rng(seed)
    return [
        tuple(value + rng.normal(scale=3e-4 if k < 3 else 1.5e-3) for k, value in enumerate(pose)) for pose in nominal
    ]


def tip_of(poses: Poses, joints: int, q: Array) -> Array:
    """The product of the file's transforms, each joint turning about its own z."""
    T = np.eye(4)
    for i, pose in enumerate(poses):
        T = T @ matrix(*pose)
        if i < joints:
            T = T @ turned(2, float(q[i]))
    return T


UR5E: Poses = [  # as in the maker's description
    (0, 0, 0.1625, 0, 0, 0),
    (0, 0, 0, math.pi / 2, 0, 0),
    (-0.425, 0, 0, 0, 0, 0),
    (-0.3922, 0, 0.1333, 0, 0, 0),
    (0, -0.0997, 0, math.pi / 2, 0, 0),
    (0, 0.0996, 0, math.pi / 2, math.pi, math.pi),
]
PANDA: Poses = [
    (0, 0, 0.333, 0, 0, 0),
    (0, 0, 0, -math.pi / 2, 0, 0),
    (0, -0.316, 0, math.pi / 2, 0, 0),
    (0.0825, 0, 0, math.pi / 2, 0, 0),
    (-0.0825, 0.384, 0, -math.pi / 2, 0, 0),
    (0, 0, 0, math.pi / 2, 0, 0),
    (0.088, 0, 0, math.pi / 2, 0, 0),
    (0, 0, 0.107, 0, 0, 0),
]


def written(pose: tuple[float, ...]) -> str:
    return ", ".join(
        f"{key}: {value!r}" for key, value in zip(("x", "y", "z", "roll", "pitch", "yaw"), pose, strict=True)
    )


def ur_file(poses: Poses) -> bytes:
    lines = (f"  {link}: {{{written(pose)}}}\n" for link, pose in zip(LINKS, poses, strict=True))
    return f"kinematics:\n{''.join(lines)}  hash: calib_42\n".encode()


def franka_file(poses: Poses) -> bytes:
    return "".join(f"joint{i}:\n  kinematic: {{{written(p)}}}\n" for i, p in enumerate(poses, start=1)).encode()


def made(data: bytes, file: str = "my_arm.yaml", **options: Any) -> Imported:
    return import_data(data, file, ImportOptions(**options))


def worst(spec: RobotSpec, poses: Poses, joints: int) -> float:
    q = np.random.default_rng(9).uniform(-3, 3, (50, joints))
    expected = np.array([tip_of(poses, joints, row) for row in q])
    return float(np.abs(table_tool_pose(spec, q) - expected).max())


def farthest(spec: RobotSpec) -> float:
    q = np.random.default_rng(5).uniform(-3, 3, (100, len(spec.rows)))
    return float(np.linalg.norm(table_frame_poses(spec, q)[..., :3, 3], axis=-1).max())


@pytest.mark.parametrize("nominal", [None, "ur5e"])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_ur_file_of_poses_becomes_the_robot_that_it_describes(seed: int, nominal: str | None) -> None:
    poses = calibrated_poses(UR5E, seed)
    imported = made(ur_file(poses), nominal=nominal)
    assert worst(imported.spec, poses, 6) < 1e-9
    assert imported.residual is not None
    assert imported.residual.largest < 1e-9
    assert farthest(imported.spec) < 1.4
    assert not far_frames(imported.spec).frames
    assert "calib_42" in imported.spec.source


@pytest.mark.parametrize("nominal", [None, "franka_panda"])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_franka_file_becomes_the_robot_that_it_describes(seed: int, nominal: str | None) -> None:
    poses = calibrated_poses(PANDA, seed)
    imported = made(franka_file(poses), nominal=nominal)
    assert worst(imported.spec, poses, 7) < 1e-9
    assert "joint8 does not move: it leads to tool0." in imported.notes
    assert farthest(imported.spec) < 1.5
    conventions = {row.convention for row in imported.spec.rows}
    assert conventions <= {Convention.STANDARD if nominal is None else Convention.MODIFIED}


def test_a_franka_file_without_a_flange_ends_where_the_nominal_tool_is() -> None:
    imported = made(franka_file(PANDA[:7]), nominal="franka_panda")
    assert worst(imported.spec, PANDA, 7) < 1e-9
    assert worst(made(franka_file(PANDA[:7])).spec, PANDA[:7], 7) < 1e-9


@pytest.mark.parametrize("seed", SEEDS)
def test_deltas_are_added_to_the_nominal_table(seed: int) -> None:
    """Against the textbook product of the sums, where frames are tens and hundreds of metres out."""
    nominal = load_robot("ur5e")
    rng = np.random.default_rng(seed)
    small = rng.normal(scale=2e-4, size=(4, 6))
    theta, a, d, alpha = (list(map(float, row)) for row in small)
    far, sideways = (float(value) for value in rng.uniform(20, 300, 2))
    d[1], d[2], d[3] = d[1] + far, d[2] - far - sideways, d[3] + sideways
    # tilts that lead back from so far out
    alpha[1], alpha[2] = 1e-3 / far, 1e-3 / sideways
    data = "[mounting]\n" + "".join(
        f"delta_{name} = {values!r}\n"
        for name, values in zip(("theta", "a", "d", "alpha"), (theta, a, d, alpha), strict=True)
    )
    imported = made(data.encode(), "calibration.conf", nominal="ur5e")
    rows = list(zip(nominal.rows, theta, a, d, alpha, strict=True))
    for q in rng.uniform(-3, 3, (30, 6)):
        T = np.eye(4)
        for (row, dt, da, dd, dal), angle in zip(rows, q, strict=True):
            T = T @ turned(2, row.theta + dt + float(angle))
            T = T @ matrix(row.a + da, 0, row.d + dd, row.alpha + dal, 0, 0)
        assert np.abs(table_tool_pose(imported.spec, q) - T).max() < 1e-11
    assert farthest(imported.spec) < 1.4
    assert imported.residual is not None
    assert imported.residual.largest < 1e-15
    assert imported.spec.name == "ur5e_calibrated"


@pytest.mark.parametrize("seed", SEEDS)
def test_bodies_reach_and_masses_of_a_calibrated_robot_are_the_nominal_ones(seed: int) -> None:
    nominal = build_model(load_robot("ur5e"))
    calibrated = build_model(made(ur_file(calibrated_poses(UR5E, seed)), nominal="ur5e").spec)
    assert calibrated.reach == pytest.approx(nominal.reach, rel=0.02)
    assert calibrated.mass == pytest.approx(nominal.mass, rel=1e-12)
    bare = dataclasses.replace(
        nominal.spec, rows=tuple(dataclasses.replace(row, link=LinkSpec()) for row in nominal.spec.rows)
    )
    estimated = build_model(bare)
    of_shapes = build_model(made(ur_file(calibrated_poses(UR5E, seed)), nominal=bare).spec)
    assert of_shapes.mass == pytest.approx(estimated.mass, rel=0.2)


def test_everything_but_the_geometry_is_the_nominal_robots() -> None:
    nominal = load_robot("ur5e")
    spec = made(ur_file(calibrated_poses(UR5E, 0)), nominal="ur5e").spec
    for row, given in zip(spec.rows, nominal.rows, strict=True):
        assert (row.name, row.type) == (given.name, given.type)
        assert row.limits.position == pytest.approx(given.limits.position)
        assert row.limits.effort == given.limits.effort
        assert row.link.mass == given.link.mass
    for name, vector in nominal.configurations.items():
        assert spec.configurations[name].tolist() == pytest.approx(vector.tolist())
    assert spec.units == nominal.units


def test_bodies_stay_where_they_are_at_coordinates_zero() -> None:
    com, inertia = read_only([0.1, 0.2, 0.3]), read_only(np.diag([0.02, 0.03, 0.04]))
    plain = load_robot("ur5e")
    link = LinkSpec(mass=1.0, com=com, inertia=inertia)
    nominal = dataclasses.replace(
        plain,
        rows=tuple(dataclasses.replace(row, link=link) for row in plain.rows),
        tool=ToolSpec(mass=0.5, com=read_only([0, 0, 0.05])),
    )
    spec = made(ur_file(calibrated_poses(UR5E, 1)), nominal=nominal).spec
    zero = np.zeros(6)
    old, new = table_frame_poses(nominal, zero)[1:], table_frame_poses(spec, zero)[1:]
    for row, before, after in zip(spec.rows, old, new, strict=True):
        assert row.link.com is not None
        assert row.link.inertia is not None
        place = before[:3, :3] @ com + before[:3, 3]
        assert np.allclose(after[:3, :3] @ row.link.com + after[:3, 3], place, atol=1e-8)
        expected = before[:3, :3] @ inertia @ before[:3, :3].T
        assert np.allclose(after[:3, :3] @ row.link.inertia @ after[:3, :3].T, expected, atol=1e-12)
    assert spec.tool.mass == 0.5
    assert spec.tool.com is not None
    place = old[-1][:3, :3] @ [0, 0, 0.05] + old[-1][:3, 3]
    assert np.allclose(new[-1][:3, :3] @ spec.tool.com + new[-1][:3, 3], place, atol=1e-8)


def test_meshes_of_the_nominal_robot_move_with_its_links(tmp_path: Path) -> None:
    facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    (tmp_path / "m.stl").write_text(f"solid m\n{facet}endsolid m\n")
    plain = load_robot("ur5e")
    mesh = MeshSpec(file=tmp_path / "m.stl")
    nominal = dataclasses.replace(
        plain,
        rows=tuple(dataclasses.replace(row, link=LinkSpec(mesh=mesh)) for row in plain.rows),
        base=dataclasses.replace(plain.base, mesh=mesh),
        tool=dataclasses.replace(plain.tool, mesh=mesh),
    )
    spec = made(ur_file(calibrated_poses(UR5E, 1)), nominal=nominal).spec
    old, new = table_frame_poses(nominal, np.zeros(6)), table_frame_poses(spec, np.zeros(6))
    meshes = [spec.base.mesh, *(row.link.mesh for row in spec.rows), spec.tool.mesh]
    for moved, before, after in zip(meshes, [*old, old[-1]], [*new, new[-1]], strict=True):
        assert moved is not None
        assert np.allclose(after @ pose_from_rpy(moved.pose.xyz, moved.pose.rpy), before, atol=1e-12)


def test_a_modified_table_can_be_asked_for() -> None:
    poses = calibrated_poses(UR5E, 2)
    spec = made(ur_file(poses), nominal="ur5e", convention="modified").spec
    assert spec.convention is Convention.MODIFIED
    assert [row.convention.value for row in spec.rows][3:] == ["modified"] * 3
    assert worst(spec, poses, 6) < 1e-9


def test_a_nominal_robot_may_be_mounted_elsewhere() -> None:
    nominal = load_robot("ur5e")
    mounted = dataclasses.replace(
        nominal,
        base=dataclasses.replace(nominal.base, pose=Pose(xyz=read_only([1, 2, 0.5]), rpy=read_only([0, 0, math.pi]))),
    )
    poses = calibrated_poses(UR5E, 3)
    spec = made(ur_file(poses), nominal=mounted).spec
    q = np.random.default_rng(0).uniform(-3, 3, 6)
    expected = matrix(1, 2, 0.5, 0, 0, math.pi) @ tip_of(poses, 6, q)
    assert np.abs(table_tool_pose(spec, q) - expected).max() < 1e-9


def test_the_makers_default_file_gives_the_nominal_robot_back() -> None:
    nominal = load_robot("ur5e")
    spec = made(ur_file(UR5E), nominal="ur5e", name="again").spec
    for row, given in zip(spec.rows, nominal.rows, strict=True):
        assert (row.a, row.d) == pytest.approx((given.a, given.d), abs=1e-15)
        assert row.alpha == pytest.approx(given.alpha, abs=1e-15)
        assert row.link.com is not None
        assert given.link.com is not None
        assert row.link.com.tolist() == pytest.approx(given.link.com.tolist(), abs=1e-12)


def test_the_calibration_of_another_robot_is_an_error() -> None:
    data = ur_file(calibrated_poses(UR5E, 0))
    assert refusal(Dh2simError, made, data, nominal="ur10e").startswith(
        "my_arm.yaml: this is the calibration of another robot than ur10e: at coordinates zero tool0 is 0."
    )
    assert refusal(Dh2simError, made, data, nominal="puma560").startswith(
        "my_arm.yaml: this is the calibration of another robot than puma560: at coordinates zero axes of "
    )
    assert refusal(Dh2simError, made, data, nominal="franka_panda") == (
        "my_arm.yaml: this is of 6 joints, but franka_panda has 7"
    )
    assert refusal(Dh2simError, made, data, nominal="stanford") == (
        "my_arm.yaml: the joints of a calibration turn; of stanford these do not: joint_3"
    )


def test_deltas_need_a_nominal_table_of_standard_rows() -> None:
    data = "".join(f"delta_{name} = [0, 0, 0, 0, 0, 0]\n" for name in ("theta", "a", "d", "alpha")).encode()
    assert refusal(Dh2simError, made, data, "calibration.conf") == (
        "calibration.conf: this holds what is to be added to a nominal table; name the robot, as in nominal='ur5e'"
    )
    assert refusal(Dh2simError, made, data, "calibration.conf", nominal="puma560") == (
        "calibration.conf: these numbers belong to standard rows; those of puma560 are others"
    )
    status = data + b"calibration_status = 0\n"
    assert made(status, "calibration.conf", nominal="ur5e").notes[0] == (
        "The controller does not call this robot calibrated: its calibration_status is not 2."
    )


def test_options_of_other_files_are_refused() -> None:
    data = ur_file(UR5E)
    assert "base and tip are links of a URDF" in refusal(Dh2simError, made, data, tip="wrist_3")
    assert "angle and length are units of tables" in refusal(Dh2simError, made, data, angle="deg")
    table = b"| theta | d | a | alpha |\n|---|---|---|---|\n| q1 | 0 | 0.3 | 90 |\n"
    assert refusal(Dh2simError, made, table, "t.md", nominal="ur5e") == (
        "t.md: nominal is for makers' calibration files; this is not one"
    )


def test_robot_reads_a_calibration(tmp_path: Path) -> None:
    (tmp_path / "cal.yaml").write_bytes(ur_file(calibrated_poses(UR5E, 0)))
    arm = Robot.from_calibration(tmp_path / "cal.yaml", nominal=Robot.load("ur5e"), name="mine")
    assert (arm.name, arm.n) == ("mine", 6)
    assert "from the nominal ur5e's" in arm.notes[-1]
