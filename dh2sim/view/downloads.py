"""Files that a page hands out; models are compared with the table first, as in any export."""

from __future__ import annotations

import io
import tempfile
import zipfile
from dataclasses import dataclass, field
from pathlib import Path

from dh2sim.export.render import Format, render
from dh2sim.export.verify import verify
from dh2sim.model.robot_model import RobotModel

_ENDINGS = {Format.URDF: "urdf", Format.MJCF: "xml"}
_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The least time that a ZIP archive can hold: the same robot gives the same bytes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Download:
    """A file for the user to keep."""

    name: str
    data: bytes = field(repr=False)
    summary: str
    """What was found when it was compared with the table."""


def model_file(model: RobotModel, wanted: Format) -> Download:
    """Return a robot's URDF or MJCF, compared with its table; in an archive where there are meshes with it.

    Args:
        model: The robot.
        wanted: Which.

    Raises:
        ModelError: The format cannot hold the robot.
        EngineError: MuJoCo refuses the file.
        MismatchError: The file's poses differ from the table's.
    """
    files = render(model, [wanted])
    with tempfile.TemporaryDirectory() as folder:
        write_files(files, Path(folder))
        (result,) = verify(model, Path(folder), [wanted])
    summary = f"off the table by at most {result.position_error:.1e} m and {result.rotation_error:.1e} rad"
    name = f"{model.name}.{_ENDINGS[wanted]}"
    if any(link.mesh is not None for link in model.all_links):
        return Download(name=f"{model.name}-{wanted.value}.zip", data=_archive(files), summary=summary)
    return Download(name=name, data=files[name], summary=summary)


def write_files(files: dict[str, bytes], folder: Path) -> None:
    """Write the files of an export into a folder."""
    for relative, data in files.items():
        path = folder / relative
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def _archive(files: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for relative, data in files.items():
            archive.writestr(zipfile.ZipInfo(relative, _EPOCH), data, zipfile.ZIP_DEFLATED)
    return stream.getvalue()
