"""Which arms are imported, from which files."""

from __future__ import annotations

from dh2sim.robot.row import Convention
from scripts.real_arms.arm import Arm
from scripts.real_arms.packages import (
    AIRO,
    DIFFERENTIABLE,
    EXAMPLES,
    PYBULLET,
    PYROBOPLAN,
    ROBOSUITE,
    ROBOSUITE_MODELS,
    ROBOTBLOCKSET,
    RTB,
    STRETCH,
    Package,
)


def _ur(size: int) -> Arm:
    file = f"ur_description/urdf/ur{size}_robot.urdf"
    return Arm(robot=f"UR{size}", package=EXAMPLES, file=file, base="world", tip="tool0")


def _suite(robot: str, folder: str, tip: str, *, ask: bool = False, remark: str = "") -> Arm:
    return Arm(
        robot=robot,
        package=ROBOSUITE,
        file=f"{folder}/robot.xml",
        base="base",
        tip=tip,
        ask_tip=ask,
        remark=remark,
    )


def _humanoid(robot: str, file: str, base: str, tip: str, remark: str = "", hayati: tuple[str, ...] = ()) -> Arm:
    return Arm(
        robot=robot, package=EXAMPLES, file=file, base=base, tip=tip, ask_tip=True, remark=remark, hayati=hayati
    )


def _arm(package: Package, robot: str, file: str, base: str, tip: str, *, ask: bool = False, remark: str = "") -> Arm:
    return Arm(robot=robot, package=package, file=file, base=base, tip=tip, ask_tip=ask, remark=remark)


def _stretch(model: str, file: str, tip: str, remark: str = "") -> Arm:
    file = f"{model}/stretch_description_{file}.urdf"
    return _arm(STRETCH, f"Stretch {model}", file, "base_link", tip, ask=True, remark=remark)


def _models(robot: str, folder: str, base: str, tip: str, *, ask: bool = False) -> Arm:
    return _arm(ROBOSUITE_MODELS, robot, f"{folder}/robot.xml", base, tip, ask=ask)


PANDA = Arm(
    robot="Franka Panda",
    package=EXAMPLES,
    file="panda_description/urdf/panda.urdf",
    base="panda_link0",
    tip="panda_link8",
    ask_tip=True,
    convention=Convention.MODIFIED,
    remark="the maker's table",
)
UR3, UR5, UR10 = _ur(3), _ur(5), _ur(10)
IIWA = Arm(
    robot="KUKA LBR iiwa 14",
    package=PYBULLET,
    file="kuka_iiwa/model.urdf",
    base="lbr_iiwa_link_0",
    tip="lbr_iiwa_link_7",
    convention=Convention.MODIFIED,
    remark="the published table; the file ends 45 mm before the flange",
)
IIWA_OFFSET = Arm(
    robot="KUKA LBR iiwa 14 R820",
    package=RTB,
    file="kuka_description/kuka_lbr_iiwa/urdf/lbr_iiwa_14_r820.urdf",
    base="base_link",
    tip="tool0",
    convention=Convention.MODIFIED,
    remark="two axes of the file stand 0.436 mm off, see below",
)
XARM6_ROUNDED = Arm(
    robot="UFACTORY xArm6",
    package=PYBULLET,
    file="xarm/xarm6_robot.urdf",
    base="world",
    tip="link6",
    remark="1.5708 in the file: twists of 90.0002°",
)
XARM6 = Arm(
    robot="UFACTORY xArm6",
    package=PYBULLET,
    file="xarm/xarm6_robot.urdf",
    base="world",
    tip="link6",
    tolerance=1e-4,
    remark="the maker's table",
)
XARM7 = _suite("UFACTORY xArm7", "xarm7", "link7", remark="the maker's table")
PUMA = Arm(
    robot="Unimation PUMA 560",
    package=RTB,
    file="unimation_puma560_description/urdf/puma560_robot.urdf",
    base="link1",
    tip="link7",
    tolerance=1e-7,
    remark="1.570796325 in the file; another elbow, see below",
)
IRB140 = Arm(
    robot="ABB IRB 140 by name",
    package=RTB,
    file="abb_irb140_description/urdf/irb140.urdf",
    base="base_link",
    tip="tool0",
    remark="lengths of a robot four times as large, see below",
)
UR5E = _suite("UR5e", "ur5e", "wrist_3_link", remark="lengths in whole millimetres, see below")

