from __future__ import annotations

import dataclasses
import math
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.engines.engine import PoseEngine
from dh2sim.engines.mujoco_engine import BLOCK_BYTES, MujocoEngine
from dh2sim.engines.pinocchio_engine import PinocchioEngine
from dh2sim.errors import EngineError
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.model.robot_model import RobotModel
from dh2sim.robot.links import LinkSpec
from dh2sim.robot.row import Convention, Dynamics, JointType, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array, read_only
from tests.engines.files import DYNAMIC, ENGINES, dynamics_engine, joint_names, path_of, pose_engine, write
from tests.formats.readers import parsed
from tests.sample_robots import ODD_ROBOT, in_limits, model
from tests.strategies import robots_with_joint_vectors

DAMPED = dataclasses.replace(
    ODD_ROBOT,
    gravity=read_only([1.0, -2.0, -9.0]),
    rows=tuple(
        dataclasses.replace(row, dynamics=Dynamics(damping=0.5, friction=0.4, armature=0.3))
        if row.type.moves
        else row
        for row in ODD_ROBOT.rows
    ),
)
"""Its rotor inertia, damping and friction are no part of the dynamic terms."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Both files of the odd robot."""
    path = tmp_path_factory.mktemp("odd")
    write(build_model(DAMPED), path)
    return path


def table(spec: RobotSpec, q: Array) -> Array:
    return np.concatenate([table_frame_poses(spec, q), table_tool_pose(spec, q)[:, None]], axis=1)


def turns(built: RobotModel, count: int, seed: int) -> Array:
    """Joint vectors in the limits; continuous joints turn several times."""
    q = in_limits(built, count, seed)
    for i, joint in enumerate(built.moving_joints):
        if joint.type is JointType.CONTINUOUS:
            q[:, i] *= 4
    return q


@pytest.mark.parametrize("name", ENGINES)
def test_frames_of_every_engine_are_where_the_table_says(name: str, folder: Path) -> None:
    built = model("odd")
    engine = pose_engine(name, path_of(name, folder), joint_names(built), len(built.joints))
    assert engine.name == name
    assert engine.frames == ("dh_0", "dh_1", "dh_2", "dh_3", "dh_4", "dh_5", "dh_6", "tool0")
    q = turns(built, 20, seed=20)
    np.testing.assert_allclose(engine.frame_poses(q), table(built.spec, q), rtol=0, atol=1e-13)


@settings(max_examples=min(10, settings().max_examples))
@given(robots_with_joint_vectors(max_rows=6, must_move=False))
def test_frames_of_any_robot_in_every_engine_are_where_the_table_says(
    tmp_path_factory: pytest.TempPathFactory, drawn: tuple[RobotSpec, Array]
) -> None:
    spec, q = drawn
    built = build_model(spec)
    path = tmp_path_factory.mktemp("any")
    write(built, path)
    for name in ENGINES:
        engine = pose_engine(name, path_of(name, path), joint_names(built), len(built.joints))
        expected = table(spec, q)
        gap = np.abs(engine.frame_poses(q) - expected).max(initial=0.0)
        # trimesh, which yourdfpy stands on, leaves out transforms that are less than 1e-8 from the identity
        tolerance = 1e-7 if name == "yourdfpy" else 1e-13
        assert gap <= tolerance * max(1.0, built.reach)


def table_jacobian(spec: RobotSpec, q: Array) -> Array:
    """Jacobian of tool0 by differences of the table's own product, shape (6, n)."""
    columns = []
    R = table_tool_pose(spec, q)[:3, :3]
    for j in range(len(q)):
        step = np.zeros(len(q))
        step[j] = 1e-6
        change = (table_tool_pose(spec, q + step) - table_tool_pose(spec, q - step)) / 2e-6
        spin = change[:3, :3] @ R.T
        columns.append([*change[:3, 3], spin[2, 1], spin[0, 2], spin[1, 0]])
    return np.array(columns).T


