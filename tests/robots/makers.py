"""Arms as their makers describe them: joint transforms and inertials, a third way beside table and chain.

The numbers are those of the descriptions named in ``source``, in rad, m and kg, with ``RIGHT`` where a description
has π/2 to a few digits. Nothing here comes from a Denavit-Hartenberg table: pinocchio composes the transforms, and
computes mass matrices and gravity torques from the inertials.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from dh2sim.typing import Array

if TYPE_CHECKING:
    import pinocchio

Vector = tuple[float, float, float]

RIGHT: Final = math.pi / 2
ZERO: Final[Vector] = (0.0, 0.0, 0.0)
X: Final[Vector] = (1.0, 0.0, 0.0)
Y: Final[Vector] = (0.0, 1.0, 0.0)
Z: Final[Vector] = (0.0, 0.0, 1.0)


class Inertial(NamedTuple):
    """Mass, centre of mass and inertia about it of a link, in the link's frame."""

    mass: float
    com: Vector
    tensor: tuple[float, float, float, float, float, float]
    """ixx, ixy, ixz, iyy, iyz, izz."""
    rpy: Vector = ZERO
    """Of the tensor's axes."""


class Joint(NamedTuple):
    """A revolute joint: its pose on its parent, its axis, and the link that it moves."""

    xyz: Vector
    rpy: Vector = ZERO
    axis: Vector = Z
    inertial: Inertial | None = None


class Arm(NamedTuple):
    """A maker's description of an arm."""

    source: str
    joints: Sequence[Joint]
    tool: tuple[Vector, Vector] = (ZERO, ZERO)
    """Position and roll, pitch, yaw of the robot file's tool0 in the last link."""
    base: tuple[Vector, Vector] = (ZERO, ZERO)
    """Position and roll, pitch, yaw of the description's base in the robot file's base_link."""

    @property
    def weighed(self) -> bool:
        """Whether every link has its mass."""
        return all(joint.inertial is not None for joint in self.joints)


_UR: Final = (
    "UniversalRobots/Universal_Robots_ROS2_Description 2.4.5,"
    " config/{0}/default_kinematics.yaml and physical_parameters.yaml"
)

