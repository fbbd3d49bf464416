from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim import Robot, to_scene, to_urdf
from dh2sim.errors import RobotError
from dh2sim.formats.mjcf.write import EXPORTED, to_mjcf
from dh2sim.kinematics.transforms import quaternion_from_rotation
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.shapes import ShapeKind, ShapePart
from dh2sim.robot.magnitudes import MOST_ROWS
from dh2sim.robot.row import Dynamics, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import read_only
from tests.formats.readers import floats, in_mujoco, normal, parsed
from tests.sample_robots import CONTINUOUS, FIXED, NAMES, ODD_ROBOT, REVOLUTE, STANDARD, model
from tests.strategies import robot_specs


def assert_holds_the_model(built: RobotModel, mj: mujoco.MjModel, *, own_bodies: bool = False) -> None:
    """Everything that has a name in the contract, and the numbers that MuJoCo takes as they are."""
    links = [link.name for link in built.all_links]
    bodies = [mj.body(i).name for i in range(mj.nbody)]
    assert [name for name in bodies if not name.startswith(("dh_", "tool0"))] == ["world", *links]
    assert own_bodies or len(bodies) == 1 + len(links)
    sites = sorted(f"dh_{i}" for i in range(1 + len(built.links)))
    found = [mj.site(i).name for i in range(mj.nsite)]
    assert (sorted(found) if own_bodies else found) == [*sites, "tool0"]
    assert [mj.joint(i).name for i in range(mj.njnt)] == [joint.name for joint in built.moving_joints]
    np.testing.assert_array_equal(mj.opt.gravity, built.spec.gravity)
    for joint, link in zip(built.joints, built.links, strict=True):
        body = mj.body(link.name)
        T = joint.T_parent_joint
        np.testing.assert_array_equal(body.pos, normal(T[:3, 3]))
        np.testing.assert_allclose(body.quat, quaternion_from_rotation(T), rtol=0, atol=3e-16)
        assert body.mass[0] == (0.0 if link.inertial is None else link.inertial.mass)
        if link.inertial is not None:
            np.testing.assert_array_equal(body.ipos, normal(link.inertial.com))
    for joint in built.moving_joints:
        own = mj.joint(joint.name)
        kind = mujoco.mjtJoint.mjJNT_HINGE if joint.type.turns else mujoco.mjtJoint.mjJNT_SLIDE
        assert own.type[0] == kind
        np.testing.assert_array_equal(own.pos, [0, 0, 0])
        np.testing.assert_array_equal(own.axis, [0, 0, joint.sign])
        assert own.qpos0[0] == 0.0
        assert bool(mj.jnt_limited[own.id]) == (joint.position_range is not None)
        if joint.position_range is not None:
            assert own.range.tolist() == normal(np.array(joint.position_range))
        assert own.damping[0] == joint.dynamics.damping
        assert own.frictionloss[0] == joint.dynamics.friction
        assert own.armature[0] == joint.dynamics.armature
        given_effort = "effort" not in joint.assumed
        assert bool(mj.jnt_actfrclimited[own.id]) == given_effort
        if given_effort:
            assert mj.jnt_actfrcrange[own.id].tolist() == [-joint.effort, joint.effort]


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_mujoco_reads_names_order_and_numbers_of_the_model(name: str) -> None:
    assert_holds_the_model(model(name), in_mujoco(to_mjcf(model(name))))


@settings(max_examples=min(40, settings().max_examples))
@given(robot_specs(must_move=False))
def test_mujoco_reads_names_order_and_numbers_of_any_robot(spec: RobotSpec) -> None:
    built = build_model(spec)
    assert_holds_the_model(built, in_mujoco(to_mjcf(built)), own_bodies=True)


def test_damping_friction_and_armature_reach_mujoco() -> None:
    dynamics = Dynamics(damping=0.123, friction=0.0456, armature=0.789)
    rows = tuple(row if row.type is FIXED else dataclasses.replace(row, dynamics=dynamics) for row in ODD_ROBOT.rows)
    built = build_model(dataclasses.replace(ODD_ROBOT, rows=rows, gravity=read_only([1.5, -2.5, -3.7])))
    mj = in_mujoco(to_mjcf(built))
    assert_holds_the_model(built, mj)
    assert set(mj.dof_damping) == {0.123}
    assert set(mj.dof_frictionloss) == {0.0456}
    assert set(mj.dof_armature) == {0.789}


def test_the_compiler_counts_in_radians_and_the_solver_is_stable() -> None:
    mj = in_mujoco(to_mjcf(model("odd")))
    assert mj.opt.timestep == EXPORTED.timestep
    assert mj.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST


