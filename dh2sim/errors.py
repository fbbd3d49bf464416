"""Every exception that dh2sim raises on purpose; this module imports nothing of the package."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self


class Dh2simError(Exception):
    """Base of all of them; its text is fit to be shown to a user as it is."""


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class Problem:
    """One thing that is wrong in a robot, and where."""

    file: str = ""
    """Name of the file as the user gave it; empty for a robot made in code."""
    line: int = 0
    """Line in the file, counted from 1."""
    column: int = 0
    """Column in the file, counted from 1."""
    path: str
    """Path of the key, such as ``joints[2].limits.position``; empty for the whole robot."""
    message: str
    """What was found and what is allowed."""

    def __str__(self) -> str:
        """Return ``file:line:column: path: message``, as far as there is such a place."""
        place = f"{self.file}:{self.line}:{self.column}: " if self.file else ""
        return f"{place}{self.path}: {self.message}" if self.path else f"{place}{self.message}"


class RobotError(Dh2simError, ValueError):
    """A robot is wrong; ``problems`` holds everything that is."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        """Keep the problems; the text has a line for each."""
        self.problems = tuple(problems)
        super().__init__("\n".join(str(problem) for problem in self.problems))

    def __reduce__(self) -> tuple[type[Self], tuple[object, ...]]:
        """Return how it is made again in another process."""
        return type(self), (self.problems,)


class RobotFileError(RobotError):
    """A robot file is wrong; ``problems`` are in the order of the file."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        """Keep the problems sorted by place."""
        super().__init__(sorted(problems))


class ImportedFileError(RobotFileError):
    """A file that a robot is to be made from is wrong: a URDF, an MJCF, a table, axes."""


class DesignFileError(RobotFileError):
    """A file of designs is wrong, or a robot that it describes."""


class ArgumentError(Dh2simError, TypeError):
    """An argument is of a kind that the function does not take."""


class UnknownRobotError(Dh2simError):
    """Neither a file nor a robot that comes with dh2sim has this name."""


class UnknownFrameError(Dh2simError):
    """The robot has no frame of this name."""


class ConfigurationError(Dh2simError, ValueError):
    """A joint vector has the wrong shape or holds something that is not a finite number."""


class NotFiniteError(Dh2simError, ValueError):
    """A number to be written is NaN or infinite: a defect of dh2sim, which nothing that it accepts should reach."""

    def __init__(self, where: str, value: str) -> None:
        """Name the place of the number in what is written."""
        self.where, self.value = where, value
        super().__init__(
            f"{where}: {value} is not a finite number, and is not written. This is a defect of dh2sim: please report "
            "it with the robot file"
        )

    def __reduce__(self) -> tuple[type[Self], tuple[object, ...]]:
        """Return how it is made again in another process."""
        return type(self), (self.where, self.value)

    def inside(self, part: str) -> Self:
        """Return the same error with a place that begins with the part that it is in."""
        return type(self)(f"{part}.{self.where}" if self.where else part, self.value)


class AssemblyError(Dh2simError, ValueError):
    """The loops of a mechanism cannot be closed."""


class SingularPositionError(Dh2simError, ValueError):
    """A mechanism cannot be moved to where its driven joints are wanted."""


class MeshError(Dh2simError):
    """A mesh cannot be used."""


class ModelError(Dh2simError):
    """The robot is well described, but a format or an engine cannot hold it."""


class EngineError(Dh2simError):
    """An engine refused a model file."""


class EngineCapacityError(Dh2simError):
    """An engine cannot hold a robot of this size; that says nothing about the file."""


class OutputError(Dh2simError):
    """Files could not be written; what was there is unchanged."""


class MismatchError(Dh2simError):
    """A written model does not match its table; nothing was put in place."""


class PictureError(Dh2simError):
    """A picture cannot be made: nothing can draw here, or what it should show is not there."""


class MissingExtraError(Dh2simError, ImportError):
    """A library is not installed that comes with an extra of the package."""


class RunError(Dh2simError):
    """A folder is not a run of dh2sim, or a run cannot be read."""


class RunExistsError(RunError):
    """A run would be written where there is something already."""


class RunDiffersError(RunError):
    """A run cannot be resumed, because it was made with other settings."""


class RunDamagedError(RunError):
    """Files of a run are missing or are not what was written."""


class RunUnreachableError(RunError):
    """The server with a run does not answer."""


class RunBusyError(RunError):
    """Another process is writing to the run."""


class RunOutputError(OutputError):
    """A run could not be written; blocks that were committed before are safe."""


class ExecutorError(Dh2simError):
    """An executor, or workers of it, failed; blocks that were committed before are safe."""


class ControllerError(Dh2simError):
    """A controller is not known, its options or files are wrong, or its code failed."""


class MeasureError(Dh2simError):
    """A measure of designs is not known, or its code failed."""


class TrajectoryError(Dh2simError, ValueError):
    """A trajectory cannot be: a path leaves limits, jumps or cannot be followed; or a file of one is wrong."""


class CalibrationError(Dh2simError, ValueError):
    """Measurements do not fit together, or cannot tell what is asked of them."""


class MeasurementFileError(RobotFileError):
    """A file of measurements is wrong."""


class SettingsError(Dh2simError, ValueError):
    """Options of a run are wrong; ``problems`` has the name of each argument with what is wrong with it.

    The name is empty where a problem is about no single argument.
    """

    def __init__(self, problems: Iterable[tuple[str, str]]) -> None:
        """Keep the problems; the text has a line for each."""
        self.problems = tuple(problems)
        super().__init__("\n".join(f"{name} {message}" if name else message for name, message in self.problems))

    def __reduce__(self) -> tuple[type[Self], tuple[object, ...]]:
        """Return how it is made again in another process."""
        return type(self), (self.problems,)
