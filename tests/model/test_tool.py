"""Tools, and links that weigh nothing: masses, mass matrices, shapes and pairs that do not collide."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim import Fixed, LinkSpec, Pose, Prismatic, Revolute, Robot, ShapeSpec, ToolSpec
from dh2sim.errors import ModelError, RobotError
from dh2sim.kinematics.conversion import convert_rows
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.robot.links import ShapeType
from dh2sim.robot.read import parse_robot
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.model.samples import body_inertia
from tests.strategies import massless_robot_specs

GRIPPER = ToolSpec(
    xyz=read_only([0.01, -0.02, 0.15]),
    rpy=read_only([0.3, -0.4, 1.2]),
    mass=0.5,
    com=read_only([0.01, 0.02, 0.06]),
    inertia=read_only([[4e-4, 1e-5, 0], [1e-5, 5e-4, -2e-5], [0, -2e-5, 6e-4]]),
)


def arm(tool: ToolSpec, *, wrist: LinkSpec | None = None) -> Robot:
    """Two revolute joints and a slide at odd twists; the link between has mass 0 unless another is given."""
    return Robot(
        [
            Revolute(d=0.3, alpha=math.radians(37.3), link=LinkSpec(mass=2.0, com=read_only([0.1, 0, 0.02]))),
            Revolute(a=0.25, alpha=-0.7, d=0.1, link=LinkSpec(mass=0.0) if wrist is None else wrist),
            Prismatic(a=0.1, alpha=0.4, theta=0.3, link=LinkSpec(mass=0.7)),
        ],
        tool=tool,
    )


def mass_matrix(robot: Robot, q: Array) -> Array:
    compiled = robot.mjmodel()
    data = mujoco.MjData(compiled)
    data.qpos[:] = q
    mujoco.mj_forward(compiled, data)
    M = np.zeros((compiled.nv, compiled.nv))
    mujoco.mj_fullM(compiled, data, M)
    return M


def composed_mass_matrix(spec: RobotSpec, robot: Robot, q: Array) -> Array:
    """Sum of m Jv' Jv + Jw' I Jw over bodies, with poses of the table's own product and central differences."""
    step = 1e-5
    n = len(q)
    joints, bodies = robot.model.joints, []
    for i, (link, joint) in enumerate(zip(robot.model.links, joints, strict=True), start=1):
        if link.inertial is not None:
            bodies.append((i, np.linalg.inv(joint.T_joint_dh), link.inertial))
    if robot.model.tool is not None and robot.model.tool.inertial is not None:
        bodies.append((len(joints), np.eye(4), robot.model.tool.inertial))
    qs = np.array([q, *(q + sign * step * np.eye(n)[k] for k in range(n) for sign in (1, -1))])
    frames = table_frame_poses(spec, qs)
    M = np.diag([joint.dynamics.armature for joint in robot.model.moving_joints])
    for frame, T_dh_link, body in bodies:
        T = frames[:, frame] @ T_dh_link
        com = T[:, :3, :3] @ body.com + T[:, :3, 3]
        R = T[0, :3, :3]
        linear = (com[1::2] - com[2::2]).T / (2 * step)
        spins = [(T[1 + 2 * k, :3, :3] - T[2 + 2 * k, :3, :3]) @ R.T / (2 * step) for k in range(n)]
        angular = np.array([[w[2, 1] - w[1, 2], w[0, 2] - w[2, 0], w[1, 0] - w[0, 1]] for w in spins]).T / 2
        M = M + body.mass * linear.T @ linear + angular.T @ R @ body.inertia @ R.T @ angular
    return M


@settings(max_examples=min(25, settings().max_examples))
@given(massless_robot_specs())
def test_mass_matrix_with_tools_and_massless_links_equals_the_sum_over_the_bodies(
    spec: RobotSpec,
) -> None:
    robot = Robot.from_spec(spec)
    q = np.random.default_rng(3).uniform(*robot.model.travel)
    found, expected = mass_matrix(robot, q), composed_mass_matrix(spec, robot, q)
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * size.max())
    assert robot.validate(samples=5).ok


def test_the_tool_is_a_body_in_dh_frame_n_with_the_masses_of_the_file() -> None:
    robot = arm(GRIPPER)
    compiled = robot.mjmodel()
    body = compiled.body("tool")
    assert body.mass[0] == 0.5
    np.testing.assert_array_equal(body.ipos, GRIPPER.com)
    assert GRIPPER.inertia is not None
    np.testing.assert_allclose(body_inertia(compiled, body.id), GRIPPER.inertia, rtol=0, atol=1e-17)
    data = mujoco.MjData(compiled)
    data.qpos[:] = q = [0.4, -1.1, 0.2]
    mujoco.mj_kinematics(compiled, data)
    T_dhn = table_frame_poses(robot.spec, np.array(q))[-1]
    np.testing.assert_allclose(data.body("tool").xpos, T_dhn[:3, 3], rtol=0, atol=1e-15)
    np.testing.assert_allclose(data.body("tool").xmat.reshape(3, 3), T_dhn[:3, :3], rtol=0, atol=1e-15)
    np.testing.assert_allclose(
        data.site("tool0").xpos, table_tool_pose(robot.spec, np.array(q))[:3, 3], rtol=0, atol=1e-15
    )
    assert robot.model.mass == pytest.approx(2.0 + 0.7 + 0.5, rel=1e-15)