@pytest.mark.parametrize("name", DYNAMIC)
def test_jacobians_of_every_engine_are_the_derivatives_of_the_table(name: str, folder: Path) -> None:
    built = model("odd")
    engine = dynamics_engine(name, path_of(name, folder), joint_names(built), len(built.joints))
    q = turns(built, 10, seed=21)
    expected = [table_jacobian(built.spec, row) for row in q]
    np.testing.assert_allclose(engine.jacobian(q), expected, rtol=0, atol=1e-8)


def test_dynamic_terms_of_all_engines_are_the_same(folder: Path) -> None:
    built = build_model(DAMPED)
    rng = np.random.default_rng(22)
    q = turns(built, 10, seed=22)
    velocity = rng.uniform(-2, 2, q.shape)
    engines = [dynamics_engine(name, path_of(name, folder), joint_names(built), 6) for name in DYNAMIC]
    terms = [engine.dynamic_terms(q, velocity, DAMPED.gravity) for engine in engines]
    for engine, other in zip(engines[1:], terms[1:], strict=True):
        for quantity in ("mass_matrix", "bias", "gravity"):
            first, second = getattr(terms[0], quantity), getattr(other, quantity)
            rounding = 1e-11 if quantity == "gravity" else max(1e-11, engine.inertia_rounding)
            np.testing.assert_allclose(second, first, rtol=0, atol=rounding * np.abs(first).max())
    mass = terms[0].mass_matrix
    np.testing.assert_allclose(mass, mass.transpose(0, 2, 1), rtol=0, atol=1e-12 * np.abs(mass).max())
    assert (np.linalg.eigvalsh(mass) > 0).all()
    assert np.abs(terms[0].bias - terms[0].gravity).max() > 0.1


@pytest.mark.parametrize("name", DYNAMIC)
def test_a_center_of_mass_close_to_the_axis_is_not_taken_to_be_on_it(name: str, tmp_path: Path) -> None:
    mass, offset = 2.0, 9e-7
    link = LinkSpec(mass=mass, com=read_only([offset, 0.0, 0.0]), inertia=read_only(1e-5 * np.eye(3)))
    gravity = read_only([0.0, -9.81, 0.0])
    row = Row(name="hinge", type=JointType.CONTINUOUS, link=link)
    built = build_model(RobotSpec(name="wheel", rows=(row,), convention=Convention.STANDARD, gravity=gravity))
    write(built, tmp_path)
    zero = np.zeros((1, 1))
    terms = dynamics_engine(name, path_of(name, tmp_path), ["hinge"], 1).dynamic_terms(zero, zero, gravity)
    np.testing.assert_allclose(terms.gravity, [[mass * 9.81 * offset]], rtol=1e-12)
    np.testing.assert_allclose(terms.mass_matrix, [[[1e-5 + mass * offset**2]]], rtol=1e-12)


@pytest.mark.parametrize("name", ENGINES)
def test_the_order_of_joints_is_that_of_the_robot_and_not_of_the_file(name: str, tmp_path: Path) -> None:
    """A joint vector follows the names that are asked for, whatever order the file has them in."""
    built = model("odd")
    write(built, tmp_path)
    names = joint_names(built)
    order = [3, 0, 4, 2, 1]
    shuffled = [names[i] for i in order]
    q = turns(built, 5, seed=23)
    engine = pose_engine(name, path_of(name, tmp_path), shuffled, len(built.joints))
    np.testing.assert_allclose(engine.frame_poses(q[:, order]), table(built.spec, q), rtol=0, atol=1e-13)
    if name in DYNAMIC:
        plain = dynamics_engine(name, path_of(name, tmp_path), names, 6)
        mixed = dynamics_engine(name, path_of(name, tmp_path), shuffled, 6)
        np.testing.assert_array_equal(mixed.jacobian(q[:, order]), plain.jacobian(q)[:, :, order])
        a = plain.dynamic_terms(q, q, ODD_ROBOT.gravity)
        b = mixed.dynamic_terms(q[:, order], q[:, order], ODD_ROBOT.gravity)
        np.testing.assert_array_equal(b.bias, a.bias[:, order])
        np.testing.assert_array_equal(b.gravity, a.gravity[:, order])
        np.testing.assert_array_equal(b.mass_matrix, a.mass_matrix[:, order][:, :, order])