ARMS: tuple[Arm, ...] = (
    PANDA,
    UR3,
    UR5,
    UR10,
    Arm(
        robot="Kinova Jaco j2s6s200",
        package=EXAMPLES,
        file="kinova_description/robots/kinova.urdf",
        base="base",
        tip="j2s6s200_link_6",
        remark="its first axis points down",
    ),
    Arm(
        robot="UFACTORY xArm7",
        package=EXAMPLES,
        file="xarm_description/urdf/xarm7.urdf",
        base="world",
        tip="link_eef",
        remark="1.5708 in the file: twists of 90.0002°",
    ),
    Arm(
        robot="Unitree Z1",
        package=EXAMPLES,
        file="z1_description/urdf/z1.urdf",
        base="world",
        tip="link06",
        ask_tip=True,
    ),
    Arm(
        robot="SO-ARM100",
        package=EXAMPLES,
        file="so_arm_description/urdf/so100.urdf",
        base="base",
        tip="jaw",
        remark="drawn by CAD: angles of six digits",
    ),
    _humanoid("Baxter right arm", "baxter_description/urdf/baxter.urdf", "base", "right_gripper"),
    _humanoid(
        "PR2 right arm",
        "pr2_description/urdf/pr2.urdf",
        "base_footprint",
        "r_gripper_tool_frame",
        "with the sliding torso",
    ),
    _humanoid(
        "TIAGo Pro left arm",
        "tiago_pro_description/robots/tiago_pro.urdf",
        "base_footprint",
        "gripper_left_base_link",
    ),
    Arm(
        robot="TIAGo arm",
        package=EXAMPLES,
        file="tiago_description/robots/tiago.urdf",
        base="torso_lift_link",
        tip="arm_tool_link",
        ask_base=True,
        ask_tip=True,
        remark="flat bodies, whose inertia rounding may make impossible",
    ),
    _humanoid("Romeo right arm", "romeo_description/urdf/romeo.urdf", "base_link", "r_wrist", "waist and arm"),
    Arm(
        robot="Talos left arm",
        package=EXAMPLES,
        file="talos_data/robots/talos_full_v2.urdf",
        base="torso_2_link",
        tip="gripper_left_base_link",
        ask_base=True,
        ask_tip=True,
    ),
    _humanoid("Talos left leg", "talos_data/robots/talos_full_v2.urdf", "base_link", "left_sole_link"),
    _humanoid(
        "Unitree G1 left arm",
        "g1_description/urdf/g1_29dof_rev_1_0.urdf",
        "pelvis",
        "left_rubber_hand",
        "waist and arm; shoulders turned by 16°, their common normals with the waist out of reach",
        hayati=("waist_pitch_joint",),
    ),
    _humanoid("Unitree G1 left leg", "g1_description/urdf/g1_29dof_rev_1_0.urdf", "pelvis", "left_ankle_roll_link"),
    _humanoid("iCub right arm", "icub_description/robots/icub.urdf", "base_link", "r_hand", "torso and arm"),
    _humanoid("Alex left arm", "alex_description/urdf/alex_nub_hands.urdf", "Pelvis", "leftNub"),
    _humanoid("ANYmal C left foreleg", "anymal_c_simple_description/urdf/anymal.urdf", "base", "LF_FOOT"),
    IIWA_OFFSET,
    Arm(
        robot="KUKA KR 16-2",
        package=RTB,
        file="kuka_description/kuka_kr16/urdf/kr16_2.urdf",
        base="base_link",
        tip="tool0",
        remark="axes 1, 4 and 6 point down or back, as KUKA's do",
    ),
    Arm(
        robot="KUKA KR 120 R2500 pro",
        package=RTB,
        file="kuka_description/kuka_kr120/urdf/kr120r2500pro.urdf",
        base="base_link",
        tip="tool0",
        remark="axes 1, 4 and 6 point down or back, as KUKA's do",
    ),
    Arm(
        robot="KUKA KR 210 L150",
        package=RTB,
        file="kuka_description/kuka_kr210/urdf/kr210l150.urdf",
        base="base_link",
        tip="tool0",
        remark="drawn by CAD: upper arm leaning by 0.0045°",
    ),
    IRB140,
    PUMA,
    Arm(
        robot="Lynxmotion AL5D",
        package=RTB,
        file="lynxmotion_al5d_description/urdf/al5d_robot.urdf",
        base="base",
        tip="link4",
        hayati=("j2", "j3"),
        remark="two joints 6e-10 rad off parallel, more than the tolerance leaves room for",
    ),
    Arm(
        robot="Lynxmotion AL5D",
        package=RTB,
        file="lynxmotion_al5d_description/urdf/al5d_robot.urdf",
        base="base",
        tip="link4",
        tolerance=1e-7,
        remark="plain rows",
    ),
    IIWA,
    XARM6_ROUNDED,
    XARM6,
    _suite("Franka Panda", "panda", "link7"),
    _suite("KUKA LBR iiwa 7", "iiwa", "link_7"),
    _suite("Kinova Gen3", "kinova3", "Bracelet_Link", remark="quaternions of six digits: twists of 90.0002°"),
    _suite("Kinova Jaco j2s7s300", "jaco", "j2s7s300_link_7"),
    _suite("Rethink Sawyer", "sawyer", "right_l6", remark="quaternions of six digits"),
    UR5E,
    XARM7,
    _suite("Baxter left arm", "baxter", "left_wrist", ask=True),
    _suite("TIAGo left arm", "tiago", "arm_left_6_link", ask=True, remark="with the sliding torso"),
    _suite("Fourier GR-1 right arm", "gr1", "r_hand_pitch", ask=True, remark="waist and arm"),
    _suite("Boston Dynamics Spot arm", "spot_arm", "arm_link_wr1"),
    _arm(AIRO, "UR3e", "arms/ur3e/ur3e.urdf", "base_link", "tool0"),
    _arm(AIRO, "UR5e", "arms/ur5e/ur5e.urdf", "base_link", "tool0"),
    _arm(
        DIFFERENTIABLE, "Kinova Jaco j2n6s300", "kinova_description/urdf/jaco_clean.urdf", "root", "j2n6s300_link_6"
    ),
    _arm(DIFFERENTIABLE, "KUKA LBR iiwa 7", "kuka_iiwa/urdf/iiwa7.urdf", "iiwa_link_0", "iiwa_link_ee"),
    _arm(
        DIFFERENTIABLE,
        "Franka Panda",
        "panda_description/urdf/panda_no_gripper.urdf",
        "panda_link0",
        "panda_virtual_ee_link",
    ),
    _arm(
        DIFFERENTIABLE,
        "Fetch arm",
        "fetch_description/urdf/fetch_arm_no_gripper.urdf",
        "base_link",
        "virtual_ee_link",
    ),
    _arm(
        DIFFERENTIABLE,
        "TriFinger Edu, first finger",
        "trifinger_edu_description/trifinger_edu.urdf",
        "base_link",
        "finger_tip_link_0",
        ask=True,
    ),
    _arm(
        PYROBOPLAN,
        "UR5 on a base",
        "ur_description/urdf/ur5_on_base.urdf",
        "world",
        "tool0",
        remark="a base that slides twice and turns",
    ),
    _arm(
        PYROBOPLAN,
        "UR10 on a base",
        "ur_description/urdf/ur10_on_base.urdf",
        "world",
        "tool0",
        remark="a base that slides twice and turns",
    ),
    _arm(PYROBOPLAN, "arm of eleven joints", "robot_12dof_description/urdf/robot_12dof.urdf", "link0", "link12"),
    _stretch("RE1V0", "RE1V0_tool_none", "link_wrist_yaw", "a telescope of four sections on a lift"),
    _stretch("RE2V0", "RE2V0_eoa_wrist_dw3_tool_nil", "link_wrist_quick_connect"),
    _stretch("SE3", "SE3_eoa_wrist_dw3_tool_nil", "link_wrist_quick_connect"),
    _models("ARX X5", "arx5", "base", "link6"),
    _models("ABB YuMi left arm", "yumi", "base", "yumi_link_7_l", ask=True),
    _models("ABB YuMi right arm", "yumi", "base", "yumi_link_7_r", ask=True),
    _models("Unitree Z1", "z1", "base", "link6"),
    _models("PR2 left arm", "pr2", "base", "l_wrist_roll_link", ask=True),
    _models("Unitree H1 left arm", "h1", "base", "left_elbow_link", ask=True),
    _models("Unitree G1 left arm", "g1", "base", "l_elbow_roll_link", ask=True),
    _models("Unitree Go2 left foreleg", "go2", "body", "FL_calf", ask=True),
    _models("Unitree B1 left foreleg", "b1", "base", "FL_calf", ask=True),
    _arm(ROBOTBLOCKSET, "Franka FR3", "fr3.xml", "base", "link7"),
    _arm(ROBOTBLOCKSET, "Franka Panda", "panda_no_hand.xml", "base", "link7"),
    _arm(ROBOTBLOCKSET, "KUKA LBR iiwa 14", "iiwa14.xml", "base", "link7"),
    _arm(ROBOTBLOCKSET, "Yaskawa HC20", "hc20.xml", "robot_base", "link6"),
    _arm(ROBOTBLOCKSET, "Yaskawa HC30", "hc30.xml", "robot_base", "link6"),
    _arm(ROBOTBLOCKSET, "UR10e", "ur10e.xml", "base", "wrist_3_link"),
    _arm(ROBOTBLOCKSET, "Unitree B2 left foreleg", "unitree_b2.xml", "base", "FL_calf", ask=True),
)