def test_what_a_tool_leaves_out_is_estimated_and_said() -> None:
    heavy = arm(ToolSpec(xyz=read_only([0, 0, 0.2]), mass=0.5)).model
    assert heavy.tool is not None
    assert heavy.tool.inertial is not None
    assert heavy.tool.inertial.com.tolist() == [0, 0, 0.2]
    radius = (3 * 0.5 / (4 * math.pi * 1000)) ** (1 / 3)
    np.testing.assert_allclose(np.diag(heavy.tool.inertial.inertia), 0.2 * radius**2, rtol=1e-2)
    assert heavy.tool.estimated == ("com", "inertia")
    assert str(heavy.estimates[-1]) == "com, inertia of link_3, tool"
    shape = ShapeSpec(type=ShapeType.BOX, size=read_only([0.1, 0.2, 0.05]), pose=Pose(xyz=read_only([0, 0, 0.03])))
    drawn = arm(ToolSpec(shape=shape)).model
    assert drawn.tool is not None
    assert drawn.tool.inertial is not None
    assert drawn.tool.inertial.mass == pytest.approx(1.0, rel=1e-14)
    assert drawn.tool.inertial.com.tolist() == [0, 0, 0.03]
    assert drawn.tool.estimated == ("mass", "com", "inertia")
    weightless = arm(ToolSpec(shape=shape, mass=0.0)).model
    assert weightless.tool is not None
    assert (weightless.tool.inertial, weightless.tool.estimated) == (None, ())


def test_a_robot_without_a_tool_has_no_body_for_it() -> None:
    assert arm(ToolSpec(xyz=read_only([0, 0, 0.2]))).model.tool is None


def test_the_tool_does_not_collide_with_the_links_that_it_is_next_to() -> None:
    shape = ShapeSpec(type=ShapeType.SPHERE, radius=0.1)
    built = arm(ToolSpec(shape=shape)).model
    pairs = {(pair.link1, pair.link2) for pair in built.excluded}
    assert {("link_2", "tool"), ("link_3", "tool")} <= pairs


def in_base(robot: Robot) -> tuple[Array, Array, Array]:
    """Pose of the tool's shape, its centre of mass and its inertia in base_link, somewhere."""
    T = table_frame_poses(robot.spec, np.array([0.5, -0.9, 0.1]))[-1]
    tool = robot.model.tool
    assert tool is not None
    assert tool.inertial is not None
    R = T[:3, :3]
    return T @ tool.shapes[0].T_link_shape, R @ tool.inertial.com + T[:3, 3], R @ tool.inertial.inertia @ R.T


@pytest.mark.parametrize("to", [Convention.STANDARD, Convention.MODIFIED])
def test_a_converted_robot_has_the_same_tool(to: Convention) -> None:
    shape = ShapeSpec(type=ShapeType.CYLINDER, radius=0.03, length=0.1, pose=Pose(xyz=read_only([0.1, 0.02, 0.3])))
    tool = ToolSpec(xyz=GRIPPER.xyz, rpy=GRIPPER.rpy, mass=0.5, com=GRIPPER.com, inertia=GRIPPER.inertia, shape=shape)
    robot = arm(tool, wrist=LinkSpec(mass=1.0))
    converted = Robot.from_spec(convert_rows(robot.spec, to).spec)
    for first, second in zip(in_base(robot), in_base(converted), strict=True):
        np.testing.assert_allclose(first, second, rtol=0, atol=1e-15)


def test_a_last_joint_must_move_some_mass() -> None:
    rows = [Revolute(a=0.3), Revolute(a=0.2, link=LinkSpec(mass=0.0))]
    with pytest.raises(RobotError, match="joint_2 would move nothing that has mass"):
        Robot(rows)
    assert Robot(rows, tool=ToolSpec(mass=0.1)).model.mass > 0.1
    assert Robot(rows, tool=ToolSpec(shape=ShapeSpec(type=ShapeType.SPHERE, radius=0.1))).model.mass > 4.0


def test_what_is_fixed_to_a_massless_last_link_may_be_found_to_weigh_nothing() -> None:
    robot = Robot([Revolute(a=0.3), Revolute(link=LinkSpec(mass=0.0)), Fixed()])
    with pytest.raises(ModelError, match="robot: joint_2 moves nothing that has mass"):
        _ = robot.model


def test_where_nothing_weighs_anything_is_said_of_the_file() -> None:
    rows = "joints:\n- {type: revolute, a: 0.3}\n- type: revolute\n  link: {mass: 0}\n- {type: fixed}\n"
    spec = parse_robot(f"name: r\nconvention: standard\n{rows}", file="r.yaml")
    with pytest.raises(
        ModelError, match=r"^r\.yaml:6:16: joints\[1\]\.link\.mass: joint_2 moves nothing that has mass"
    ):
        build_model(spec)