def test_shapes_read_back_as_the_models_doubles() -> None:
    built = model("odd")
    root = parsed(to_mjcf(built))
    materials = {m.attrib["name"]: tuple(floats(m, "rgba")) for m in root.iter("material")}
    bodies = {body.attrib["name"]: body for body in root.iter("body")}
    for link in built.all_links:
        geoms = bodies[link.name].findall("geom")
        assert len(geoms) == len(link.shapes)
        for geom, shape in zip(geoms, link.shapes, strict=True):
            kind = "capsule" if shape.kind is ShapeKind.CAPSULE else "cylinder"
            assert geom.attrib["type"] == kind
            assert floats(geom, "size") == [shape.radius, 0.5 * shape.length]
            position = floats(geom, "pos") if "pos" in geom.attrib else [0.0, 0.0, 0.0]
            quaternion = floats(geom, "quat") if "quat" in geom.attrib else [1.0, 0.0, 0.0, 0.0]
            assert position == shape.T_link_shape[:3, 3].tolist()
            assert quaternion == quaternion_from_rotation(shape.T_link_shape).tolist()
            color = link.color if shape.part is ShapePart.LINK else link.joint_color
            assert geom.attrib["class"] == ("odd_shape" if shape.solid else "odd_trim")
            assert materials[geom.attrib["material"]] == color


def test_pairs_that_do_not_collide_are_excluded() -> None:
    built = model("odd")
    mj = in_mujoco(to_mjcf(built))
    found = {(int(sign) >> 16, int(sign) & 0xFFFF) for sign in mj.exclude_signature}
    expected = {(mj.body(pair.link1).id, mj.body(pair.link2).id) for pair in built.excluded}
    assert {tuple(sorted(pair)) for pair in found} == {tuple(sorted(pair)) for pair in expected}
    assert mj.nexclude == len(built.excluded)


def test_the_base_weighs_nothing() -> None:
    built = model("odd")
    mj = in_mujoco(to_mjcf(built))
    assert mj.body("base_link").mass[0] == 0.0
    assert mj.body_subtreemass[0] == pytest.approx(built.mass, rel=1e-14)


@pytest.mark.parametrize("name", ["main", "world", "floor", "x_visual", "default"])
def test_a_robot_may_bear_any_name(name: str) -> None:
    in_mujoco(to_mjcf(build_model(dataclasses.replace(ODD_ROBOT, name=name))))


@pytest.mark.parametrize("name", ["tool0", "dh_1", "link_1", "base_link", "world", "universe", "main"])
def test_a_joint_may_have_the_name_of_a_frame(name: str) -> None:
    rows = tuple(dataclasses.replace(row, name=name) if i == 3 else row for i, row in enumerate(ODD_ROBOT.rows))
    built = build_model(dataclasses.replace(ODD_ROBOT, rows=rows))
    assert_holds_the_model(built, in_mujoco(to_mjcf(built)))


def long(count: int) -> RobotModel:
    rows = [
        Row(name=f"j{i}", type=CONTINUOUS if i % 100 == 0 else FIXED, convention=STANDARD, a=0.1, alpha=0.02)
        for i in range(count)
    ]
    return build_model(RobotSpec(name="snake", rows=tuple(rows)))


@pytest.mark.slow
def test_the_longest_robot_is_read_by_mujoco() -> None:
    mj = in_mujoco(to_mjcf(long(MOST_ROWS)))
    assert mj.body(f"link_{MOST_ROWS}").id == mj.nbody - 1


def test_a_longer_robot_is_refused() -> None:
    with pytest.raises(RobotError) as caught:
        long(MOST_ROWS + 1)
    assert str(caught.value) == f"joints: the list has {MOST_ROWS + 1} entries; at most {MOST_ROWS} are allowed"


@pytest.mark.slow
def test_the_longest_robot_is_read_by_mujoco_with_a_body_for_its_last_site() -> None:
    last = Row(name="last", type=REVOLUTE, convention=STANDARD, alpha=1e-7)
    built = long(MOST_ROWS)
    spec = dataclasses.replace(built.spec, rows=(*built.spec.rows[:-1], last))
    mj = in_mujoco(to_mjcf(build_model(spec)))
    assert mj.nbody > MOST_ROWS + 2


@pytest.mark.parametrize("name", ["four_bar", "planar_2r"])
def test_a_robot_and_a_mechanism_are_written_from_any_form(name: str) -> None:
    robot = Robot.load(name)
    forms = (robot, robot.spec, robot.mechanism if robot.spec.is_mechanism else robot.model)
    for write, text in ((to_mjcf, robot.mjcf()), (to_urdf, robot.urdf())):
        assert [write(form) for form in forms] == [text] * 3
    assert len({to_scene(form) for form in forms}) == 1
    assert ("<equality>" in to_mjcf(robot.spec)) is (name == "four_bar")
