"""Tables that makers and toolboxes have published."""

from __future__ import annotations

import math
from dataclasses import dataclass

from dh2sim.robot.row import Convention, JointType, Row
from dh2sim.robot.spec import RobotSpec
from scripts.real_arms.arm import Arm
from scripts.real_arms.arms import IIWA, IIWA_OFFSET, PANDA, PUMA, UR5, UR5E, UR10, XARM6, XARM7

Numbers = tuple[float, float, float, float]
"""a (m), alpha (degrees), d (m) and the offset of theta (degrees) of a row."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Published:
    """A published table of an arm that is imported too."""

    robot: str
    source: str
    """Where it is printed, as Markdown."""
    convention: Convention
    rows: tuple[Numbers, ...]
    arm: Arm
    turn: float = 0.0
    """Degrees by which the imported base is turned about its z, from the published one."""
    flange: bool = False
    """Whether the last row is fixed."""
    same_arm: bool = True
    """Whether the file describes the robot of the table."""
    same_senses: bool = True
    """Whether equal coordinates mean the same in both, so that poses can be compared."""
    why: str = ""
    """What differs, and why."""

    @property
    def spec(self) -> RobotSpec:
        """The table, to compute with."""
        last = len(self.rows) if self.flange else 0
        rows = [
            Row(
                name=f"joint_{i}",
                type=JointType.FIXED if i == last else JointType.REVOLUTE,
                convention=self.convention,
                a=a,
                alpha=math.radians(alpha),
                d=d,
                theta=math.radians(theta),
            )
            for i, (a, alpha, d, theta) in enumerate(self.rows, start=1)
        ]
        return RobotSpec(name="published", convention=self.convention, rows=tuple(rows))


_FRANKA = (
    "Franka Robotics, Franka Control Interface Documentation, *Robot and interface specifications*, "
    "[Denavit–Hartenberg parameters](https://frankarobotics.github.io/docs/control_parameters.html); after Craig"
)
_KST = (
    "M. Safeea, P. Neto, KUKA Sunrise Toolbox, "
    "[constDhDataOf14R820.m](https://github.com/Modi1987/KST-Kuka-Sunrise-Toolbox), which names KUKA's manual of the "
    "media flange as its source; after Craig"
)
_UR = (
    "Universal Robots, [DH Parameters for calculations of kinematics and dynamics]"
    "(https://www.universal-robots.com/articles/ur/application-installation/"
    "dh-parameters-for-calculations-of-kinematics-and-dynamics/)"
)
_UFACTORY = (
    "UFACTORY, Kinematic and Dynamic Parameters, [xArm {0}](https://docs.ufactory.cc/support_articles/developer/"
    "kinematic-and-dynamic-parameters/xarm-series/xarm-{0}), *Standard D-H Parameters*"
)
_CORKE = (
    "P. Corke, Robotics Toolbox for Python, [Puma560](https://petercorke.github.io/robotics-toolbox-python/"
    "_modules/roboticstoolbox/models/DH/Puma560.html), after P. Corke, B. Armstrong-Hélouvry, *A search for "
    "consensus among model parameters reported for the PUMA 560 robot*, Proc. IEEE Int. Conf. Robotics and "
    "Automation, 1994"
)
_TURNED = (
    "At coordinates zero the arm stretches along the x of the file's base_link, and so do dh2sim's x. The maker's "
    "base, which the file calls `base`, is turned by 180° about z, and his x(1) to x(5) point back along the arm. A "
    "row between two x that are both turned has the other sign of a and alpha and the same theta; x(6) is the "
    "flange's in both tables, hence the 180° in row 6."
)
_ELBOW = math.degrees(math.atan2(284.5, 53.5))


def _ur(d_1: float, a_2: float, a_3: float, d_4: float, d_5: float, d_6: float) -> tuple[Numbers, ...]:
    return (
        (0, 90, d_1, 0),
        (a_2, 0, 0, 0),
        (a_3, 0, 0, 0),
        (0, 90, d_4, 0),
        (0, -90, d_5, 0),
        (0, 0, d_6, 0),
    )


def _iiwa(arm: Arm, why: str, *, same_arm: bool) -> Published:
    twists = (0, -90, 90, 90, -90, -90, 90)
    offsets = (0.36, 0, 0.42, 0, 0.4, 0, 0.126)
    return Published(
        robot=arm.robot,
        source=_KST,
        convention=Convention.MODIFIED,
        rows=tuple((0, alpha, d, 0) for alpha, d in zip(twists, offsets, strict=True)),
        arm=arm,
        same_arm=same_arm,
        why=why,
    )


PUBLISHED: tuple[Published, ...] = (
    Published(
        robot="Franka Panda",
        source=_FRANKA,
        convention=Convention.MODIFIED,
        rows=(
            (0, 0, 0.333, 0),
            (0, -90, 0, 0),
            (0, 90, 0.316, 0),
            (0.0825, 90, 0, 0),
            (-0.0825, -90, 0.384, 0),
            (0, 90, 0, 0),
            (0.088, 90, 0, 0),
            (0, 0, 0.107, 0),
        ),
        flange=True,
        arm=PANDA,
        why="The flange stands on axis 7, so that its fixed row is the d of row 7. Nothing else differs.",
    ),
    _iiwa(
        IIWA,
        "The file's last link stands 0.081 m behind the wrist, the flange 0.126 m: E is the 45 mm between. "
        "Nothing else differs.",
        same_arm=True,
    ),
    Published(
        robot="UR5",
        source=f"{_UR}; the CB3 manual has the same numbers",
        convention=Convention.STANDARD,
        rows=_ur(0.089159, -0.425, -0.39225, 0.10915, 0.09465, 0.0823),
        arm=UR5,
        turn=180.0,
        why=f"{_TURNED} (The Robotics Toolbox for Python has 0.089459 for d1, though it names the same page.)",
    ),
    Published(
        robot="UR10",
        source=_UR,
        convention=Convention.STANDARD,
        rows=_ur(0.1273, -0.612, -0.5723, 0.163941, 0.1157, 0.0922),
        arm=UR10,
        turn=180.0,
        why="As for the UR5.",
    ),
    Published(
        robot="UFACTORY xArm6",
        source=_UFACTORY.format(6),
        convention=Convention.STANDARD,
        rows=(
            (0, -90, 0.267, 0),
            (math.hypot(0.2845, 0.0535), 0, 0, -_ELBOW),
            (0.0775, -90, 0, _ELBOW),
            (0, 90, 0.3425, 0),
            (0.076, -90, 0, 0),
            (0, 0, 0.097, 0),
        ),
        arm=XARM6,
        why="Nothing differs. UFACTORY gives a2 as `sqrt(284.5^2+53.5^2) = 289.48866` mm; the formula, which is in "
        "the table here, makes 289.486615: the printed digits are 2 µm off.",
    ),
    Published(
        robot="UFACTORY xArm7",
        source=_UFACTORY.format(7),
        convention=Convention.STANDARD,
        rows=(
            (0, -90, 0.267, 0),
            (0, 90, 0, 0),
            (0.0525, 90, 0.293, 0),
            (0.0775, 90, 0, 0),
            (0, 90, 0.3425, 0),
            (0.076, -90, 0, 0),
            (0, 0, 0.097, 0),
        ),
        arm=XARM7,
        why="Nothing differs.",
    ),
    _iiwa(
        IIWA_OFFSET,
        "In the file axes 2 and 4 pass the axes before them at 0.436 mm, which they meet in the published table. An "
        "import that rounded this away would make another robot than the file's.",
        same_arm=False,
    ),
    Published(
        robot="UR5e",
        source=_UR,
        convention=Convention.STANDARD,
        rows=_ur(0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996),
        arm=UR5E,
        turn=180.0,
        same_arm=False,
        why="The file's lengths are whole millimetres, up to 0.7 mm off the maker's. It ends in a frame on the last "
        "joint, before the flange. x as for the UR5.",
    ),
    Published(
        robot="Unimation PUMA 560",
        source=_CORKE,
        convention=Convention.STANDARD,
        rows=(
            (0, 90, 0.672, 0),
            (0.4318, 0, 0, 0),
            (0.0203, -90, 0.15005, 0),
            (0, 90, 0.4318, 0),
            (0, -90, 0, 0),
            (0, 0, 0, 0),
        ),
        arm=PUMA,
        same_arm=False,
        same_senses=False,
        why="Whatever frames are chosen, the distance between two axes stays. From shoulder to elbow it is 0.4318 m "
        "by the table and 0.432277 m in the file; from elbow to forearm 0.0203 m and nothing. The file has the "
        "offset of the forearm before the elbow instead of behind it, and 0.432277 is the hypotenuse of 0.4318 and "
        "0.0203. It looks right at coordinates zero and moves differently. Besides, d1, d3 and d4 differ by up to "
        "1.3 mm, d6 leads to the flange, and joints 4 to 6 turn the other way.",
    ),
)