def test_the_elements_of_a_urdf_may_be_in_any_order(tmp_path: Path) -> None:
    built = model("odd")
    root = parsed(to_urdf(built))
    root[:] = list(reversed(root))
    (tmp_path / "robot.urdf").write_text(ET.tostring(root, encoding="unicode"))
    q = turns(built, 3, seed=24)
    for name in ENGINES[1:]:
        engine = pose_engine(name, tmp_path / "robot.urdf", joint_names(built), 6)
        np.testing.assert_allclose(engine.frame_poses(q), table(built.spec, q), rtol=0, atol=1e-13)


def test_more_configurations_than_fit_in_a_block_are_all_computed(folder: Path) -> None:
    built = model("odd")
    engine = MujocoEngine(folder / "robot.xml", joint_names(built), 6)
    block = BLOCK_BYTES // (96 * engine.model.nsite)
    q = turns(built, 2 * block + 7, seed=25)
    np.testing.assert_allclose(engine.frame_poses(q), table(built.spec, q), rtol=0, atol=1e-13)


@pytest.mark.parametrize("name", ENGINES)
def test_no_configurations_have_no_poses(name: str, folder: Path) -> None:
    built = model("odd")
    engine: PoseEngine = pose_engine(name, path_of(name, folder), joint_names(built), 6)
    assert engine.frame_poses(np.zeros((0, 5))).shape == (0, 8, 4, 4)


@pytest.mark.parametrize("value", [math.nan, math.inf, -1e11])
def test_mujoco_refuses_coordinates_that_it_would_replace(value: float, folder: Path) -> None:
    engine = MujocoEngine(folder / "robot.xml", joint_names(model("odd")), 6)
    with pytest.raises(EngineError) as caught:
        engine.frame_poses(np.array([[0.1, 0.2, 0.3, 0.4, value]]))
    assert str(caught.value) == (f"{folder / 'robot.xml'}: MuJoCo takes joint coordinates up to 10000000000.0 only")


def test_mujoco_reports_the_mass_properties_of_a_body(folder: Path) -> None:
    built = model("odd")
    for file in ("robot.xml", "robot.urdf"):
        engine = MujocoEngine(folder / file, joint_names(built), 6)
        for link in built.links:
            body = link.inertial
            if body is None:  # the fixed row, which is of no length
                assert engine.mass_properties(link.name).mass == 0.0
                continue
            found = engine.mass_properties(link.name)
            assert found.mass == body.mass
            np.testing.assert_array_equal(found.com, body.com)
            np.testing.assert_allclose(found.inertia, body.inertia, rtol=0, atol=1e-12)
        with pytest.raises(EngineError) as caught:
            engine.mass_properties("link_7")
        assert str(caught.value) == f"{folder / file}: body not found: link_7"


@pytest.mark.parametrize("name", ["tool0", "dh_1", "link_2", "universe", "world", "base"])
def test_engines_agree_if_a_joint_has_the_name_of_a_frame(name: str, tmp_path: Path) -> None:
    rows = tuple(
        Row(name=name if i == 1 else f"j{i}", type=JointType.REVOLUTE, convention=row.convention, a=0.3, d=0.1)
        for i, row in enumerate(ODD_ROBOT.rows[:3])
    )
    built = build_model(RobotSpec(name="named", rows=rows))
    write(built, tmp_path)
    q = in_limits(built, 3, seed=26)
    for one in ENGINES:
        engine = pose_engine(one, path_of(one, tmp_path), joint_names(built), 3)
        np.testing.assert_allclose(engine.frame_poses(q), table(built.spec, q), rtol=0, atol=1e-13)
    pinocchio = PinocchioEngine(tmp_path / "robot.urdf", joint_names(built), 3)
    expected = [table_jacobian(built.spec, row) for row in q]
    np.testing.assert_allclose(pinocchio.jacobian(q), expected, rtol=0, atol=1e-8)