ARMS: Final[dict[str, Arm]] = {
    # from 'base', the controller's frame, which is turned by 180 degrees about z in that package's base_link
    "ur5e": Arm(
        source=_UR.format("ur5e"),
        joints=[
            Joint(
                (0, 0, 0.1625),
                inertial=Inertial(3.761, (0, -0.00193, -0.02561), (0.0102675, 0, 0, 0.0102675, 0, 0.00666)),
            ),
            Joint(
                ZERO,
                (RIGHT, 0, 0),
                inertial=Inertial(
                    8.058,
                    (-0.2125, 0, 0.11336),
                    (0.13388583541666665, 0, 0, 0.13388583541666665, 0, 0.0151074),
                    rpy=(0, RIGHT, 0),
                ),
            ),
            Joint(
                (-0.425, 0, 0),
                inertial=Inertial(
                    2.846,
                    (-0.2422, 0, 0.0265),
                    (0.03120936758333333, 0, 0, 0.03120936758333333, 0, 0.004095),
                    rpy=(0, RIGHT, 0),
                ),
            ),
            Joint(
                (-0.3922, 0, 0.1333),
                inertial=Inertial(1.37, (0, -0.01634, -0.0018), (0.0025599, 0, 0, 0.0025599, 0, 0.0021942)),
            ),
            Joint(
                (0, -0.0997, 0),
                (RIGHT, 0, 0),
                inertial=Inertial(1.3, (0, 0.01634, -0.0018), (0.0025599, 0, 0, 0.0025599, 0, 0.0021942)),
            ),
            Joint(
                (0, 0.0996, 0),
                (RIGHT, math.pi, math.pi),
                inertial=Inertial(
                    0.365,
                    (0, 0, -0.001159),
                    (9.890414008333333e-05, 0, 0, 9.890414008333333e-05, 0, 0.0001321171875),
                ),
            ),
        ],
    ),
    "ur10e": Arm(
        source=_UR.format("ur10e"),
        joints=[
            Joint(
                (0, 0, 0.1807),
                inertial=Inertial(
                    7.369,
                    (0.021, -0.027, 0),
                    (0.03408, 0.00002, -0.00425, 0.03529, 0.00008, 0.02156),
                    rpy=(RIGHT, 0, 0),
                ),
            ),
            Joint(
                ZERO,
                (RIGHT, 0, 0),
                inertial=Inertial(
                    13.051, (-0.2327, 0, 0.158), (0.02814, 0.00005, -0.01561, 0.77068, 0.00002, 0.76943)
                ),
            ),
            Joint(
                (-0.6127, 0, 0),
                inertial=Inertial(3.989, (-0.33155, 0, 0.068), (0.01014, 0.00008, 0.00916, 0.30928, 0, 0.30646)),
            ),
            Joint(
                (-0.57155, 0, 0.17415),
                inertial=Inertial(
                    2.1, (0, -0.018, 0.007), (0.00296, -0.00001, 0, 0.00222, -0.00024, 0.00258), rpy=(RIGHT, 0, 0)
                ),
            ),
            Joint(
                (0, -0.11985, 0),
                (RIGHT, 0, 0),
                inertial=Inertial(
                    1.98, (0, 0.018, -0.007), (0.00296, -0.00001, 0, 0.00222, -0.00024, 0.00258), rpy=(-RIGHT, 0, 0)
                ),
            ),
            Joint(
                (0, 0.11655, 0),
                (RIGHT, math.pi, math.pi),
                inertial=Inertial(0.615, (0, 0, -0.026), (0.0004, 0, 0, 0.00041, 0, 0.00034)),
            ),
        ],
    ),
    "franka_panda": Arm(
        source="frankaemika/franka_description 0.4.0, robots/fer/kinematics.yaml; frankaemika/franka_ros,"
        " franka_description/robots/common/inertial.yaml at b2a62ff",
        joints=[
            Joint(
                (0, 0, 0.333),
                inertial=Inertial(
                    4.970684,
                    (0.003875, 0.002081, -0.04762),
                    (0.70337, -0.000139, 0.006772, 0.70661, 0.019169, 0.009117),
                ),
            ),
            Joint(
                ZERO,
                (-RIGHT, 0, 0),
                inertial=Inertial(
                    0.646926,
                    (-0.003141, -0.02872, 0.003495),
                    (0.007962, -0.003925, 0.010254, 0.02811, 0.000704, 0.025995),
                ),
            ),
            Joint(
                (0, -0.316, 0),
                (RIGHT, 0, 0),
                inertial=Inertial(
                    3.228604,
                    (0.027518, 0.039252, -0.066502),
                    (0.037242, -0.004761, -0.011396, 0.036155, -0.012805, 0.01083),
                ),
            ),
            Joint(
                (0.0825, 0, 0),
                (RIGHT, 0, 0),
                inertial=Inertial(
                    3.587895,
                    (-0.05317, 0.104419, 0.027454),
                    (0.025853, 0.007796, -0.001332, 0.019552, 0.008641, 0.028323),
                ),
            ),
            Joint(
                (-0.0825, 0.384, 0),
                (-RIGHT, 0, 0),
                inertial=Inertial(
                    1.225946,
                    (-0.011953, 0.041065, -0.038437),
                    (0.035549, -0.002117, -0.004037, 0.029474, 0.000229, 0.008627),
                ),
            ),
            Joint(
                ZERO,
                (RIGHT, 0, 0),
                inertial=Inertial(
                    1.666555,
                    (0.060149, -0.014117, -0.010517),
                    (0.001964, 0.000109, -0.001158, 0.004354, 0.000341, 0.005433),
                ),
            ),
            Joint(
                (0.088, 0, 0),
                (RIGHT, 0, 0),
                inertial=Inertial(
                    0.735522,
                    (0.010517, -0.004252, 0.061597),
                    (0.012516, -0.000428, -0.001196, 0.010027, -0.000741, 0.004815),
                ),
            ),
        ],
        tool=((0, 0, 0.107), ZERO),
    ),
    "kuka_iiwa14": Arm(
        source="lbr-stack/lbr_fri_ros2_stack, lbr_description 2.1.2, urdf/iiwa14/iiwa14_description.xacro",
        joints=[
            Joint(
                (0, 0, 0.1475),
                inertial=Inertial(5.289529, (0, -0.033795, 0.132404), (0.042462, 0, 0, 0.042838, 0.006341, 0.01587)),
            ),
            Joint(
                (0, -0.01, 0.2125),
                axis=Y,
                inertial=Inertial(
                    5.688888,
                    (0.000136, 0.047548, 0.076322),
                    (0.055182, -3.3e-05, 5.6e-05, 0.053983, 0.010034, 0.016523),
                ),
            ),
            Joint(
                (0, 0.01, 0.228),
                inertial=Inertial(3.461245, (0, 0.034913, 0.123108), (0.02172, 0, 0, 0.02073, -0.003845, 0.007701)),
            ),
            Joint(
                (0, 0.0105, 0.192),
                axis=(0, -1, 0),
                inertial=Inertial(4.122995, (0, -0.039793, 0.086944), (0.03241, 0, 0, 0.030758, -0.006022, 0.009883)),
            ),
            Joint(
                (0, -0.0105, 0.2075),
                inertial=Inertial(1.563756, (0, -0.029824, 0.076267), (0.008677, 0, 0, 0.007297, 0.002869, 0.003935)),
            ),
            Joint(
                (0, -0.0707, 0.1925),
                axis=Y,
                inertial=Inertial(2.457878, (0, 0.07102, 0.00495), (0.007227, 0, 0, 0.006958, 0.000318, 0.004734)),
            ),
            Joint(
                (0, 0.0707, 0.091),
                inertial=Inertial(0.265331, (3e-06, -2e-06, 0.013782), (0.000175, 0, 0, 0.000175, 0, 0.000306)),
            ),
        ],
        tool=((0, 0, 0.035), ZERO),
    ),
    "kinova_gen3": Arm(
        source="Kinovarobotics/ros2_kortex, kortex_description 0.2.5, "
        "arms/gen3/7dof/urdf/gen3_macro.xacro, with vision",
        joints=[
            Joint(
                (0, 0, 0.15643),
                (math.pi, 0, 0),
                inertial=Inertial(
                    1.3773, (-2.3e-05, -0.010364, -0.07336), (0.00457, 1e-06, 2e-06, 0.004831, 0.000448, 0.001409)
                ),
            ),
            Joint(
                (0, 0.005375, -0.12838),
                (RIGHT, 0, 0),
                inertial=Inertial(
                    1.1636, (-4.4e-05, -0.09958, -0.013278), (0.011088, 5e-06, 0, 0.001072, -0.000691, 0.011255)
                ),
            ),
            Joint(
                (0, -0.21038, -0.006375),
                (-RIGHT, 0, 0),
                inertial=Inertial(
                    1.1636, (-4.4e-05, -0.006641, -0.117892), (0.010932, 0, -7e-06, 0.011127, 0.000606, 0.001043)
                ),
            ),
            Joint(
                (0, 0.006375, -0.21038),
                (RIGHT, 0, 0),
                inertial=Inertial(
                    0.9302, (-1.8e-05, -0.075478, -0.015006), (0.008147, -1e-06, 0, 0.000631, -0.0005, 0.008316)
                ),
            ),
            Joint(
                (0, -0.20843, -0.006375),
                (-RIGHT, 0, 0),
                inertial=Inertial(
                    0.6781, (1e-06, -0.009432, -0.063883), (0.001596, 0, 0, 0.001607, 0.000256, 0.000399)
                ),
            ),
            Joint(
                (0, 0.00017505, -0.10593),
                (RIGHT, 0, 0),
                inertial=Inertial(
                    0.6781, (1e-06, -0.045483, -0.00965), (0.001641, 0, 0, 0.00041, -0.000278, 0.001641)
                ),
            ),
            Joint(
                (0, -0.10593, -0.00017505),
                (-RIGHT, 0, 0),
                inertial=Inertial(
                    0.5, (0.000281, 0.011402, -0.029798), (0.000587, 3e-06, 3e-06, 0.000369, -0.000118, 0.000609)
                ),
            ),
        ],
        tool=((0, 0, -0.061525), (math.pi, 0, 0)),
    ),
    "xarm7": Arm(
        source="xArm-Developer/xarm_ros, xarm_description/config: kinematics/default/xarm7_default_kinematics.yaml"
        " at 74e75cf, link_inertial/xarm7_type7_HT_BR2.yaml at 3f7edbb",
        joints=[
            Joint(
                (0, 0, 0.267),
                inertial=Inertial(
                    2.382,
                    (-0.0002, 0.02905, -0.01233),
                    (0.0056905, -1.579e-05, 5.125e-06, 0.0049566, -0.000873378, 0.003316654),
                ),
            ),
            Joint(
                ZERO,
                (-RIGHT, 0, 0),
                inertial=Inertial(
                    1.869,
                    (0.00022, -0.12856, 0.01735),
                    (0.0095989, 1.541e-06, 5.56e-06, 0.00382472, -0.00317156, 0.007565669),
                ),
            ),
            Joint(
                (0, -0.293, 0),
                (RIGHT, 0, 0),
                inertial=Inertial(
                    1.6383,
                    (0.0466, -0.02463, -0.00768),
                    (0.00310955, 0.00030837, -0.00058453, 0.00264483, 0.000338893, 0.0026624),
                ),
            ),
            Joint(
                (0.0525, 0, 0),
                (RIGHT, 0, 0),
                inertial=Inertial(
                    1.7269,
                    (0.07047, -0.11575, 0.012),
                    (0.005889, 0.00137112, 0.00088143, 0.00359703, -0.001762155, 0.00543244),
                ),
            ),
            Joint(
                (0.0775, -0.3425, 0),
                (RIGHT, 0, 0),
                inertial=Inertial(
                    1.3203,
                    (-0.00032, 0.01604, -0.026),
                    (0.00534665, 1.5117e-05, -3.69e-07, 0.0049779, -0.00022132, 0.0013624),
                ),
            ),
            Joint(
                ZERO,
                (RIGHT, 0, 0),
                inertial=Inertial(
                    1.325,
                    (0.06469, 0.03278, 0.02141),
                    (0.0014745, -0.000488, 0.0002953, 0.0019037, 0.00014749, 0.0023652),
                ),
            ),
            Joint(
                (0.076, 0.097, 0),
                (-RIGHT, 0, 0),
                inertial=Inertial(0.17, (0, -0.00677, -0.01098), (9.3e-05, 0, 0, 5.87e-05, -3.6e-06, 0.000132)),
            ),
        ],
    ),
    "abb_irb120": Arm(
        source="ros-industrial/abb_experimental, abb_irb120_support/urdf/irb120_3_58_macro.xacro at 20b9cf8",
        joints=[
            Joint(ZERO),
            Joint((0, 0, 0.29), axis=Y),
            Joint((0, 0, 0.27), axis=Y),
            Joint((0, 0, 0.07), axis=X),
            Joint((0.302, 0, 0), axis=Y),
            Joint((0.072, 0, 0), axis=X),
        ],
        tool=(ZERO, (0, RIGHT, 0)),
    ),
    "staubli_tx2_60": Arm(
        source="ros-industrial/staubli_experimental, staubli_tx2_60_support 0.1.0, urdf/tx2_60_macro.xacro",
        joints=[
            Joint((0, 0, 0.375)),
            Joint(ZERO, axis=Y),
            Joint((0, 0.02, 0.29), axis=Y),
            Joint(ZERO),
            Joint((0, 0, 0.31), axis=Y),
            Joint((0, 0, 0.07)),
        ],
    ),
    "kuka_kr6_r900": Arm(
        source="kroshu/kuka_robot_descriptions, kuka_agilus_support/urdf/kr6_r900_2_macro.xacro at 7766e92,"
        " rounded to micrometres",
        joints=[
            Joint(
                (0, 0, 0.208),
                (math.pi, 0, 0),
                inertial=Inertial(
                    8.416,
                    (0.00641, -0.016268, -0.106589),
                    (0.074061839, 0, 0, 0.089047835, 0, 0.110395707),
                    rpy=(1.304519343, -0.942861602, -1.422651095),
                ),
            ),
            Joint(
                (0.025, -0.0907, -0.192),
                (RIGHT, 0, 0),
                inertial=Inertial(
                    16.7929,
                    (0.147417, -0.004477, -0.073703),
                    (0.548306118, 0, 0, 0.087230945, 0, 0.588517096),
                    rpy=(1.841086613, -1.537399273, -0.283422661),
                ),
            ),
            Joint(
                (0.455, 0, -0.0042),
                inertial=Inertial(
                    5.988,
                    (0.041651, -0.012325, -0.067986),
                    (0.042611644, 0, 0, 0.018920416, 0, 0.047800218),
                    rpy=(-2.675092481, -1.325851426, 1.194666577),
                ),
            ),
            Joint(
                (0.196, -0.025, -0.0865),
                (RIGHT, 0, -RIGHT),
                inertial=Inertial(
                    4.699853,
                    (0.001448, 0.009426, -0.081643),
                    (0.010489708, 0, 0, 0.044238981, 0, 0.047212534),
                    rpy=(-2.330109288, -1.52109801, 2.285952536),
                ),
            ),
            Joint(
                (0, 0.0505, -0.224),
                (0, RIGHT, RIGHT),
                inertial=Inertial(
                    1.6128,
                    (0.009321, 0.000783, -0.026463),
                    (0.001731776, 0, 0, 0.002219501, 0, 0.00246709),
                    rpy=(1.567898715, -0.861171676, -3.100280256),
                ),
            ),
            Joint(
                (0.0615, 0, -0.0505),
                (RIGHT, 0, -RIGHT),
                inertial=Inertial(
                    0.734, (0, 0, -0.011765), (0.000183698, 0, 0, 0.000182136, 0, 0.00029589), rpy=(0, 0, 1.223427189)
                ),
            ),
        ],
        tool=((0, 0, -0.0285), (math.pi, 0, math.pi)),
    ),
    "so101": Arm(
        source="TheRobotStudio/SO-ARM100, Simulation/SO101/so101_new_calib.urdf at fda892c",
        joints=[
            Joint(
                (0.0388353, 0, 0.0624),
                (math.pi, 0, -math.pi),
                inertial=Inertial(
                    0.100006,
                    (-0.0307604, -1.66727e-05, -0.0252713),
                    (8.3759e-05, 7.55525e-08, -1.16342e-06, 8.10403e-05, 1.54663e-07, 2.39783e-05),
                ),
            ),
            Joint(
                (-0.0303992, -0.0182778, -0.0542),
                (-RIGHT, -RIGHT, 0),
                inertial=Inertial(
                    0.103,
                    (-0.0898471, -0.00838224, 0.0184089),
                    (4.08002e-05, -1.97819e-05, -4.03016e-08, 0.000147318, 8.97326e-09, 0.000142487),
                ),
            ),
            Joint(
                (-0.11257, -0.028, 0),
                (0, 0, RIGHT),
                inertial=Inertial(
                    0.104,
                    (-0.0980701, 0.00324376, 0.0182831),
                    (2.87438e-05, 7.41152e-06, 1.26409e-06, 0.000159844, -4.90188e-08, 0.00014529),
                ),
            ),
            Joint(
                (-0.1349, 0.0052, 0),
                (0, 0, -RIGHT),
                inertial=Inertial(
                    0.079,
                    (-0.000103312, -0.0386143, 0.0281156),
                    (3.68263e-05, 1.7893e-08, -5.28128e-08, 2.5391e-05, 3.6412e-06, 2.1e-05),
                ),
            ),
            Joint(
                (0, -0.0611, 0.0181),
                (RIGHT, 0.0486795, math.pi),
                inertial=Inertial(
                    0.087,
                    (0.000213627, 0.000245138, -0.025187),
                    (2.75087e-05, -3.35241e-07, -5.7352e-06, 4.33657e-05, -5.17847e-08, 3.45059e-05),
                ),
            ),
        ],
        tool=((-0.0079, -0.000218121, -0.0981274), (0, math.pi, 0)),
    ),
}


