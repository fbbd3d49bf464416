"""An arm or a leg in a third-party file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from dh2sim.importing.sources import ImportOptions
from dh2sim.robot.row import Convention
from scripts.real_arms.packages import Package

TOLERANCE = ImportOptions().tolerance


@dataclass(frozen=True, slots=True, kw_only=True)
class Arm:
    """An arm or a leg in a file, and the options of its import."""

    robot: str
    """Name and, where a file has more than one, which arm or leg."""
    package: Package
    file: str
    """Below the package's folder of robots."""
    base: str
    """Where it begins: given, or found by the import."""
    tip: str
    ask_base: bool = False
    ask_tip: bool = False
    convention: Convention = Convention.STANDARD
    tolerance: float = TOLERANCE
    hayati: tuple[str, ...] = ()
    """Joints whose rows are Hayati's."""
    remark: str = ""

    @property
    def key(self) -> str:
        """Short and different for every arm."""
        tolerance = "" if self.tolerance == TOLERANCE else f"-{self.tolerance:.0e}"
        modified = "-modified" if self.convention is Convention.MODIFIED else ""
        return f"{self.package.name}/{self.robot.replace(' ', '_')}{modified}{tolerance}"

    @property
    def options(self) -> ImportOptions:
        """Options of the import."""
        return ImportOptions(
            base=self.base if self.ask_base else None,
            tip=self.tip if self.ask_tip else None,
            convention=self.convention,
            tolerance=self.tolerance,
        )

    def path(self, root: Path) -> Path:
        """The file, where ``root`` is the package's folder of robots."""
        return root / self.file
