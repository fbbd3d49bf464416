"""From a Denavit-Hartenberg table to a simulated robot that provably matches it.

Names are imported when they are first used, so that ``import dh2sim`` costs next to nothing.
"""

from __future__ import annotations

TYPE_CHECKING = False  # that of ``typing``, whose import would cost half the time
_HOMES = {
    "ActuatorSpec": "robot.row",
    "Calibration": "calibrate.result",
    "Comparison": "compare.comparison",
    "Continuous": "robot.table_rows",
    "Dh2simError": "errors",
    "Dynamics": "robot.row",
    "Explanation": "inverse.textbook",
    "Fixed": "robot.table_rows",
    "ImportOptions": "importing.sources",
    "InverseSolver": "inverse.solver",
    "KinematicChain": "kinematics.chain",
    "Limits": "robot.row",
    "LinkSpec": "robot.links",
    "Measurements": "calibrate.measurements",
    "Mobility": "mobility.result",
    "PayloadSpec": "robot.links",
    "Pose": "robot.links",
    "Prismatic": "robot.table_rows",
    "Revolute": "robot.table_rows",
    "Robot": "robot_facade",
    "RobotError": "errors",
    "RobotFileError": "errors",
    "RobotModel": "model.robot_model",
    "RobotSpec": "robot.spec",
    "Row": "robot.row",
    "SampledTrajectory": "trajectory.files",
    "SerialChain": "kinematics.serial_chain",
    "SerialJoint": "kinematics.serial_chain",
    "ShapeSpec": "robot.links",
    "Solutions": "inverse.solutions",
    "SymbolicForm": "symbolic.request",
    "TableBatch": "kinematics.table_batch",
    "ToolSpec": "robot.links",
    "Trajectory": "trajectory.trajectory",
    "Workspace": "workspace.workspace",
    "build_chain": "kinematics.chain",
    "build_model": "model.build",
    "calibrate_robot": "calibrate.calibration",
    "check_files": "checking.run",
    "compute_workspace": "workspace.workspace",
    "convert_robot": "importing.convert",
    "diff": "compare.comparison",
    "draw_robot": "draw.diagram.drawing",
    "explain_inverse_kinematics": "inverse.textbook",
    "export_robot": "export",
    "find_mobility": "mobility.robot_mechanism",
    "find_slips": "model.slips",
    "forward_kinematics": "kinematics.forward",
    "frame_poses": "kinematics.forward",
    "generate_code": "codegen.generate",
    "geometric_jacobian": "kinematics.forward",
    "grade": "compare.grading",
    "import_robot": "importing.sources",
    "inverse_kinematics": "inverse.solver",
    "load_robot": "robot.read",
    "measurements": "calibrate.measurements",
    "parse_robot": "robot.read",
    "plan_measurements": "calibrate.plan",
    "plan_mechanism_trajectory": "trajectory.mechanism",
    "plan_trajectory": "trajectory.plan",
    "read_measurements": "calibrate.data_file",
    "read_trajectory": "trajectory.files",
    "recover_table": "kinematics.frame_assignment.recover",
    "robot_file_text": "robot.write",
    "rollout": "simulate.run",
    "save_robot": "robot.write",
    "sweep_designs": "sweep.sweep",
    "symbolic_form": "symbolic.request",
    "to_mjcf": "formats.mjcf.write",
    "to_scene": "formats.mjcf.scene",
    "to_urdf": "formats.urdf.write",
    "validate_robot": "validate.run",
}
"""The module of every public name; a type checker reads the same below."""

__all__ = [*_HOMES]

