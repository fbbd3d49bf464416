"""``Robot``: a robot with its verbs.

Every method calls a function that is public itself, and imports it when it is called. What a method says of its
arguments is what ``help`` shows; which values are allowed is checked by the function.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Self, TypeAlias, Unpack

import numpy as np
from numpy.typing import ArrayLike

from dh2sim.arguments import file_path
from dh2sim.errors import Dh2simError
from dh2sim.kinematics.transforms import PoseLike, pose_of
from dh2sim.robot.links import BaseSpec, PayloadSpec, ToolSpec
from dh2sim.robot.row import Convention, Row
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.table_rows import TableRow, spec_rows
from dh2sim.robot.textbook_table import table_html, table_latex, table_text
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.typing import Array, read_only

if TYPE_CHECKING:
    from concurrent.futures import Executor

    import mujoco
    import xarray as xr
    from distributed import Client

    from dh2sim.calibrate.calibration import CalibrationKeywords
    from dh2sim.calibrate.measurements import Measurements
    from dh2sim.calibrate.plan import Plan
    from dh2sim.calibrate.result import Calibration
    from dh2sim.codegen.languages import Language
    from dh2sim.compare.comparison import Comparison
    from dh2sim.draw.diagram.drawing import DrawingStyle, RobotDrawing
    from dh2sim.export import ExportReport, Format
    from dh2sim.importing.convert import TableFormLike
    from dh2sim.inverse.goals import Free
    from dh2sim.inverse.textbook import Explanation
    from dh2sim.kinematics.batches import BatchOptions, JacobianOptions
    from dh2sim.kinematics.chain import KinematicChain
    from dh2sim.mobility.result import Mobility
    from dh2sim.model.mechanism import MechanismModel
    from dh2sim.model.robot_model import RobotModel
    from dh2sim.model.slips import Slip
    from dh2sim.robot.spec import SpecLike
    from dh2sim.simulate.options import RolloutKeywords
    from dh2sim.sweep.sweep import Sweep, SweepKeywords
    from dh2sim.symbolic.request import SymbolicForm, SymbolicKeywords, What
    from dh2sim.trajectory.options import TrajectoryKeywords
    from dh2sim.trajectory.trajectory import Trajectory
    from dh2sim.validate.report import RobotReport
    from dh2sim.view.server import PageServer
    from dh2sim.workspace.workspace import Workspace, WorkspaceKeywords

FilePath: TypeAlias = str | os.PathLike[str]
_READERS: Final = {
    ".urdf": "from_urdf",
    ".xacro": "from_urdf",
    ".xml": "from_mjcf",
    **dict.fromkeys((".md", ".csv", ".tsv", ".tex", ".html", ".rst", ".m", ".py", ".json"), "from_table"),
}
"""The methods that read files of other formats, by their suffix."""


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Robot:
    """A robot, given by its Denavit-Hartenberg table; nothing about it can be changed."""

    spec: RobotSpec
    """The table, and everything else that a robot file holds, in SI units."""
    notes: tuple[str, ...]
    """What an import or a conversion chose, changed or left out, one sentence each."""

    def __init__(
        self,
        rows: Iterable[TableRow | Row],
        *,
        name: str = "robot",
        convention: Convention | str = Convention.STANDARD,
        base: PoseLike = (0.0, 0.0, 0.0),
        tool: ToolSpec | PoseLike = (0.0, 0.0, 0.0),
        payload: PayloadSpec | float | None = None,
        gravity: ArrayLike = (0.0, 0.0, -9.81),
        configurations: Mapping[str, ArrayLike] = MappingProxyType({}),
        description: str = "",
        source: str = "",
    ) -> None:
        """Make a robot of the rows of its table.

        Args:
            rows: The DH table, base first.
            name: Letters, digits, '_' and '-', starting with a letter; names the exported files.
            convention: 'standard', 'modified' or 'hayati', of rows that give none.
            base: Pose of DH frame 0 in base_link.
            tool: Pose of tool0 in DH frame n; a :class:`ToolSpec` has mass, inertia and looks too.
            payload: What the arm is to carry besides, for the limits and gains that are left open; a number is its
                mass, kg. By default a share of the arm's own mass.
            gravity: m/s² in base_link, shape (3,).
            configurations: Named joint vectors, rad and m, each of shape (n,).
            description: What the robot is.
            source: Where the numbers come from.

        Raises:
            RobotError: Something is wrong; the text says what and where, a line for each problem.
        """
        given: dict[str, Any] = {
            "name": name,
            "rows": spec_rows(rows),
            "description": description,
            "source": source,
            "convention": convention,
            "base": BaseSpec(pose=pose_of(base, "base")),
            "tool": pose_of(tool, "tool"),
            "payload": PayloadSpec() if payload is None else payload,
            "gravity": gravity,
            "configurations": configurations,
        }
        spec = RobotSpec(**given)
        self._set(spec)

    def _set(self, spec: RobotSpec, notes: Iterable[str] = ()) -> None:
        object.__setattr__(self, "spec", spec)
        object.__setattr__(self, "notes", tuple(notes))

    @classmethod
    def from_spec(cls, spec: RobotSpec, *, notes: Iterable[str] = ()) -> Self:
        """Return the robot that a :class:`RobotSpec` describes.

        Raises:
            AssemblyError: It has loops that cannot be closed.
        """
        from dh2sim.robot.spec import spec_of

        robot = cls.__new__(cls)
        robot._set(spec_of(spec), notes)
        if robot.spec.closures:
            from dh2sim.kinematics.loop_closure import assembly

            assembly(robot.spec)
        return robot

    @classmethod
    def of_model(cls, model: RobotModel) -> Self:
        """Return the robot of a model."""
        from dh2sim.robot.spec import spec_of

        return cls.from_spec(spec_of(model))

    @classmethod
    def load(cls, path_or_name: FilePath) -> Self:
        """Read a robot file, or a robot that comes with dh2sim; a path that exists wins.

        Raises:
            Dh2simError: There is no such robot, or its file is wrong; the text says where.
        """
        from dh2sim.robot.read import load_robot

        reader = _READERS.get(file_path("path_or_name", path_or_name).suffix.lower())
        if reader is not None:
            raise Dh2simError(f"{os.fspath(path_or_name)}: not a robot file; read it with Robot.{reader}")
        return cls.from_spec(load_robot(path_or_name))

    @classmethod
    def from_urdf(
        cls,
        path: FilePath,
        *,
        base: str | None = None,
        tip: str | None = None,
        convention: Convention | str = Convention.STANDARD,
        tolerance: float = 1e-9,
        package_paths: Iterable[FilePath] | FilePath = (),
        root: FilePath | None = None,
        arguments: Mapping[str, object] | None = None,
        name: str | None = None,
    ) -> Self:
        """Make the DH table of a URDF, whatever way its axes lie, and compare it with the file's own kinematics.

        Args:
            path: The file.
            base: Link that becomes base_link; by default the root.
            tip: Link that becomes tool0; by default where the arm ends.
            convention: Convention of the table: 'standard' or 'modified'.
            tolerance: Greatest residual, rad, and m for a reach of up to 1 m, then of the reach; numbers within it of
                a simple one are made simple.
            package_paths: Folders, or a folder, in which ``package://`` is looked for first.
            root: Folder outside of which a xacro file includes no file; by default the file's own.
            arguments: Values of a xacro file's arguments, by name.
            name: Name of the robot, instead of the file's.

        Raises:
            Dh2simError: The file is wrong or holds no serial arm; the text says what and where.
        """
        where = {"package_paths": package_paths, "root": root, "arguments": {} if arguments is None else arguments}
        return cls._imported(path, base=base, tip=tip, convention=convention, tolerance=tolerance, name=name, **where)

    @classmethod
    def from_mjcf(
        cls,
        path: FilePath,
        *,
        base: str | None = None,
        tip: str | None = None,
        convention: Convention | str = Convention.STANDARD,
        tolerance: float = 1e-9,
        root: FilePath | None = None,
        name: str | None = None,
    ) -> Self:
        """Make the DH table of an MJCF, as :meth:`from_urdf` does; ``tip`` may be a body or a site."""
        return cls.from_urdf(
            path, base=base, tip=tip, convention=convention, tolerance=tolerance, root=root, name=name
        )

    @classmethod
    def from_table(
        cls,
        path: FilePath,
        *,
        convention: Convention | str | None = None,
        angle: AngleUnit | str | None = None,
        length: LengthUnit | str | None = None,
        table: int | None = None,
        tolerance: float = 1e-9,
        name: str | None = None,
    ) -> Self:
        """Read a DH table in Markdown, LaTeX, HTML, CSV or JSON, or a printout or a script of a robotics toolbox.

        Args:
            path: The file.
            convention: 'standard' or 'modified', for a table that does not say.
            angle: Unit of angles, 'deg' or 'rad', for a table that does not say.
            length: Unit of lengths, 'm', 'mm', 'cm' or 'in', for a table that does not say.
            table: Number of the table, from 1, where the file has several; by default the first.
            tolerance: Numbers within it of a simple one are made simple, rad and m, if it is above the default.
            name: Name of the robot, instead of the file's.

        Raises:
            Dh2simError: The table is wrong or says too little; the text says what and where.
        """
        return cls._imported(
            path, convention=convention, angle=angle, length=length, table=table, tolerance=tolerance, name=name
        )

    @classmethod
    def from_calibration(
        cls,
        path: FilePath,
        *,
        nominal: SpecLike | FilePath | None = None,
        convention: Convention | str | None = None,
        tolerance: float = 1e-9,
        name: str | None = None,
    ) -> Self:
        """Read a maker's calibration file: a UR's calibration.yaml or calibration.conf, a Franka's kinematics.yaml.

        Args:
            path: The file.
            nominal: The robot that it is of, a robot file, or the name of one that comes with dh2sim: gives limits,
                masses, names; a calibration.conf holds only what is to be added to its table.
            convention: Convention of the table, 'standard' or 'modified'; by default the nominal robot's.
            tolerance: Greatest residual, rad, and m for a reach of up to 1 m, then of the reach.
            name: Name of the robot.

        Raises:
            Dh2simError: The file is wrong, or is another robot's; the text says what and where.
        """
        return cls._imported(path, nominal=nominal, convention=convention, tolerance=tolerance, name=name)

    @classmethod
    def _imported(cls, path: FilePath, **options: Any) -> Self:
        from dh2sim.importing.sources import ImportOptions, import_robot

        imported = import_robot(path, ImportOptions(**options))
        return cls.from_spec(imported.spec, notes=imported.notes)

    @property
    def name(self) -> str:
        """The robot's name."""
        return self.spec.name

    @property
    def n(self) -> int:
        """Number of joints that move: the length of a joint vector."""
        return len(self.spec.moving_rows)

    @cached_property
    def chain(self) -> KinematicChain:
        """The table as joint-placed bodies, which the kinematics are computed from."""
        from dh2sim.kinematics.chain import build_chain

        return build_chain(self.spec)

    @cached_property
    def model(self) -> RobotModel:
        """The robot with shapes, masses, limits and actuators; what was estimated or assumed is marked."""
        from dh2sim.model.build import build_model

        return build_model(self.spec)

    @cached_property
    def mechanism(self) -> MechanismModel:
        """A mechanism with shapes, masses, limits and actuators, its loops closed."""
        from dh2sim.model.mechanism import build_mechanism

        return build_mechanism(self.spec)

    @cached_property
    def configurations(self) -> Mapping[str, Array]:
        """Named joint vectors, rad and m, each of shape (n,): ``zero``, ``home`` and those of the robot file."""
        return self.spec.named_configurations

    @cached_property
    def limits(self) -> tuple[Array, Array]:
        """Lower and upper joint coordinates, rad and m, each of shape (n,); infinite for continuous joints."""
        ranges = [joint.position_range or (-np.inf, np.inf) for joint in self.model.moving_joints]
        return read_only([lower for lower, _ in ranges]), read_only([upper for _, upper in ranges])

    def fk(self, q: ArrayLike, frame: str = "tool0", **options: Unpack[BatchOptions]) -> Array:
        """Return the pose of a frame in base_link.

        Args:
            q: Joint vectors, rad and m, shape (..., n); or the name of a configuration. Of a mechanism one vector,
                of all joints or of the driven ones, which move the others from the assembly.
            frame: tool0, base_link, dh_0 … dh_n or link_1 … link_n; rocker/dh_1 … of a branch.
            **options: ``out`` takes the result; ``rows=3`` leaves out 0 0 0 1; ``threads`` for large batches, 0 for
                all processors; ``backend="numba"`` for compiled code.

        Returns:
            Shape (..., 4, 4).

        Raises:
            ConfigurationError: ``q`` has the wrong shape, or something in it is not finite; or an option is wrong.
            SingularPositionError: A dead or singular position of a mechanism is on the way.
            UnknownFrameError: The frame is unknown.
        """
        from dh2sim.kinematics.forward import frame_pose

        return frame_pose(self, frame, q, **options)

    def jacobian(self, q: ArrayLike, frame: str = "tool0", **options: Unpack[JacobianOptions]) -> Array:
        """Return the geometric Jacobian of a frame in base_link.

        Args:
            q: Joint vectors, rad and m, shape (..., n); or the name of a configuration.
            frame: tool0, base_link, dh_0 … dh_n or link_1 … link_n.
            **options: ``out``, ``threads`` and ``backend``, as for :meth:`fk`.

        Returns:
            Shape (..., 6, n): rows 0-2 linear, rows 3-5 angular. Of a mechanism (6, k), for its k driven joints.

        Raises:
            ConfigurationError: ``q`` has the wrong shape, or something in it is not finite; or an option is wrong.
            UnknownFrameError: The frame is unknown.
            SingularPositionError: The driven joints of a mechanism do not determine the passive ones there.
        """
        from dh2sim.kinematics.forward import geometric_jacobian

        return geometric_jacobian(self, q, frame=frame, **options)

    def singular_values(self, q: ArrayLike, frame: str = "tool0") -> Array:
        """Return the singular values of :meth:`jacobian`, largest first, shape (..., min(6, n))."""
        from dh2sim.kinematics.singularity import singular_values

        return singular_values(self.jacobian(q, frame))

    def manipulability(self, q: ArrayLike, frame: str = "tool0") -> Array:
        """Return Yoshikawa's measure, the product of :meth:`singular_values`, shape (...); zero in a singularity."""
        from dh2sim.kinematics.singularity import manipulability

        return manipulability(self.jacobian(q, frame))

    def random_configurations(self, count: int, *, seed: int = 0) -> Array:
        """Draw joint vectors between the limits, ±π for continuous joints; rad and m, shape (count, n)."""
        from dh2sim.kinematics.sampling import random_configurations

        return random_configurations(*self.model.travel, count, seed)

    def ik(
        self,
        T: ArrayLike,
        q0: ArrayLike | None = None,
        limits: bool = True,
        lock: Mapping[str, ArrayLike] | None = None,
        free: Free | None = None,
        *,
        numeric: bool = False,
    ) -> Any:
        """Return all configurations that reach a pose, each verified against the table.

        Args:
            T: Poses of tool0 in base_link, shape (4, 4) or (N, 4, 4).
            q0: The solutions nearest to this joint vector, rad and m, shape (n,), or to the configuration of this
                name, come first; by default ``home``.
            limits: Whether to keep position limits; then every whole turn that fits is a solution of its own.
            lock: Values of joints that are not to move, by name, rad or m; of shape (N,) to lock each pose's own.
            free: 'rotation' for goals that are positions, 'roll' for those that may turn about z of tool0.
            numeric: Whether to search one solution alone, from ``q0``: to track a moving pose, or for one out of
                reach, whose ``nearest`` configuration is returned.

        Returns:
            The :class:`Solutions` of one pose, or a list of those of N poses: ``q`` (k, n), ``residual``,
            ``sigma_min``, ``within_limits``, ``branch``; ``curves`` where solutions are not isolated; ``reason`` and
            ``nearest`` where there are none.

        Raises:
            ConfigurationError: A pose is not a rigid transform, ``q0`` has the wrong shape, or a joint is unknown.
        """
        from dh2sim.inverse.solver import inverse_kinematics

        return inverse_kinematics(self, T, q0, limits, lock, free, numeric)

    def explain_ik(self, T: ArrayLike) -> Explanation:
        """Derive the configurations that reach a pose as a textbook does, in steps with the numbers.

        Args:
            T: Pose of tool0 in base_link, shape (4, 4).

        Returns:
            The :class:`Explanation`: it prints as text, and is false where textbooks have no closed form for the arm.

        Raises:
            ConfigurationError: ``T`` is not a pose.
        """
        from dh2sim.inverse.textbook import explain_inverse_kinematics

        return explain_inverse_kinematics(self, T)

    def workspace(self, **options: Unpack[WorkspaceKeywords]) -> Workspace:
        """Find what a frame's origin reaches inside the limits.

        Args:
            **options: As for :func:`dh2sim.compute_workspace`: ``frame``, ``size`` of the voxels, ``samples``,
                ``seed``, ``threads``, ``section`` for the section with its exact boundary, ``dexterity`` for the
                shares of orientations that are reached, ``orientations``.

        Returns:
            The :class:`Workspace`: ``centers``, ``count``, ``manipulability`` and ``q`` of its voxels, ``extremes``,
            ``section``, ``dexterity``, ``area`` or ``volume``.

        Raises:
            SettingsError: An option is wrong, or asks for too much.
            ConfigurationError: The arm has no section, or no choice of orientations.
        """
        from dh2sim.workspace.workspace import compute_workspace

        return compute_workspace(self, **options)

    def mobility(self) -> Mobility:
        """Count the degrees of freedom, and find out by rank and by walking along the loops what they are.

        Raises:
            AssemblyError: Loops cannot be closed.
        """
        from dh2sim.mobility.robot_mechanism import find_mobility

        return find_mobility(self)

    def convert(self, to: TableFormLike) -> Self:
        """Return the same arm with its table in another convention, 'standard' or 'modified', or 'compact'.

        A compact table has every frame within reach of the arm; ``notes`` says which rows changed, and why.

        Raises:
            Dh2simError: The poses of tool0 would differ by more than rounding.
        """
        from dh2sim.importing.convert import convert_robot

        converted = convert_robot(self, to)
        return self.from_spec(converted.spec, notes=converted.notes)

    def save(self, path: FilePath, *, overwrite: bool = False) -> None:
        """Write a robot file that ``load`` reads as the same robot; parameters become the numbers that they gave.

        It is in the units of the file that the robot was read from, or else in deg and m.

        Raises:
            OutputError: There is a file already, or it cannot be written.
        """
        from dh2sim.robot.write import save_robot

        save_robot(self, path, notes=self.notes, overwrite=overwrite)

    def symbolic(self, what: What | str = "pose", **options: Unpack[SymbolicKeywords]) -> SymbolicForm:
        """Return the robot's kinematics or dynamics in symbols, compared with numbers; ``print`` shows it.

        Args:
            what: 'pose', 'matrices', 'jacobian' or 'dynamics'.
            **options: As for :func:`dh2sim.symbolic_form`: ``source``, ``target``, ``style``, ``lengths``, ``names``,
                ``numbers``, ``letters``, ``fold``, ``joint_names``.

        Raises:
            Dh2simError: An argument has a value that is not allowed, or the robot is too large for what is asked.
        """
        from dh2sim.symbolic.request import symbolic_form

        return symbolic_form(self, what, **options)

    def code(
        self, language: Language | str = "python", what: str | Iterable[str] = "pose", *, name: str | None = None
    ) -> str:
        """Return code for the robot's kinematics and dynamics, in one file that needs no other; rad and m.

        Args:
            language: 'python', 'numpy', 'c', 'cpp', 'matlab' or 'javascript'.
            what: 'pose' of tool0 in base_link, its 'jacobian', 'inverse-dynamics', or several of them.
            name: Begins the names of functions in C, is the namespace in C++ and the function's name in MATLAB; by
                default the robot's name.

        Raises:
            Dh2simError: There is no such language or code; or the code differs from the table.
        """
        from dh2sim.codegen.generate import generate_code

        return generate_code(self, language, what, name=name)

    def urdf(self, *, dh_frames: bool = True) -> str:
        """Return the URDF; with ``dh_frames`` it has a link for every DH frame. Meshes are written by ``export``."""
        from dh2sim.formats.urdf.write import to_urdf

        return to_urdf(self, dh_frames=dh_frames)

    def mjcf(self) -> str:
        """Return the MJCF. Meshes are written by ``export``."""
        from dh2sim.formats.mjcf.write import to_mjcf

        return to_mjcf(self)

    def mjmodel(self) -> mujoco.MjModel:
        """Return the robot compiled by MuJoCo, without floor or light.

        Raises:
            Dh2simError: MuJoCo cannot hold the robot.

        Warns:
            RuntimeWarning: MuJoCo finds something questionable in it.
        """
        from dh2sim.engines.mujoco_model import compile_robot

        compiled, sentences = compile_robot(self)
        for sentence in sentences:
            warnings.warn(f"{self.name}: {sentence}", RuntimeWarning, stacklevel=2)
        return compiled

    def export(
        self,
        out: FilePath = "generated",
        *,
        formats: Iterable[Format | str] | Format | str = ("urdf", "mjcf"),
        dh_frames: bool = True,
        verify: bool = True,
    ) -> ExportReport:
        """Write URDF, MJCF and meshes to ``out``/<name>/, all of them or none, verified against the table.

        Args:
            out: The folder that holds a folder for each robot.
            formats: 'urdf', 'mjcf' or both.
            dh_frames: Whether the URDF has a link for every DH frame.
            verify: Whether to compare the written files with the table before they are put in place.

        Returns:
            What was written and how well it matches, what the formats cannot hold, and what was estimated or
            assumed.

        Raises:
            Dh2simError: The robot cannot be exported; what was there before is untouched.
        """
        from dh2sim.export import export_robot

        return export_robot(self, out, formats=formats, dh_frames=dh_frames, verify=verify)

    def slips(self) -> tuple[Slip, ...]:
        """Return numbers that are allowed but rarely meant, such as degrees in a file of radians."""
        from dh2sim.model.slips import find_slips

        return find_slips(self)

    def validate(
        self,
        *,
        samples: int = 1000,
        seed: int = 0,
        tolerance: float = 1e-12,
        folder: FilePath | None = None,
        source: FilePath | None = None,
        base: str | None = None,
        tip: str | None = None,
    ) -> RobotReport:
        """Compare every engine that is installed with the table: poses, Jacobians and dynamics.

        Args:
            samples: Number of random configurations inside the limits.
            seed: Seed of the random number generator.
            tolerance: Allowed angle, rad, and distance as a share of max(1 m, reach).
            folder: Folder with the exported files; by default they are exported afresh.
            source: URDF or MJCF that the robot was imported from, to compare its masses with.
            base: Link of the source that became base_link; by default the root.
            tip: Link or site of the source that became tool0; by default where the arm ends.

        Returns:
            The report; ``ok`` says whether everything matches.
        """
        from dh2sim.validate.run import validate_robot

        return validate_robot(
            self, samples=samples, seed=seed, tolerance=tolerance, folder=folder, source=source, base=base, tip=tip
        )

    def diff(self, other: SpecLike | FilePath, *, tolerance: float = 1e-6) -> Comparison:
        """Compare the robot with another: the same mechanism, or which misreading of the table explains it.

        Args:
            other: A robot, a file of any kind that dh2sim reads, or the name of a robot that comes with dh2sim.
            tolerance: Greatest difference of tool0, rad, and m for a reach of up to 1 m, then of the reach.

        Raises:
            Dh2simError: The file is wrong, or one of the robots has closed loops or branches.
        """
        from dh2sim.compare.comparison import diff

        return diff(self, other, tolerance=tolerance)

    def trajectory(self, waypoints: Iterable[Any], **options: Unpack[TrajectoryKeywords]) -> Trajectory:
        """Plan a motion through waypoints, from rest to rest, that keeps all limits.

        Args:
            waypoints: At least two: names of configurations, joint vectors (n,), poses of tool0 in base_link (4, 4),
                or mappings with the keys of a waypoint file, in rad and m. Of a mechanism, coordinates of the driven
                joints.
            **options: As for :func:`dh2sim.plan_trajectory`: ``kind`` ('joint', 'line' or 'arc'), ``profile``
                ('quintic', 'trapezoid', 'jerk' or 'optimal'), ``duration``, ``limits``, ``through``, ``free``.

        Returns:
            The :class:`Trajectory`: ``at(t)`` gives positions, velocities, accelerations and jerks, ``save`` writes
            samples.

        Raises:
            SettingsError: Waypoints or options are wrong.
            TrajectoryError: There is no such trajectory; the text says where and why.
        """
        from dh2sim.trajectory.plan import plan_trajectory

        return plan_trajectory(self, waypoints, **options)

    def rollout(
        self,
        rollouts: int | None = None,
        /,
        *,
        out: FilePath | None = None,
        threads: int = 0,
        resume: bool = False,
        overwrite: bool = False,
        share: tuple[int, int] | None = None,
        blocks: Sequence[int] | None = None,
        block_size: int | None = None,
        executor: Executor | Client | str | None = None,
        **options: Unpack[RolloutKeywords],
    ) -> xr.Dataset:
        """Simulate many rollouts with MuJoCo.

        Args:
            rollouts: Number of rollouts, 256 by default.
            out: Folder to write the run to, by convention named ``….zarr``, or ``s3://BUCKET/NAME``; None to keep it
                in memory.
            threads: Number of threads; 0: one for each processor. The result does not depend on it.
            resume: Whether to continue the run at ``out``, if there is one.
            overwrite: Whether to replace the run at ``out``.
            share: ``(i, n)``: simulate the i-th of n shares of the run's blocks, beside other processes.
            blocks: Simulate these blocks, from 0.
            block_size: Rollouts in a block; by default some seconds' work.
            executor: Simulates the blocks in place of this process: one of ``concurrent.futures``, a client of Dask,
                'local' or 'dask://HOST:PORT'.
            **options: What is simulated and recorded, as for :func:`dh2sim.rollout`: ``controller`` (its
                name, or a class of your own), ``seed``, ``duration`` or ``steps``, ``timestep``, ``integrator``,
                ``start``, ``record``, ``every``, ``randomize``, ``floating_base``; ``vary``, ``designs`` and
                ``per_design`` for robots that differ.

        Returns:
            The dataset, as ``docs/dataset.md`` describes it; read lazily from ``out`` if that is given.

        Raises:
            Dh2simError: The options are wrong, or the run cannot be written.
        """
        from dh2sim.simulate.run import rollout

        if rollouts is not None:
            options["rollouts"] = rollouts
        return rollout(
            self,
            out=out,
            threads=threads,
            resume=resume,
            overwrite=overwrite,
            share=share,
            blocks=blocks,
            block_size=block_size,
            executor=executor,
            **options,
        )

    def sweep(self, *, out: FilePath | None = None, **options: Unpack[SweepKeywords]) -> Sweep:
        """Measure what each of many designs can do, without simulation.

        Args:
            out: File to write, .parquet or .csv; the same call continues it. None to keep the table in memory.
            **options: As for :func:`dh2sim.sweep_designs`: ``vary`` or ``designs``, ``count``, ``measure``
                ('workspace', 'manipulability', 'reach', 'payload', or ``module:function``, which is given a
                :class:`Robot`), ``samples``, ``voxel``, ``seed``, ``jobs``, ``overwrite``.

        Returns:
            The :class:`Sweep`: ``measures`` has the spread and the best design of each column, ``columns`` the table.

        Raises:
            Dh2simError: An option or a design is wrong, a measure fails, or the table cannot be written.
        """
        from dh2sim.sweep.sweep import sweep_designs

        return sweep_designs(self, out=out, wrap=Robot.of_model, **options)

    def calibrate(self, data: Measurements | FilePath, **options: Unpack[CalibrationKeywords]) -> Calibration:
        """Fit table, base and tool to measurements of the real robot.

        Args:
            data: A CSV file, as ``docs/calibration.md`` describes it; or what ``measurements`` makes of arrays, or
                ``run_measurements`` of a run.
            **options: As for :func:`dh2sim.calibrate_robot`: ``kind`` and ``groups`` of a file;
                ``unknown``, ``prior``, ``robust``, ``noise``, ``held_out``, ``seed``.

        Returns:
            The calibration: ``robot`` is a specification, from which ``Robot.from_spec`` makes a robot.

        Raises:
            MeasurementFileError: The file is wrong; the text says what and where.
            CalibrationError: The measurements do not determine what is to be fitted.
        """
        from dh2sim.calibrate.calibration import calibrate_robot

        return calibrate_robot(self, data, **options)

    def plan_measurements(
        self, count: int, *, kind: str = "position", noise: float | tuple[float, float] = 1e-4, seed: int = 0
    ) -> Plan:
        """Choose configurations to measure the robot at, inside its limits and without self-contact.

        Args:
            count: Number of configurations.
            kind: What is measured: 'pose', 'position' or 'distance'.
            noise: Standard deviation of a component, m, or m and rad.
            seed: Seed of the random number generator.

        Returns:
            The plan: configurations ``q``, the expected ``error``, and ``random_error``, that of random ones.

        Raises:
            CalibrationError: There are too few to determine the parameters, or the kind cannot be planned.
        """
        from dh2sim.calibrate.plan import plan_measurements

        return plan_measurements(self, count, kind=kind, noise=noise, seed=seed)

    def draw(
        self,
        q: ArrayLike | str | None = None,
        *,
        style: DrawingStyle | str = "kinematic",
        workspace: Sequence[float] | None = None,
        reach: float | None = None,
    ) -> RobotDrawing:
        """Draw the robot as textbooks do; a notebook shows the drawing.

        Args:
            q: Joint vector, rad and m, or the name of a configuration; by default home. Of a mechanism all joints or
                the driven ones, as for :meth:`fk`.
            style: 'kinematic': joints as cylinders and boxes, axes, frames and lengths; 'frames': all axes of the
                frames; 'stick': a stick plot in the box of the workspace, with base line and shadow.
            workspace: Box of a stick plot: least and greatest x, y and z, m; by default a cube around the arm.
            reach: Length that joints and axes of a stick plot are scaled by, m; by default the arm's.

        Returns:
            The drawing: ``svg`` and ``tikz`` are texts, ``save("arm.pdf")`` writes a file.

        Raises:
            PictureError: The style is unknown, or the workspace is not a box.
            ConfigurationError: ``q`` is neither a joint vector nor a configuration of the robot.
        """
        from dh2sim.draw.diagram.drawing import draw_robot

        return draw_robot(self, q, style=style, workspace=workspace, reach=reach)

    def view(
        self, *, host: str = "127.0.0.1", port: int = 8080, browser: bool = True, allow_hosts: Iterable[str] = ()
    ) -> PageServer[Any]:
        """Show the robot in the browser, and return at once.

        Args:
            host: Address to listen at; by default only this machine can reach it.
            port: Port to listen at, or the next that is free.
            browser: Whether to open the page in a browser, if there is a screen.
            allow_hosts: Names of this machine that browsers may use, besides those that it knows of itself.

        Returns:
            The server: its ``url`` is where the page is, ``wait()`` keeps a script alive, ``stop()`` ends it.

        Raises:
            Dh2simError: Nobody can listen at this address.
        """
        from dh2sim.view.start import start_viewer

        return start_viewer(self, host=host, port=port, browser=browser, allow_hosts=allow_hosts)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle, and copy, without what was computed."""
        return _restored, (type(self), self.spec, self.notes)

    def __repr__(self) -> str:
        """Return the name, the joints as letters, and the convention."""
        joints = "".join(row.type.value[0].upper() for row in self.spec.rows)
        conventions = " and ".join(dict.fromkeys(row.convention.value for row in self.spec.rows))
        return f"<Robot '{self.name}': {joints}, {conventions}>"

    def __str__(self) -> str:
        """Return the table as in a textbook: deg and m, the joint variables starred."""
        return table_text(self.spec)

    def _repr_html_(self) -> str:
        return table_html(self.spec)

    def _repr_latex_(self) -> str:
        return table_latex(self.spec)


def _restored(kind: type[Robot], spec: RobotSpec, notes: tuple[str, ...]) -> Robot:
    return kind.from_spec(spec, notes=notes)
