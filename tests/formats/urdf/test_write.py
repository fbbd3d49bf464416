from __future__ import annotations

import math
from xml.etree.ElementTree import Element

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.formats.urdf.write import to_urdf
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.kinematics.transforms import rpy_from_rotation
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.model.shapes import ShapeKind, ShapePart
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.formats.readers import body_poses, floats, in_mujoco, normal, parsed
from tests.sample_robots import NAMES, in_limits, model
from tests.strategies import robot_specs


def joints_of(root: Element) -> dict[str, Element]:
    found = {joint.attrib["name"]: joint for joint in root.findall("joint")}
    assert len(found) == len(root.findall("joint"))
    return found


def links_of(root: Element) -> dict[str, Element]:
    found = {link.attrib["name"]: link for link in root.findall("link")}
    assert len(found) == len(root.findall("link"))
    return found


def assert_stands_at(element: Element, T: Array) -> None:
    origin = element.find("origin")
    assert floats(origin, "xyz") == normal(T[:3, 3])
    assert floats(origin, "rpy") == normal(rpy_from_rotation(T[:3, :3]))


def assert_is_massless(inertial: Element) -> None:
    assert floats(inertial.find("mass"), "value") == [0.0]
    tensor = inertial.find("inertia")
    assert tensor is not None
    assert {name: float(text) for name, text in tensor.attrib.items()} == dict.fromkeys(
        ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), 0.0
    )


def assert_numbers_read_back(built: RobotModel) -> None:
    root = parsed(to_urdf(built))
    joints, links = joints_of(root), links_of(root)
    for joint, link in zip(built.joints, built.links, strict=True):
        element = joints[joint.name]
        assert element.attrib["type"] == joint.type.value
        assert_stands_at(element, joint.T_parent_joint)
        limit = element.find("limit")
        if not joint.type.moves:
            assert limit is None
            assert element.find("axis") is None
        else:
            assert limit is not None
            assert floats(element.find("axis"), "xyz") == [0.0, 0.0, joint.sign]
            assert floats(limit, "effort") + floats(limit, "velocity") == [joint.effort, joint.velocity]
            if joint.position_range is None:
                assert joint.type.value == "continuous"
                assert not {"lower", "upper"} & set(limit.attrib)
            else:
                assert floats(limit, "lower") + floats(limit, "upper") == normal(np.array(joint.position_range))
            dynamics = element.find("dynamics")
            assert floats(dynamics, "damping") == [joint.dynamics.damping]
            assert floats(dynamics, "friction") == [joint.dynamics.friction]
        inertial = links[link.name].find("inertial")
        assert inertial is not None
        if link.inertial is None:
            assert_is_massless(inertial)
            continue
        assert floats(inertial.find("mass"), "value") == [link.inertial.mass]
        assert floats(inertial.find("origin"), "xyz") == normal(link.inertial.com)
        assert floats(inertial.find("origin"), "rpy") == [0.0, 0.0, 0.0]
        tensor = inertial.find("inertia")
        assert tensor is not None
        for i, row in enumerate("xyz"):
            for j, column in enumerate("xyz"):
                name = f"i{min(row, column)}{max(row, column)}"
                assert floats(tensor, name) == normal(link.inertial.inertia[i, j])


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_every_number_reads_back_as_the_models_double(name: str) -> None:
    assert_numbers_read_back(model(name))


@settings(max_examples=min(40, settings().max_examples))
@given(robot_specs(must_move=False))
def test_every_number_of_any_robot_reads_back_as_the_models_double(spec: RobotSpec) -> None:
    assert_numbers_read_back(build_model(spec))


def test_base_link_is_the_root_and_has_no_inertia() -> None:
    root = parsed(to_urdf(model("odd")))
    children = {joint.find("child").attrib["link"] for joint in root.findall("joint")}  # type: ignore[union-attr]
    assert set(links_of(root)) - children == {"base_link"}
    assert links_of(root)["base_link"].find("inertial") is None


