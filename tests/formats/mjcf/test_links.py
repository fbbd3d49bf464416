"""Masses, meshes, colours, actuators and constraints of what is read from an MJCF."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from dh2sim.errors import ImportedFileError
from dh2sim.formats.serial_robot import SerialLink
from dh2sim.robot.row import ActuatorType
from dh2sim.typing import Array
from tests.formats.mjcf.reading import BALL, arm_text, frame, model_text, read_text, residual

ONE = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'


def generalized_mass(link: SerialLink, point: Array, axis: Array) -> float:
    """Moment of inertia of a link about an axis."""
    assert link.mass is not None
    assert link.com is not None
    assert link.inertia is not None
    arm = np.cross(axis, link.com - point)
    return float(axis @ link.inertia @ axis + link.mass * arm @ arm)


def test_bodies_that_are_fixed_to_a_link_weigh_with_it(tmp_path: Path) -> None:
    parts = """<geom type="box" size="0.1 0.2 0.3" pos="0.1 0 0" euler="10 20 30"/>
      <body name="plate" pos="0 0.3 0.5" euler="0 40 0">
        <inertial pos="0.1 0 0" mass="2.5" fullinertia="1 2 2.5 .1 .2 .3"/>
        <body name="screw" pos="0 0 0.2" euler="70 0 0"><geom type="capsule" size="0.05 0.2"/></body>
        <body name="finger"><joint name="f" type="slide"/><geom size="0.01" mass="0.5"/></body>
      </body>"""
    axis = np.array([0.0, 0.6, 0.8])
    joint = '<joint name="a" axis="0 0.6 0.8" pos="0.1 0.2 0.3"/>'
    text = model_text(f'<body name="base"><body name="one">{joint}{parts}<site name="tcp"/></body></body>')
    robot = read_text(tmp_path, text)
    link = robot.links[0]
    mj = mujoco.MjModel.from_xml_string(text)
    mj.body("finger").mass[0] = 1e-12
    mj.body("finger").inertia[:] = 1e-12
    data = mujoco.MjData(mj)
    mujoco.mj_setConst(mj, data)
    mujoco.mj_forward(mj, data)
    full = np.zeros((mj.nv, mj.nv))
    mujoco.mj_fullM(mj, data, full)
    assert link.mass == pytest.approx(mj.body_subtreemass[mj.body("one").id], rel=1e-12)
    assert link.com is not None
    np.testing.assert_allclose(link.com, data.subtree_com[mj.body("one").id], rtol=0, atol=1e-12)
    expected = full[0, 0]
    assert generalized_mass(link, np.array([0.1, 0.2, 0.3]), axis) == pytest.approx(expected, rel=1e-11)
    assert (
        "Bodies that are fixed to a link of the arm were merged into it: 'one' (with 'plate', 'screw')."
        in robot.notes
    )
    assert "Left out with 'f' on 'plate': body 'finger' (0.5 kg)." in robot.notes


def test_a_link_may_have_its_mass_from_what_is_fixed_to_it(tmp_path: Path) -> None:
    nothing = '<inertial pos="0 0 0" mass="0" diaginertia="0 0 0"/>'
    plate = '<body name="plate" pos="0 0 1"><inertial pos="0 1 0" mass="2" diaginertia="1 2 3"/></body>'
    one = f'<body name="one"><joint name="a"/>{nothing}{plate}</body>'
    link = read_text(tmp_path, model_text(f'<body name="base">{one}</body>')).links[0]
    assert link.mass == 2.0
    np.testing.assert_array_equal(link.com, [0, 1, 1])
    np.testing.assert_array_equal(link.inertia, np.diag([1, 2, 3]))


def box_file(folder: Path) -> trimesh.Trimesh:
    """A mesh whose frame is neither in its centre nor along its axes, written to box.stl and box.obj."""
    mesh = trimesh.creation.box((0.1, 0.2, 0.4))
    mesh.apply_transform(trimesh.transformations.rotation_matrix(0.7, [1, 2, 3]))
    mesh.apply_translation([0.3, 0.2, -0.1])
    folder.mkdir(exist_ok=True)
    mesh.export(folder / "box.stl")
    mesh.export(folder / "box.obj")
    return mesh


@pytest.mark.parametrize("ref", ["", 'refpos="0.1 0.2 0.3" refquat="0.5 0.1 -0.7 0.2"'])
@pytest.mark.parametrize("suffix", ["stl", "obj"])
def test_a_mesh_is_where_mujoco_shows_it(suffix: str, ref: str, tmp_path: Path) -> None:
    mesh = box_file(tmp_path / "meshes")
    before = f"""<compiler meshdir="meshes"/><asset><mesh name="m" file="box.{suffix}" scale="2 2 2" {ref}/>
      <material name="red" rgba="0.8 0.1 0 1"/></asset>"""
    shown = '<geom type="mesh" mesh="m" contype="0" conaffinity="0" pos="1 0 2" euler="10 20 30" material="red"/>'
    inner = f'<geom size="0.2"/><body name="plate" pos="0 3 0" euler="50 60 70">{shown}</body>'
    text = model_text(f'<body name="base"><body name="one"><joint name="a"/>{inner}</body></body>', before)
    robot = read_text(tmp_path, text)
    found = robot.links[0].mesh
    assert found is not None
    assert (found.uri, found.path, found.scale) == (f"box.{suffix}", tmp_path / "meshes" / f"box.{suffix}", 2.0)
    assert robot.links[0].color == (0.8, 0.1, 0.0, 1.0)
    mj = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    data = mujoco.MjData(mj)
    mujoco.mj_kinematics(mj, data)
    geom = int(np.flatnonzero(mj.geom_type == mujoco.mjtGeom.mjGEOM_MESH)[0])
    vertices = mj.mesh_vert @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
    T = frame(mj, data, "one") @ found.T_link_mesh
    corners = 2.0 * mesh.vertices @ T[:3, :3].T + T[:3, 3]
    distances = np.linalg.norm(corners[:, None] - vertices[None], axis=2)
    assert distances.min(axis=1).max() < 1e-6  # MuJoCo keeps vertices in single precision
    assert distances.min(axis=0).max() < 1e-6
    assert "Shapes other than meshes are not carried over, of links 'one' (sphere)." in robot.notes


def test_meshes_that_a_robot_file_cannot_hold_are_noted(tmp_path: Path) -> None:
    box_file(tmp_path)
    before = """<asset><mesh name="flat" file="box.stl" scale="1 1 2"/>
      <mesh name="left" file="box.stl" scale="-1 -1 -1"/>
      <mesh name="own" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/><mesh name="good" file="box.stl"/></asset>"""
    flat, left, own, good = (
        f'<geom type="mesh" mesh="{name}" contype="0" conaffinity="0"/>' for name in ("flat", "left", "own", "good")
    )
    one = f'<body name="one"><joint name="a"/>{ONE}{flat}{left}{own}</body>'
    two = f'<body name="two"><joint name="b"/>{ONE}{good}{good}</body>'
    text = model_text(f'<body name="base">{one.replace("</body>", two + "</body>")}</body>', before)
    robot = read_text(tmp_path, text)
    assert robot.links[0].mesh is None
    assert robot.links[1].mesh is not None
    assert (
        "Meshes that are mirrored or scaled unevenly are not carried over: 'one' (1 1 2), 'one' (-1 -1 -1)."
        in robot.notes
    )
    assert "Meshes that are written in the file itself are not carried over, of links 'one'." in robot.notes
    assert "A link shows one mesh; further ones are not carried over, of links 'two'." in robot.notes


MISSING = """<compiler meshdir="gone"/><asset><mesh name="m" file="link.stl"/><mesh name="n" file="other.obj"/>
<hfield name="h" file="ground.png" size="1 1 1 1"/><texture name="t" type="2d" file="t.png"/>
<material name="red" texture="t" rgba="1 0 0 1"/></asset>
<default><default class="visual"><geom type="mesh" contype="0" conaffinity="0" material="red"/></default></default>"""


def test_kinematics_need_no_mesh_files(tmp_path: Path) -> None:
    ground = '<geom type="hfield" hfield="h"/>'
    heavy = '<geom name="g" type="mesh" mesh="m" pos="1 2 3"/>'
    light = f'<geom class="visual" mesh="n" mass="0"/>{BALL}'
    two = f'<body name="two" pos="0 0 1" euler="30 0 0"><joint name="b" pos="0 0.1 0"/>{light}</body>'
    one = f'<body name="one" pos="1 0 0"><joint name="a" springdamper="1 1"/>{heavy}{two}</body>'
    after = (
        '<contact><pair geom1="g" geom2="g2"/></contact><actuator><position joint="a" kp="2" dampratio="1"/>'
        '</actuator><deformable><skin file="gone.skn"/></deformable>'
    )
    text = model_text(f'{ground}<body name="base">{one}</body>', MISSING, after).replace(
        '<geom size="0.1"/>', '<geom name="g2" size="0.1"/>'
    )
    robot = read_text(tmp_path, text)
    bare = model_text(f'<body name="base">{one}</body>').replace(heavy, BALL).replace(light, BALL)
    assert residual(robot, mujoco.MjModel.from_xml_string(bare), "base", ["one", "two", "two"]) < 1e-14
    assert [link.mass is None for link in robot.links] == [True, False]
    assert [link.color for link in robot.links] == [None, (1.0, 0.0, 0.0, 1.0)]
    assert robot.dynamics[0].damping == 0.0
    assert robot.actuators is not None
    found = [(spec.type, spec.kp, spec.kv) for spec in robot.actuators]
    assert found == [(ActuatorType.POSITION, 2.0, None), (ActuatorType.NONE, None, None)]
    for note in (
        "Meshes were not found, of links 'one' (link.stl), 'two' (other.obj).",
        "The mass is unknown, as it would come from missing shapes, of links 'one'.",
        "A damping ratio is left out, as masses are unknown, of actuators 'actuator 1'.",
        "A damping ratio counts as no damping, as masses are unknown, for joints 'a'.",
    ):
        assert note in robot.notes


def test_a_mesh_that_mujoco_cannot_use_does_not_hide_the_robot(tmp_path: Path) -> None:
    (tmp_path / "bad.stl").write_bytes(b"no mesh at all")
    text = model_text(
        f'<body name="base"><body name="one"><joint name="a"/><geom type="mesh" mesh="bad"/>{BALL}</body></body>',
        '<asset><mesh name="bad" file="bad.stl"/></asset>',
    )
    robot = read_text(tmp_path, text)
    assert robot.chain.n == 1
    assert robot.links[0].mass is None
    assert robot.notes[0].startswith("MuJoCo cannot use the model's meshes, so that none was used: ")
    assert "Meshes were not used, of links 'one' (bad.stl)." in robot.notes


def test_servos_and_motors_are_carried_over(tmp_path: Path) -> None:
    actuators = """<actuator><position joint="joint_a" kp="50" kv="3"/><velocity joint="joint_b" kv="4"/>
      <motor joint="joint_c" ctrlrange="-7 7"/><motor joint="joint_d" gear="30" ctrlrange="-1 2"/>
      <position joint="joint_e" kp="5" timeconst="0.1" forcerange="-9 9"/><motor joint="joint_f"/>
      <position joint="joint_f"/><general joint="joint_g" gainprm="3" name="odd"/></actuator>"""
    robot = read_text(tmp_path, arm_text(8, after=actuators))
    assert robot.actuators is not None
    found = [(spec.type.value, spec.kp, spec.kv) for spec in robot.actuators]
    assert found == [
        ("position", 50.0, 3.0),
        ("velocity", None, 4.0),
        ("motor", None, None),
        *[("none", None, None)] * 5,
    ]
    assert [limits.effort for limits in robot.limits] == [None, None, 7.0, 30.0, 9.0, None, None, None]
    for note in (
        "Actuators that a robot file has no place for are left out: 'actuator 4' (gear 30), "
        "'actuator 5' (with dynamics of its own), 'actuator 6' (one of 2 on joint 'joint_f'), "
        "'actuator 7' (one of 2 on joint 'joint_f'), 'odd' (gain 3).",
        "Limits of force that differ in the two directions: the smaller one is used, for joints 'joint_d' (-30, 60).",
    ):
        assert note in robot.notes
    assert read_text(tmp_path, arm_text(2)).actuators is None


def test_limits_dynamics_and_forces_are_carried_over(tmp_path: Path) -> None:
    joint = (
        'range="-30 60" damping="1.5 0 2" frictionloss="0.25" armature="0.125" actuatorfrcrange="-20 40" '
        'stiffness="3" solreflimit="0.1 1"'
    )
    after = '<actuator><motor joint="joint_a" forcerange="-15 15" armature="0.5" damping="2"/></actuator>'
    robot = read_text(tmp_path, arm_text(1, joint=joint, after=after))
    limits, dynamics = robot.limits[0], robot.dynamics[0]
    assert limits.position == tuple(np.deg2rad([-30, 60]).tolist())
    assert limits.velocity is None
    assert limits.effort == 15.0
    assert (dynamics.damping, dynamics.friction, dynamics.armature) == (3.5, 0.25, 0.625)
    for note in (
        "Only the linear part of the damping is carried over, of joints 'joint_a'.",
        "Springs are not carried over, of joints 'joint_a' (3).",
        "Settings of MuJoCo's solver (solref, solimp, margin) are not carried over: 'joint_a'.",
        "Limits of force that differ in the two directions: the smaller one is used, for joints 'joint_a' (-20, 40).",
    ):
        assert note in robot.notes


ADVICE = "no table can say that. Choose a base or tip that leaves it out, or remove it"


@pytest.mark.parametrize(
    ("constraint", "message"),
    [
        (
            '<joint name="e" joint1="joint_b" joint2="joint_a"/>',
            "equality[e]: joint 'joint_b' of the arm follows joint 'joint_a'",
        ),
        ('<joint joint1="joint_b"/>', "equality: joint 'joint_b' of the arm is held still"),
        (
            '<connect body1="link_3" body2="base" anchor="0 0 0"/>',
            "equality: 'link_3' and 'base' are held together, which closes a loop through joints of the arm: "
            "'joint_a', 'joint_b', 'joint_c'",
        ),
        (
            '<weld body1="link_2" body2="rod"/>',
            "equality: 'link_2' and 'rod' are held together, which closes a loop through joints of the arm: "
            "'joint_b'",
        ),
        (
            '<connect site1="s" site2="r"/>',
            "equality: 'link_3' and 'rod' are held together, which closes a loop through joints of the arm: "
            "'joint_b', 'joint_c'",
        ),
        (
            '<weld body1="link_1"/>',
            "equality: 'link_1' and 'world' are held together, which closes a loop through joints of the arm: "
            "'joint_a'",
        ),
        ('<tendon tendon1="t"/>', "equality: a tendon ties joints of the arm: 'joint_a', 'joint_c'"),
        ('<tendon tendon1="u" tendon2="w"/>', "equality: a tendon ties joints of the arm: 'joint_b', 'joint_c'"),
    ],
)
def test_constraints_that_tie_the_arm_are_refused(constraint: str, message: str, tmp_path: Path) -> None:
    text = tied(constraint)
    with pytest.raises(ImportedFileError) as caught:
        read_text(tmp_path, text, tip="s")
    column = text.index('<joint name="e"') + 1 if '"e"' in constraint else 1
    assert str(caught.value) == f"robot.xml:1:{column}: {message}; {ADVICE}"


@pytest.mark.parametrize(
    ("constraint", "note"),
    [
        (
            '<connect body1="link_3" body2="base" anchor="0 0 0" active="false"/>',
            "Constraints that are not active are left out: 'constraint 1' (connect).",
        ),
        (
            '<joint name="e" joint1="r" joint2="joint_a"/>',
            "Constraints that do not tie the arm are left out: 'e' (joint).",
        ),
        (
            '<connect name="c" body1="link_1" body2="rod" anchor="0 0 0"/>',
            "Constraints that do not tie the arm are left out: 'c' (connect).",
        ),
        (
            '<weld body1="lead" body2="link_3"/>',
            "Constraints that do not tie the arm are left out: 'constraint 1' (weld).",
        ),
        ('<tendon tendon1="w"/>', "Constraints that do not tie the arm are left out: 'constraint 1' (tendon)."),
    ],
)
def test_constraints_that_leave_the_arm_free_are_noted(constraint: str, note: str, tmp_path: Path) -> None:
    robot = read_text(tmp_path, tied(constraint), tip="s")
    assert note in robot.notes
    assert "Tendons are not carried over: 't', 'u', 'w'." in robot.notes


def test_constraints_may_be_switched_off_as_a_whole(tmp_path: Path) -> None:
    text = tied('<joint joint1="joint_b"/>').replace(
        "<worldbody>", '<option><flag equality="disable"/></option><worldbody>'
    )
    robot = read_text(tmp_path, text, tip="s")
    assert "Constraints that are not active are left out: 'constraint 1' (joint)." in robot.notes


def tied(constraint: str) -> str:
    """An arm of three joints with a rod on its first link, a mocap body, three tendons and a constraint."""
    rod = f'<body name="rod"><joint name="r"/>{BALL}<site name="r"/></body><joint name="joint_a" />'
    text = arm_text(
        3,
        '<site name="s"/>',
        after='<tendon><fixed name="t"><joint joint="joint_a" coef="1"/><joint joint="joint_c" coef="-1"/></fixed>'
        '<spatial name="u"><site site="s"/><site site="r"/></spatial>'
        '<fixed name="w"><joint joint="r" coef="1"/></fixed></tendon>'
        f"<equality>{constraint}</equality>",
    )
    text = text.replace('<joint name="joint_a" />', rod)
    return text.replace("</worldbody>", '<body name="lead" mocap="true"/></worldbody>')


def test_what_has_no_place_in_a_robot_file_is_counted(tmp_path: Path) -> None:
    before = '<option density="1.2" gravity="0 0 -9.81"/>'
    after = '<sensor><jointpos joint="joint_a"/><jointvel joint="joint_a"/></sensor><keyframe><key/></keyframe>'
    text = arm_text(1, '<camera/><site name="s"/>', before, after)
    robot = read_text(tmp_path, text.replace('name="link_1"', 'name="link_1" gravcomp="1"'))
    for note in (
        "Not carried over: 1 camera, 2 sensors.",
        "Keyframes are not carried over.",
        "The medium around the robot (density, viscosity, wind) is not carried over.",
        "Compensation of gravity is not carried over, of links 'link_1'.",
    ):
        assert note in robot.notes