class Described:
    """An arm as pinocchio has it, made of a maker's description alone."""

    def __init__(self, arm: Arm, pin: Any) -> None:
        self._pin = pin
        self._model: pinocchio.Model = pin.Model()
        self._T_last_tool = _pose(pin, *arm.tool)
        parent, placement = 0, _pose(pin, *arm.base)
        for i, joint in enumerate(arm.joints, start=1):
            revolute = pin.JointModelRevoluteUnaligned(np.array(joint.axis, dtype=float))
            parent = self._model.addJoint(
                parent, revolute, placement * _pose(pin, joint.xyz, joint.rpy), f"joint_{i}"
            )
            placement = pin.SE3.Identity()
            if joint.inertial is not None:
                mass, com, (ixx, ixy, ixz, iyy, iyz, izz), rpy = joint.inertial
                tensor = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
                T_link_com = _pose(pin, com, rpy)
                body = pin.Inertia(mass, np.zeros(3), tensor)
                self._model.appendBodyToJoint(parent, body, T_link_com)
        self._data = self._model.createData()

    def tool_pose(self, q: Array) -> Array:
        """Return the pose of tool0 in base_link, shape (4, 4)."""
        self._pin.forwardKinematics(self._model, self._data, q)
        pose: Array = (self._data.oMi[self._model.njoints - 1] * self._T_last_tool).homogeneous
        return pose

    def mass_matrix(self, q: Array) -> Array:
        """Return the mass matrix, shape (n, n)."""
        upper = np.triu(self._pin.crba(self._model, self._data, q))
        matrix: Array = upper + np.triu(upper, 1).T
        return matrix

    def gravity_torques(self, q: Array) -> Array:
        """Return the torques that hold the arm against gravity, shape (n,)."""
        torques: Array = self._pin.computeGeneralizedGravity(self._model, self._data, q).copy()
        return torques


def _pose(pin: Any, xyz: Vector, rpy: Vector) -> Any:
    return pin.SE3(pin.rpy.rpyToMatrix(*map(float, rpy)), np.array(xyz, dtype=float))
