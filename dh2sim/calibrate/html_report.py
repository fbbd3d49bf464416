"""The report as one HTML file that needs nothing else: tables, and plots as SVG."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dh2sim.calibrate.held_out import Errors
from dh2sim.calibrate.observations import LENGTH
from dh2sim.calibrate.result import Calibration, ParameterResult, ParameterStatus
from dh2sim.typing import Array

_STYLE: Final = """
:root { color-scheme: light; --line: #d5d9de; --soft: #6b7280; }
body { font: 15px/1.5 system-ui, sans-serif; color: #1c2128; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; margin-bottom: 0; } h2 { font-size: 1.15rem; margin-top: 2.2rem; }
p.lead { color: var(--soft); margin-top: .2rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .15rem .9rem .15rem 0; text-align: right; border-bottom: 1px solid var(--line); }
.text { text-align: left; }
th { font-weight: 600; }
figure { margin: 1rem 0; } figcaption { color: var(--soft); max-width: 48rem; }
svg { max-width: 100%; height: auto; display: block; } svg text { font: 12px system-ui, sans-serif; fill: #1c2128; }
svg .soft { fill: #6b7280; } svg .axis { stroke: #9aa1aa; } svg .grid { stroke: #e6e8eb; }
.note { border-left: 3px solid #d97706; padding: .2rem .8rem; margin: .5rem 0; background: #fff8ec; }
"""
_BEFORE: Final = "#8a9099"
_AFTER: Final = "#1f5fa8"
_EXPECTED: Final = "#d9730d"
_OUTLIER: Final = "#c0302a"
_WIDTH: Final = 760
_MOST_POINTS: Final = 4000
_MOST_BARS: Final = 40


def html_report(found: Calibration) -> str:
    """Return the report of a calibration as one HTML page."""
    from dh2sim.calibrate.data import summary

    facts = summary(found)
    name = escape(found.robot.name)
    body = [
        f"<h1>{name}: calibration</h1>",
        f'<p class="lead">{escape(facts[0][1])}</p>',
        _table(["", ""], [[left, right] for left, right in facts[1:]], text=2),
        *(f'<p class="note">{escape(note)}</p>' for note in found.notes),
        "<h2>Errors</h2>",
        _errors(found),
        *_held_out_figure(found),
        "<h2>Residuals</h2>",
        *_residual_figures(found),
        *_outliers(found),
        "<h2>Parameters</h2>",
        *_parameter_figures(found),
        _parameters(found),
        *_not_fitted(found),
    ]
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{name}: calibration</title>\n'
        f"<style>{_STYLE}</style>\n</head>\n<body>\n" + "\n".join(body) + "\n</body>\n</html>\n"
    )


def _table(head: Sequence[str], rows: Iterable[Sequence[str]], *, text: int = 1) -> str:
    """Return a table whose first columns are text."""
    lines = ["<table>"]
    if any(head):
        lines.append(_row(head, "th", text))
    lines += [_row(row, "td", text) for row in rows]
    return "\n".join([*lines, "</table>"])


def _row(cells: Sequence[str], tag: str, text: int) -> str:
    made = (
        f'<{tag} class="text">{escape(cell)}</{tag}>' if k < text else f"<{tag}>{escape(cell)}</{tag}>"
        for k, cell in enumerate(cells)
    )
    return f"<tr>{''.join(made)}</tr>"


def _milli(value: float) -> str:
    return "–" if math.isnan(value) else f"{1e3 * value:.3f}"


def _errors(found: Calibration) -> str:
    columns = ["length"]
    heads = ["rms error", "mm"]
    if found.measured.kind == "pose":
        columns.append("angle")
        heads.append("mrad")
    if not math.isnan(found.errors.artefact):
        columns.append("artefact")
        heads.append("distance of sockets, mm")
    given: list[tuple[str, Errors | None]] = [("table as it was", found.errors_before), ("calibrated", found.errors)]
    held = found.held_out
    if held is not None and held.fitted is not None:
        given += [
            (f"held out by {held.by}: table as it was", held.nominal),
            (f"held out by {held.by}: calibrated", held.fitted),
            (f"held out by {held.by}: predicted", held.predicted),
        ]
    rows = [
        [name, *("–" if errors is None else _milli(getattr(errors, column)) for column in columns)]
        for name, errors in given
    ]
    return _table(heads, rows)


class _Plot:
    """An SVG with one pair of axes; y grows upwards."""

    def __init__(
        self, x: tuple[float, float], y: tuple[float, float], *, width: int = _WIDTH, height: int = 260
    ) -> None:
        self.x, self.y = x, (y[0], y[1] if y[1] > y[0] else y[0] + 1.0)
        self.width, self.height = width, height
        self.left, self.bottom, self.top, self.right = 56 if width == _WIDTH else 40, 36, 18, 12
        self.parts: list[str] = []

    def at_x(self, value: float) -> float:
        low, high = self.x
        return self.left + (value - low) / (high - low) * (self.width - self.left - self.right)

    def at_y(self, value: float) -> float:
        low, high = self.y
        return self.height - self.bottom - (value - low) / (high - low) * (self.height - self.bottom - self.top)

    def axes(self, x_label: str, y_label: str, *, x_ticks: bool = True) -> None:
        base, left, end = self.at_y(self.y[0]), self.left, self.width - self.right
        for value in _ticks(*self.y):
            y = self.at_y(value)
            self.parts.append(f'<line class="grid" x1="{left}" x2="{end}" y1="{y:.1f}" y2="{y:.1f}"/>')
            self.parts.append(f'<text x="{left - 6}" y="{y + 4:.1f}" text-anchor="end" class="soft">{value:g}</text>')
        self.parts.append(f'<line class="axis" x1="{left}" x2="{end}" y1="{base:.1f}" y2="{base:.1f}"/>')
        if x_ticks:
            for value in _ticks(*self.x):
                x = self.at_x(value)
                self.parts.append(
                    f'<text x="{x:.1f}" y="{base + 16:.1f}" text-anchor="middle" class="soft">{value:g}</text>'
                )
        self.parts.append(
            f'<text x="{(left + end) / 2:.1f}" y="{self.height - 4}" text-anchor="middle" class="soft">'
            f"{escape(x_label)}</text>"
        )
        self.parts.append(f'<text x="4" y="11" class="soft">{escape(y_label)}</text>')

    def svg(self) -> str:
        return _svg(self.parts, self.width, self.height)


def _svg(parts: Sequence[str], width: int, height: int) -> str:
    start = f'<svg viewBox="0 0 {width} {height}" width="{width}" height="{height}" role="img">'
    return f"{start}{''.join(parts)}</svg>"


def _ticks(low: float, high: float, most: int = 6) -> list[float]:
    span = high - low
    if not (math.isfinite(span) and span > 0.0):
        return [low]
    step = 10.0 ** math.floor(math.log10(span / most))
    step = next(step * factor for factor in (1, 2, 5, 10) if span / (step * factor) <= most)
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [round(k * step, 12) for k in range(first, last + 1)]


def _figure(svg: str, caption: str) -> str:
    return f"<figure>{svg}<figcaption>{escape(caption)}</figcaption></figure>"


def _legend(plot: _Plot, entries: Sequence[tuple[str, str]]) -> None:
    x = plot.left + 8.0
    for color, text in entries:
        plot.parts.append(f'<rect x="{x:.0f}" y="3" width="10" height="10" fill="{color}"/>')
        plot.parts.append(f'<text x="{x + 14:.0f}" y="12">{escape(text)}</text>')
        x += 26 + 6.6 * len(text)


def _held_out_figure(found: Calibration) -> list[str]:
    """Return bars of the held-out error of each fold, beside what was predicted."""
    held = found.held_out
    if held is None or held.fitted is None:
        return []
    folds = [fold for fold in held.folds if fold.fitted is not None][:_MOST_BARS]
    values = [1e3 * fold.fitted.length for fold in folds if fold.fitted is not None]
    expected = [1e3 * fold.predicted.length for fold in folds if fold.predicted is not None]
    plot = _Plot((0.0, float(len(folds))), (0.0, 1.15 * max(*values, *expected)))
    plot.axes(f"held out: {held.by}", "", x_ticks=False)
    for k, (fold, value, guess) in enumerate(zip(folds, values, expected, strict=True)):
        x, wide = plot.at_x(k + 0.2), plot.at_x(k + 0.8) - plot.at_x(k + 0.2)
        y, y_guess = plot.at_y(value), plot.at_y(guess)
        name = ", ".join(fold.groups[:3]) + (f" and {len(fold.groups) - 3} more" if len(fold.groups) > 3 else "")
        before = "–" if fold.nominal is None else _milli(fold.nominal.length)
        title = escape(f"{name}: {value:.3f} mm, predicted {guess:.3f} mm, {before} mm before")
        plot.parts.append(
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{wide:.1f}" height="{plot.at_y(0.0) - y:.1f}" fill="{_AFTER}">'
            f"<title>{title}</title></rect>"
            f'<line x1="{x - 3:.1f}" x2="{x + wide + 3:.1f}" y1="{y_guess:.1f}" y2="{y_guess:.1f}" '
            f'stroke="{_EXPECTED}" stroke-width="2"/>'
        )
        room = int(plot.width / max(len(folds), 1) / 7)
        label = name if len(name) <= room else f"{name[: max(room - 1, 1)]}…"
        plot.parts.append(
            f'<text x="{x + wide / 2:.1f}" y="{plot.at_y(0.0) + 15:.1f}" text-anchor="middle" class="soft">'
            f"{escape(label)}</text>"
        )
    _legend(plot, [(_AFTER, "held out, mm"), (_EXPECTED, "predicted by the covariance and the noise")])
    return [_figure(plot.svg(), f"Each {held.by} was left out of a fit once, and is seen by that fit here.")]


def _lengths(found: Calibration) -> tuple[NDArray[np.intp], Array, Array]:
    """Return rows, and how far off each is before and after, mm."""
    rows: list[Array] = []
    for fitted in (found.before, found.fit):
        equations = fitted.equations
        mine = (equations.row >= 0) & (equations.scale == LENGTH)
        squares = np.bincount(equations.row[mine], equations.e[mine] ** 2, minlength=len(found.measured))
        rows.append(1e3 * np.sqrt(squares))
    there = np.unique(found.fit.equations.row[found.fit.equations.row >= 0])
    return there, rows[0][there], rows[1][there]


def _residual_figures(found: Calibration) -> list[str]:
    rows, before, after = _lengths(found)
    if len(rows) > _MOST_POINTS:
        pick = np.linspace(0, len(rows) - 1, _MOST_POINTS).round().astype(int)
        rows, before, after = rows[pick], before[pick], after[pick]
    measured = found.measured
    groups = [""] * len(measured) if measured.groups is None else list(measured.groups)
    outliers = {outlier.row for outlier in found.outliers}
    low = max(float(min(after.min(), before.min())), 1e-6)
    plot = _Plot(
        (0.0, float(len(rows) + 1)),
        (math.log10(low) - 0.1, math.log10(max(float(before.max()), float(after.max()), low * 1.1)) + 0.25),
    )
    first, last = math.ceil(plot.y[0]), math.floor(plot.y[1])
    for power in range(first, last + 1):
        y = plot.at_y(power)
        plot.parts.append(
            f'<line class="grid" x1="{plot.left}" x2="{plot.width - plot.right}" y1="{y:.1f}" y2="{y:.1f}"/>'
            f'<text x="{plot.left - 6}" y="{y + 4:.1f}" text-anchor="end" class="soft">{10.0**power:g}</text>'
        )
    base = plot.at_y(plot.y[0])
    plot.parts.append(
        f'<line class="axis" x1="{plot.left}" x2="{plot.width - plot.right}" y1="{base:.1f}" y2="{base:.1f}"/>'
    )
    changes = [k for k in range(1, len(rows)) if groups[rows[k]] != groups[rows[k - 1]]]
    if len(changes) <= _MOST_BARS:
        starts = [0, *changes]
        for start, end in zip(starts, [*changes, len(rows)], strict=True):
            x = plot.at_x(start + 0.5)
            plot.parts.append(f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{plot.top}" y2="{base:.1f}"/>')
            room = int((plot.at_x(end + 0.5) - x) / 7)
            name = groups[rows[start]]
            if name and room >= 4:
                label = name if len(name) <= room else f"{name[: room - 1]}…"
                plot.parts.append(
                    f'<text x="{(x + plot.at_x(end + 0.5)) / 2:.1f}" y="{base + 15:.1f}" text-anchor="middle" '
                    f'class="soft">{escape(label)}</text>'
                )
    for values, color in ((before, _BEFORE), (after, _AFTER)):
        for k, (row, value) in enumerate(zip(rows.tolist(), values.tolist(), strict=True)):
            own = _OUTLIER if row in outliers and color == _AFTER else color
            y = plot.at_y(math.log10(max(value, low)))
            title = escape(f"{measured.place(row)} {groups[row]}: {value:.3f} mm".replace(" :", ":"))
            plot.parts.append(
                f'<circle cx="{plot.at_x(k + 1):.1f}" cy="{y:.1f}" r="2" fill="{own}"><title>{title}</title></circle>'
            )
    plot.parts.append(
        f'<text x="{plot.width / 2:.0f}" y="{plot.height - 4}" text-anchor="middle" class="soft">measurements</text>'
    )
    entries = [(_BEFORE, "table as it was, mm"), (_AFTER, "calibrated, mm")]
    _legend(plot, [*entries, (_OUTLIER, "outliers")] if outliers else entries)
    figures = [_figure(plot.svg(), "How far off each measurement is, on a logarithmic scale.")]
    figures.append(_figure(_histogram(found), _HISTOGRAM))
    figures.append(_figure(_by_joint(found, rows, after), _BY_JOINT))
    return figures


_HISTOGRAM: Final = (
    "What is left, in standard deviations and corrected for what the fit follows, beside the normal distribution."
)
_BY_JOINT: Final = (
    "What is left by joint coordinate, mm: a pattern means that something is not in the table, such as a gear's "
    "eccentricity or a link that bends."
)


def _histogram(found: Calibration) -> str:
    fitted = found.fit
    mine = (fitted.equations.row >= 0) & (fitted.weight > 0.0)
    z = fitted.equations.e[mine] / fitted.sigma.of(fitted.equations.scale[mine])
    z = z / np.sqrt(np.maximum(1.0 - fitted.leverage[mine], 0.05))
    bins = np.linspace(-5.0, 5.0, 41)
    share = np.histogram(np.clip(z, -4.999, 4.999), bins)[0] / max(len(z), 1) / (bins[1] - bins[0])
    plot = _Plot((-5.0, 5.0), (0.0, max(0.45, 1.1 * float(share.max()))), height=220)
    plot.axes("standard deviations", "")
    for left, right, value in zip(bins[:-1].tolist(), bins[1:].tolist(), share.tolist(), strict=True):
        y = plot.at_y(value)
        plot.parts.append(
            f'<rect x="{plot.at_x(left) + 0.5:.1f}" y="{y:.1f}" width="{plot.at_x(right) - plot.at_x(left) - 1:.1f}" '
            f'height="{plot.at_y(0.0) - y:.1f}" fill="{_AFTER}" fill-opacity=".75"/>'
        )
    curve = " ".join(
        f"{plot.at_x(x):.1f},{plot.at_y(math.exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi)):.1f}"
        for x in np.linspace(-5.0, 5.0, 101).tolist()
    )
    plot.parts.append(f'<polyline points="{curve}" fill="none" stroke="{_EXPECTED}" stroke-width="2"/>')
    _legend(plot, [(_AFTER, "residuals"), (_EXPECTED, "normal distribution")])
    return plot.svg()


def _by_joint(found: Calibration, rows: NDArray[np.intp], after: Array) -> str:
    """Return a small plot for each joint, four in a line."""
    joints = found.robot.moving_rows
    shown = joints[:24]
    wide, high = _WIDTH // 4, 130
    parts = []
    top = 1.05 * float(after.max(initial=1e-9))
    for k, joint in enumerate(shown):
        q = found.measured.q[rows, k]
        q = np.degrees(q) if joint.type.turns else 1e3 * q
        low, high_q = float(q.min()), float(q.max())
        pad = 0.05 * (high_q - low) or 1.0
        plot = _Plot((low - pad, high_q + pad), (0.0, top), width=wide, height=high)
        plot.axes(f"{joint.name}, {'deg' if joint.type.turns else 'mm'}", "")
        plot.parts = [part for part in plot.parts if "grid" not in part]
        for x, y in zip(q.tolist(), after.tolist(), strict=True):
            plot.parts.append(
                f'<circle cx="{plot.at_x(x):.1f}" cy="{plot.at_y(y):.1f}" r="1.5" fill="{_AFTER}" fill-opacity=".6"/>'
            )
        parts.append(f'<g transform="translate({wide * (k % 4)} {high * (k // 4)})">{"".join(plot.parts)}</g>')
    height = high * -(-len(shown) // 4)
    return _svg(parts, _WIDTH, height)


def _parameter_figures(found: Calibration) -> list[str]:
    """Return changes with their standard deviations, lengths and angles each by themselves."""
    figures = []
    for is_angle, unit in ((False, "mm"), (True, "mrad")):
        table = [
            each
            for each in found.parameters
            if each.status is ParameterStatus.FITTED and each.is_angle is is_angle and each.nominal is not None
        ]
        if table:
            caption = f"Changes of the table, {unit}, with two standard deviations."
            figures.append(_figure(_changes(table, unit), caption))
    return figures


def _changes(table: Sequence[ParameterResult], unit: str) -> str:
    reach = max(abs(1e3 * each.change) + 2e3 * (each.sigma or 0.0) for each in table) * 1.08 or 1.0
    line, left = 18, 150
    height = line * len(table) + 40
    parts = []

    def at(value: float) -> float:
        return left + (value + reach) / (2.0 * reach) * (_WIDTH - left - 12)

    for value in _ticks(-reach, reach):
        x = at(value)
        parts.append(
            f'<line class="{"axis" if value == 0.0 else "grid"}" x1="{x:.1f}" x2="{x:.1f}" y1="4" '
            f'y2="{height - 32}"/>'
        )
        parts.append(f'<text x="{x:.1f}" y="{height - 18}" text-anchor="middle" class="soft">{value:g}</text>')
    parts.append(f'<text x="{at(0.0):.1f}" y="{height - 3}" text-anchor="middle" class="soft">{unit}</text>')
    for k, each in enumerate(table):
        y = 14 + line * k
        change, sigma = 1e3 * each.change, 1e3 * (each.sigma or 0.0)
        title = f"{each.name}: {change:+.4f} ± {sigma:.4f} {unit}"
        parts.append(
            f'<text x="{left - 8}" y="{y + 4}" text-anchor="end">{escape(each.name)}</text>'
            f'<line x1="{at(change - 2 * sigma):.1f}" x2="{at(change + 2 * sigma):.1f}" y1="{y}" y2="{y}" '
            f'stroke="{_AFTER}" stroke-width="2"/>'
            f'<circle cx="{at(change):.1f}" cy="{y}" r="3.5" fill="{_AFTER}"><title>{escape(title)}</title></circle>'
        )
    return _svg(parts, _WIDTH, height)


def _parameters(found: Calibration) -> str:
    rows = []
    for each in found.parameters:
        if each.status is not ParameterStatus.FITTED or each.sigma is None:
            continue
        unit = "mrad" if each.is_angle else "mm"
        values = ["", ""]
        if each.nominal is not None and each.value is not None:
            shown = (math.degrees, "°") if each.is_angle else (lambda value: 1e3 * value, " mm")
            values = [f"{shown[0](value):.6g}{shown[1]}" for value in (each.nominal, each.value)]
        rows.append([each.name, *values, f"{1e3 * each.change:+.4f}", f"{1e3 * each.sigma:.4f}", unit])
    return _table(["parameter", "was", "is", "change", "sigma", ""], rows)


def _not_fitted(found: Calibration) -> list[str]:
    why: dict[str, list[str]] = {}
    for each in found.parameters:
        reasons = {
            ParameterStatus.FOLDED: f"folded into {', '.join(each.into)}",
            ParameterStatus.UNSEEN: "without effect on what was measured",
            ParameterStatus.HELD: f"held: {each.reason}",
        }
        if each.status in reasons:
            why.setdefault(reasons[each.status], []).append(each.name)
    if not why:
        return []
    rows = [[", ".join(names), reason] for reason, names in why.items()]
    return ["<h2>Left as they were</h2>", _table(["parameters", "why"], rows, text=2)]


def _outliers(found: Calibration) -> list[str]:
    if not found.outliers:
        return []
    rows = [
        [each.place, each.group, f"{each.times:.1f}", _milli(each.length), "left out" if each.left_out else ""]
        for each in found.outliers
    ]
    return ["<h2>Outliers</h2>", _table(["row", "group", "sigmas", "mm", ""], rows, text=2)]