def test_the_frames_of_rep_199_are_there_and_have_neither_shape_nor_mass() -> None:
    root = parsed(to_urdf(model("odd")))
    links, joints = links_of(root), joints_of(root)
    for name in ("base", "flange", "tool0", *(f"dh_{i}" for i in range(7))):
        [inertial] = links[name]
        assert_is_massless(inertial)
    fixed = {name: joint for name, joint in joints.items() if joint.attrib["type"] == "fixed"}
    ends = {
        name: (joint.find("parent").attrib["link"], joint.find("child").attrib["link"])  # type: ignore[union-attr]
        for name, joint in fixed.items()
    }
    assert ends["base_link-base"] == ("base_link", "base")
    assert ends["link_6-flange"] == ("link_6", "flange")
    assert ends["flange-tool0"] == ("flange", "tool0")
    assert ends["link_2-dh_2"] == ("link_2", "dh_2")
    np.testing.assert_array_equal(floats(fixed["base_link-base"].find("origin"), "xyz"), [0, 0, 0])
    np.testing.assert_array_equal(floats(fixed["base_link-base"].find("origin"), "rpy"), [0, 0, 0])


@pytest.mark.parametrize("name", [*NAMES, "odd"])
def test_x_of_the_flange_is_z_of_the_last_dh_frame(name: str) -> None:
    built = model(name)
    q = in_limits(built, 5, seed=12)
    n = len(built.joints)
    found = body_poses(in_mujoco(to_urdf(built)), q, ["flange", f"dh_{n}", "tool0"])
    np.testing.assert_allclose(found[:, 0, :3, 0], found[:, 1, :3, 2], rtol=0, atol=1e-14)
    np.testing.assert_allclose(found[:, 0, :3, 3], found[:, 1, :3, 3], rtol=0, atol=1e-14 * (1 + built.reach))
    np.testing.assert_allclose(found[:, 2], table_tool_pose(built.spec, q), rtol=0, atol=1e-13 * (1 + built.reach))


def test_dh_frames_can_be_left_out() -> None:
    built = model("odd")
    with_frames, without = parsed(to_urdf(built)), parsed(to_urdf(built, dh_frames=False))
    assert set(links_of(with_frames)) - set(links_of(without)) == {f"dh_{i}" for i in range(7)}
    assert len(joints_of(with_frames)) - len(joints_of(without)) == 7


@pytest.mark.parametrize("part", ["visual", "collision"])
def test_shapes_are_cylinders_and_a_capsule_has_a_ball_at_either_end(part: str) -> None:
    built = model("odd")
    links = links_of(parsed(to_urdf(built)))
    kinds = set()
    for link in built.all_links:
        elements = iter(links[link.name].findall(part))
        for shape in link.shapes:
            if part == "collision" and not shape.solid:
                continue
            kinds.add(shape.kind)
            element = next(elements)
            assert_stands_at(element, shape.T_link_shape)
            assert floats(element.find("geometry/cylinder"), "radius") == [shape.radius]
            assert floats(element.find("geometry/cylinder"), "length") == [shape.length]
            if shape.kind is ShapeKind.CAPSULE:
                for end in shape.ends:
                    ball = next(elements)
                    assert floats(ball.find("origin"), "xyz") == normal(end)
                    assert floats(ball.find("geometry/sphere"), "radius") == [shape.radius]
        assert list(elements) == []
    assert kinds == {ShapeKind.CYLINDER, ShapeKind.CAPSULE}


def test_materials_are_declared_once_and_used_by_every_visual() -> None:
    built = model("odd")
    root = parsed(to_urdf(built))
    declared = {
        material.attrib["name"]: tuple(floats(material.find("color"), "rgba"))
        for material in root.findall("material")
    }
    assert len(set(declared.values())) == len(declared)
    for link in built.all_links:
        visuals = links_of(root)[link.name].findall("visual")
        used = {declared[visual.find("material").attrib["name"]] for visual in visuals}  # type: ignore[union-attr]
        expected = {link.color if shape.part is ShapePart.LINK else link.joint_color for shape in link.shapes}
        assert used == expected
    for element in root.iter("collision"):
        assert element.find("material") is None


def test_pitch_of_the_flange_is_a_right_angle_exactly() -> None:
    joint = joints_of(parsed(to_urdf(model("puma560"))))["link_6-flange"]
    assert floats(joint.find("origin"), "rpy") == [0.0, -math.pi / 2, 0.0]
