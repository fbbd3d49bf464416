"""Drawings of a robot as files and texts: SVG and TikZ of our own, PNG and PDF through matplotlib."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from dh2sim.arguments import file_path, number, real_array
from dh2sim.draw.diagram.arm import place_arm
from dh2sim.draw.diagram.kinematic import draw_kinematic
from dh2sim.draw.diagram.linkage import place_mechanism
from dh2sim.draw.diagram.sheet import Sheet, Stroke, head_of, shaft_of, subscripted, tex_text, to_svg, to_tikz
from dh2sim.draw.diagram.stick import draw_stick
from dh2sim.draw.plot_style import plot_style, save
from dh2sim.errors import PictureError
from dh2sim.extras import require_extra
from dh2sim.files import atomic_file
from dh2sim.kinematics.chain import build_chain, joint_vector
from dh2sim.messages import member, shown
from dh2sim.robot.spec import SpecLike, spec_of

_DPI = 200


class DrawingFormat(StrEnum):
    """A format of drawings."""

    SVG = "svg"
    TIKZ = "tikz"
    PNG = "png"
    PDF = "pdf"


class DrawingStyle(StrEnum):
    """What a drawing shows."""

    KINEMATIC = "kinematic"
    """Joints as cylinders and boxes, axes, frames and lengths."""
    FRAMES = "frames"
    """The axes of all frames on a line drawing of the arm."""
    STICK = "stick"
    """A stick plot in the box of the workspace, with base line and shadow."""


ENDINGS = {
    ".svg": DrawingFormat.SVG,
    ".tikz": DrawingFormat.TIKZ,
    ".tex": DrawingFormat.TIKZ,
    ".png": DrawingFormat.PNG,
    ".pdf": DrawingFormat.PDF,
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotDrawing:
    """A drawing of a robot, which a notebook shows."""

    sheet: Sheet

    def __repr__(self) -> str:
        return f"<RobotDrawing: {len(self.sheet.strokes)} strokes; .svg, .tikz, .save('arm.pdf')>"

    @property
    def svg(self) -> str:
        """The drawing as SVG."""
        return to_svg(self.sheet)

    @property
    def tikz(self) -> str:
        r"""The drawing as a TikZ picture; the document needs ``\usepackage{tikz}``."""
        return to_tikz(self.sheet)

    def save(self, path: str | Path, format: DrawingFormat | str | None = None) -> None:  # noqa: A002
        """Write the drawing, whole or not at all.

        Args:
            path: The file; it is replaced if it exists.
            format: svg, tikz, png or pdf; by default what the ending of the name says.

        Raises:
            PictureError: The format is unknown, or the ending says none.
            MissingExtraError: png and pdf need matplotlib, of the extra 'plot'.
            OutputError: The file cannot be written.
        """
        file = file_path("path", path)
        kind = format_of(file) if format is None else member(DrawingFormat, format, "format", PictureError)
        if kind in (DrawingFormat.SVG, DrawingFormat.TIKZ):
            text = self.svg if kind is DrawingFormat.SVG else self.tikz
            with atomic_file(file) as draft:
                draft.write_bytes(text.encode())
            return
        require_extra("plot", "matplotlib", what=f"a drawing as {kind.value.upper()}")
        with plot_style():
            save(_figure(self.sheet), file, dpi=_DPI, formulas=True)

    def _repr_svg_(self) -> str:
        return self.svg


def draw_robot(
    robot: SpecLike,
    q: ArrayLike | str | None = None,
    *,
    style: DrawingStyle | str = DrawingStyle.KINEMATIC,
    workspace: Sequence[float] | None = None,
    reach: float | None = None,
) -> RobotDrawing:
    """Draw a robot as textbooks do.

    Args:
        robot: The robot, or a mechanism; that is drawn with the joints that close its loops.
        q: Joint vector, rad and m, or the name of a configuration; by default home, or zero inside the limits. Of a
            mechanism the coordinates of all joints, or of the driven ones.
        style: 'kinematic', 'frames' or 'stick'.
        workspace: Of a stick plot: least and greatest x, y and z, m.
        reach: Of a stick plot: length that joints and axes are measured by, m.

    Returns:
        The drawing: ``svg`` and ``tikz`` are texts, ``save`` writes a file, a notebook shows it.

    Raises:
        PictureError: The style is unknown, or the workspace is not a box.
        ConfigurationError: ``q`` is neither a joint vector nor a configuration of the robot.
        AssemblyError: The loops of a mechanism cannot be closed.
        SingularPositionError: A mechanism cannot be moved to ``q`` from its assembly.
    """
    spec = spec_of(robot)
    kind = member(DrawingStyle, style, "style", PictureError)
    if kind is not DrawingStyle.STICK and (workspace is not None or reach is not None):
        raise PictureError("workspace and reach are of the style 'stick'")
    vector = "home" if q is None else q
    if spec.is_mechanism:
        arm = place_mechanism(spec, vector)
    else:
        named = spec.configuration(vector) if isinstance(vector, str) else vector
        arm = place_arm(spec, joint_vector(build_chain(spec), named))
    if kind is not DrawingStyle.STICK:
        return RobotDrawing(sheet=draw_kinematic(arm, symbols=kind is DrawingStyle.KINEMATIC))
    if reach is not None and not (math.isfinite(number("reach", reach)) and reach > 0.0):
        raise PictureError(f"reach must be a length above 0, got {reach!r}")
    return RobotDrawing(sheet=draw_stick(arm, None if workspace is None else _box(workspace), reach))


def format_of(path: Path) -> DrawingFormat:
    """Return the format that the ending of a file's name stands for.

    Raises:
        PictureError: There is none.
    """
    found = ENDINGS.get(path.suffix.lower())
    if found is None:
        raise PictureError(f"cannot write {shown(path.name)} as a drawing; allowed endings: {', '.join(ENDINGS)}")
    return found


def _box(numbers: Sequence[float]) -> tuple[float, float, float, float, float, float]:
    values = real_array("workspace", numbers).ravel().tolist()
    if len(values) != 6 or not all(map(math.isfinite, values)):
        raise PictureError(f"workspace must be six finite numbers, least and greatest x, y and z, got {values}")
    if not all(values[k] < values[k + 1] for k in (0, 2, 4)):
        raise PictureError(f"workspace must have least values below the greatest, got {values}")
    x0, x1, y0, y1, z0, z1 = values
    return x0, x1, y0, y1, z0, z1


def _figure(sheet: Sheet) -> Any:
    from matplotlib.figure import Figure
    from matplotlib.patches import Polygon

    left, bottom, right, top = sheet.bounds
    figure = Figure(figsize=((right - left) / 72.0, (top - bottom) / 72.0))
    axes: Any = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(left, right), ylim=(bottom, top))
    axes.set_axis_off()

    def line(stroke: Stroke, points: Any, order: int) -> None:
        dash: dict[str, Any] = (
            {"linestyle": (0, [length / stroke.width for length in stroke.dash])} if stroke.dash else {}
        )
        axes.plot(
            *points.T,
            color=stroke.color,
            lw=stroke.width,
            zorder=order,
            solid_capstyle="round",
            solid_joinstyle="round",
            clip_on=False,
            **dash,
        )

    for order, stroke in enumerate(sheet.strokes, start=1):
        if stroke.fill is not None:
            axes.add_patch(
                Polygon(
                    stroke.points,
                    facecolor=stroke.fill,
                    edgecolor=stroke.color or "none",
                    lw=stroke.width if stroke.color else 0.0,
                    joinstyle="round",
                    zorder=order,
                )
            )
        elif stroke.color is not None:
            line(stroke, shaft_of(stroke) if stroke.arrow else stroke.points, order)
        if stroke.arrow:
            axes.add_patch(Polygon(head_of(stroke), facecolor=stroke.color, lw=0.0, zorder=order))
    for text in sheet.texts:
        axes.text(
            *text.centre,
            tex_text(text.text) if subscripted(text.text)[1] else text.text,
            size=text.size,
            color=text.color,
            ha="center",
            va="center",
            zorder=len(sheet.strokes) + 1,
            math_fontfamily="cm",
        )
    return figure