if TYPE_CHECKING:
    from dh2sim.calibrate.calibration import calibrate_robot as calibrate_robot
    from dh2sim.calibrate.data_file import read_measurements as read_measurements
    from dh2sim.calibrate.measurements import Measurements as Measurements
    from dh2sim.calibrate.measurements import measurements as measurements
    from dh2sim.calibrate.plan import plan_measurements as plan_measurements
    from dh2sim.calibrate.result import Calibration as Calibration
    from dh2sim.checking.run import check_files as check_files
    from dh2sim.codegen.generate import generate_code as generate_code
    from dh2sim.compare.comparison import Comparison as Comparison
    from dh2sim.compare.comparison import diff as diff
    from dh2sim.compare.grading import grade as grade
    from dh2sim.draw.diagram.drawing import draw_robot as draw_robot
    from dh2sim.errors import Dh2simError as Dh2simError
    from dh2sim.errors import RobotError as RobotError
    from dh2sim.errors import RobotFileError as RobotFileError
    from dh2sim.export import export_robot as export_robot
    from dh2sim.formats.mjcf.scene import to_scene as to_scene
    from dh2sim.formats.mjcf.write import to_mjcf as to_mjcf
    from dh2sim.formats.urdf.write import to_urdf as to_urdf
    from dh2sim.importing.convert import convert_robot as convert_robot
    from dh2sim.importing.sources import ImportOptions as ImportOptions
    from dh2sim.importing.sources import import_robot as import_robot
    from dh2sim.inverse.solutions import Solutions as Solutions
    from dh2sim.inverse.solver import InverseSolver as InverseSolver
    from dh2sim.inverse.solver import inverse_kinematics as inverse_kinematics
    from dh2sim.inverse.textbook import Explanation as Explanation
    from dh2sim.inverse.textbook import explain_inverse_kinematics as explain_inverse_kinematics
    from dh2sim.kinematics.chain import KinematicChain as KinematicChain
    from dh2sim.kinematics.chain import build_chain as build_chain
    from dh2sim.kinematics.forward import forward_kinematics as forward_kinematics
    from dh2sim.kinematics.forward import frame_poses as frame_poses
    from dh2sim.kinematics.forward import geometric_jacobian as geometric_jacobian
    from dh2sim.kinematics.frame_assignment.recover import recover_table as recover_table
    from dh2sim.kinematics.serial_chain import SerialChain as SerialChain
    from dh2sim.kinematics.serial_chain import SerialJoint as SerialJoint
    from dh2sim.kinematics.table_batch import TableBatch as TableBatch
    from dh2sim.mobility.result import Mobility as Mobility
    from dh2sim.mobility.robot_mechanism import find_mobility as find_mobility
    from dh2sim.model.build import build_model as build_model
    from dh2sim.model.robot_model import RobotModel as RobotModel
    from dh2sim.model.slips import find_slips as find_slips
    from dh2sim.robot.links import LinkSpec as LinkSpec
    from dh2sim.robot.links import PayloadSpec as PayloadSpec
    from dh2sim.robot.links import Pose as Pose
    from dh2sim.robot.links import ShapeSpec as ShapeSpec
    from dh2sim.robot.links import ToolSpec as ToolSpec
    from dh2sim.robot.read import load_robot as load_robot
    from dh2sim.robot.read import parse_robot as parse_robot
    from dh2sim.robot.row import ActuatorSpec as ActuatorSpec
    from dh2sim.robot.row import Dynamics as Dynamics
    from dh2sim.robot.row import Limits as Limits
    from dh2sim.robot.row import Row as Row
    from dh2sim.robot.spec import RobotSpec as RobotSpec
    from dh2sim.robot.table_rows import Continuous as Continuous
    from dh2sim.robot.table_rows import Fixed as Fixed
    from dh2sim.robot.table_rows import Prismatic as Prismatic
    from dh2sim.robot.table_rows import Revolute as Revolute
    from dh2sim.robot.write import robot_file_text as robot_file_text
    from dh2sim.robot.write import save_robot as save_robot
    from dh2sim.robot_facade import Robot as Robot
    from dh2sim.simulate.run import rollout as rollout
    from dh2sim.sweep.sweep import sweep_designs as sweep_designs
    from dh2sim.symbolic.request import SymbolicForm as SymbolicForm
    from dh2sim.symbolic.request import symbolic_form as symbolic_form
    from dh2sim.trajectory.files import SampledTrajectory as SampledTrajectory
    from dh2sim.trajectory.files import read_trajectory as read_trajectory
    from dh2sim.trajectory.mechanism import plan_mechanism_trajectory as plan_mechanism_trajectory
    from dh2sim.trajectory.plan import plan_trajectory as plan_trajectory
    from dh2sim.trajectory.trajectory import Trajectory as Trajectory
    from dh2sim.validate.run import validate_robot as validate_robot
    from dh2sim.workspace.workspace import Workspace as Workspace
    from dh2sim.workspace.workspace import compute_workspace as compute_workspace

    __version__: str
else:

    def __getattr__(name: str) -> object:
        """Import a public name from its module."""
        from importlib import import_module, metadata

        if name == "__version__":
            return metadata.version("dh2sim")
        if name not in _HOMES:
            raise AttributeError(f"module 'dh2sim' has no attribute '{name}'")
        return getattr(import_module(f"dh2sim.{_HOMES[name]}"), name)

    def __dir__() -> list[str]:
        """List the public names."""
        return [*_HOMES]
