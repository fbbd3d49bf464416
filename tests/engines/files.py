"""Model files that engines are to read."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from dh2sim.engines.engine import DynamicsEngine, PoseEngine
from dh2sim.engines.mujoco_engine import MujocoEngine
from dh2sim.engines.pinocchio_engine import PinocchioEngine
from dh2sim.engines.pybullet_engine import PybulletEngine
from dh2sim.engines.yourdfpy_engine import YourdfpyEngine
from dh2sim.formats.mjcf.write import to_mjcf
from dh2sim.formats.urdf.write import to_urdf
from dh2sim.model.robot_model import RobotModel

PYBULLET = find_spec("pybullet") is not None
"""Whether it is installed: it has wheels for few versions of Python."""
DYNAMIC = ["mujoco-mjcf", "mujoco-urdf", "pinocchio", *(["pybullet"] if PYBULLET else [])]
ENGINES = [*DYNAMIC, "yourdfpy"]


def write(built: RobotModel, folder: Path) -> None:
    """Write both formats as robot.xml and robot.urdf."""
    (folder / "robot.xml").write_text(to_mjcf(built))
    (folder / "robot.urdf").write_text(to_urdf(built))


def path_of(name: str, folder: Path) -> Path:
    """The file that an engine of this name reads."""
    return folder / ("robot.xml" if name == "mujoco-mjcf" else "robot.urdf")


def pose_engine(name: str, path: Path, joints: list[str], rows: int) -> PoseEngine:
    """An engine by its name."""
    if name == "yourdfpy":
        return YourdfpyEngine(path, joints, rows)
    return dynamics_engine(name, path, joints, rows)


def dynamics_engine(name: str, path: Path, joints: list[str], rows: int) -> DynamicsEngine:
    """One that also knows velocities and masses."""
    if name == "pinocchio":
        return PinocchioEngine(path, joints, rows)
    if name == "pybullet":
        return PybulletEngine(path, joints, rows)
    return MujocoEngine(path, joints, rows)


def joint_names(built: RobotModel) -> list[str]:
    """Names of the moving joints, in the order of a joint vector."""
    return [joint.name for joint in built.moving_joints]
