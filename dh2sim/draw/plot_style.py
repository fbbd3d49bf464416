"""How matplotlib draws here, and how figures become files that are the same every time."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dh2sim.errors import OutputError, PictureError
from dh2sim.extras import require_extra
from dh2sim.files import atomic_file
from dh2sim.messages import shown

ENDINGS = (".png", ".svg", ".pdf")
BLUE, TEAL, PURPLE, ORANGE, RED, INK, GREY = (
    "#1f5fa8",
    "#18807c",
    "#7a4fa3",
    "#d9730d",
    "#c0302a",
    "#2b2f36",
    "#8a9099",
)
FORBIDDEN = "#fbe3e1"
"""Background outside the limits."""
SETTINGS: Mapping[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlecolor": INK,
    "axes.labelsize": 8.5,
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.use_mathtext": True,
    "grid.color": "#e4e7eb",
    "grid.linewidth": 0.7,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "agg.path.chunksize": 20_000,
    # no random names and no date: the same run gives the same bytes
    "svg.hashsalt": "dh2sim",
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
}


@contextmanager
def plot_style() -> Iterator[None]:
    """Draw with ``SETTINGS`` over matplotlib's defaults; a user's own settings are restored at the end."""
    import matplotlib as mpl

    with mpl.rc_context():
        # the backend is not a matter of looks, and choosing one would import it
        mpl.rcParams.update({name: value for name, value in mpl.rcParamsDefault.items() if name != "backend"})
        mpl.rcParams.update(SETTINGS)
        yield


def make_figure(width: float, height: float, title: str) -> Any:
    """Return a ``matplotlib.figure.Figure`` of a size in inches, with a title."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    engine: Any = figure.get_layout_engine()
    engine.set(w_pad=0.06, h_pad=0.05)
    letters = min(11.0, (width - 0.3) * 72 / (0.68 * max(1, len(title))))
    figure.suptitle(title, x=0.012, ha="left", fontweight="bold", color=INK, fontsize=letters)
    return figure


def legend_below(figure: Any, axes: Any) -> None:
    """Put one legend for the whole figure at the bottom, with every label of some axes once."""
    found: dict[str, Any] = {}
    for ax in axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    if found:
        figure.legend(found.values(), found.keys(), loc="outside lower center", ncols=len(found))


def legend_beside(ax: Any) -> None:
    """Put a legend of one row above the right end of some axes."""
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=4, handlelength=1.4, borderaxespad=0.2)


def require_plot(out: Path, *, what: str = "plotting") -> None:
    """Check the ending of a file's name, and that matplotlib is installed.

    Args:
        out: the file.
        what: what is drawn, for messages.

    Raises:
        PictureError: the ending is none of ``ENDINGS``.
        MissingExtraError: matplotlib is not installed.
    """
    if out.suffix.lower() not in ENDINGS:
        raise PictureError(f"cannot write {shown(out.name)} as a plot; allowed endings: {', '.join(ENDINGS)}")
    require_extra("plot", "matplotlib", what=what)


def _without_formulas(figure: Any) -> None:
    """Let dollar signs be dollar signs: names of robots, joints and files may have them, and may be a stranger's.

    Texts of ticks, which matplotlib typesets, are made later.
    """
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        if text.get_text():
            text.set_parse_math(False)


def save(figure: Any, out: Path, *, dpi: float, formulas: bool = False) -> None:
    """Write a figure, whole or not at all.

    Args:
        figure: ``matplotlib.figure.Figure``, drawn within ``plot_style``.
        out: .png, .svg or .pdf.
        dpi: pixels an inch, of .png.
        formulas: Whether texts between dollar signs are formulas.

    Raises:
        OutputError: it cannot be written, or is too small for its labels.
    """
    dates: dict[str, dict[str, Any]] = {
        ".svg": {"Date": None, "Creator": "dh2sim"},
        ".pdf": {"CreationDate": None, "Creator": "dh2sim", "Producer": None},
        ".png": {"Software": "dh2sim"},
    }
    ending = out.suffix.lower()
    if not formulas:
        _without_formulas(figure)
    with atomic_file(out) as draft, warnings.catch_warnings():
        warnings.filterwarnings("error", message="constrained_layout not applied")
        warnings.filterwarnings("ignore", message="Glyph .* missing from")  # of a name, which may be a stranger's
        try:
            figure.savefig(draft, dpi=dpi, format=ending[1:], metadata=dates[ending])
        except UserWarning as warning:
            raise OutputError(f"cannot write '{out}': the picture is too small for its labels") from warning


def value_range(*values: NDArray[Any]) -> tuple[float, float]:
    """Return the range of an axis that shows values; where they hardly change, it does not blow up their rounding.

    It is wide enough then for labels that are whole numbers, without an offset at the axis's end.
    """
    together = np.concatenate([np.ravel(value) for value in values if np.size(value)] or [np.zeros(1)])
    together = together[np.isfinite(together)]
    low, high = (float(together.min()), float(together.max())) if len(together) else (0.0, 0.0)
    size = max(1.0, abs(low), abs(high))
    if high - low < 1e-6 * size:
        low, high = 0.5 * (low + high) - 1e-2 * size, 0.5 * (low + high) + 1e-2 * size
    margin = 0.07 * (high - low)
    return low - margin, high + margin


def shade_outside(ax: Any, lower: float, upper: float, low: float, high: float) -> None:
    """Set the range of the y axis, and shade what is outside of limits.

    Args:
        ax: the axes.
        lower: limit, or -inf.
        upper: limit, or inf.
        low: of the axis.
        high: of the axis.
    """
    ax.set_ylim(low, high)
    for begin, end in ((low, min(lower, high)), (max(upper, low), high)):
        if end > begin:
            ax.axhspan(begin, end, color=FORBIDDEN, lw=0, zorder=0, label="outside the limits")
    for limit in (lower, upper):
        if low < limit < high:
            ax.axhline(limit, color=RED, lw=0.8, alpha=0.7, zorder=1)
