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
