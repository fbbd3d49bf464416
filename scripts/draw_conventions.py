#!/usr/bin/env python3
"""Draw the pictures of docs/conventions.md into docs/images: ``python scripts/draw_conventions.py [FOLDER]``.

Needs the extra `plot`. One version of matplotlib draws the same bytes every time.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np

from dh2sim.draw.plot_style import GREY, INK
from dh2sim.draw.projection import look_from
from dh2sim.kinematics.transforms import joint_part, link_part
from dh2sim.typing import Array

mpl.use("svg")
from matplotlib import pyplot as plt
from matplotlib.patches import FancyArrowPatch, Rectangle

X_COLOR: Final = "#c0392b"
Z_COLOR: Final = "#1f5fbf"
LENGTH_COLOR: Final = "#1e7d4f"
ANGLE_COLOR: Final = "#a35200"

Offset = tuple[float, float]
"""Where a word goes from its point, in points of the type."""


class Scene:
    """Three dimensions in parallel projection on flat axes, so that arrows and words stay crisp."""

    def __init__(self, axes: Any, *, azimuth: float, elevation: float) -> None:
        """Look at the origin from an azimuth and an elevation, degrees."""
        self.axes = axes
        view = look_from(azimuth, elevation)
        self.right, self.up, self.flat = view.right, view.up, view.project
        axes.set_aspect("equal")
        axes.set_axis_off()

    def line(self, start: Array, end: Array, **style: Any) -> None:
        """Draw a line behind everything else."""
        points = self.flat([start, end])
        self.axes.plot(points[:, 0], points[:, 1], **{"color": GREY, "lw": 1.2, "zorder": 1, **style})

    def arrow(self, start: Array, end: Array, color: str, *, style: str = "-|>", lw: float = 2.4) -> None:
        """Draw a straight arrow; a width of zero leaves its tip alone."""
        ends = self.flat([start, end])
        look: dict[str, Any] = {"arrowstyle": style, "mutation_scale": 14, "shrinkA": 0, "shrinkB": 0}
        self.axes.add_patch(FancyArrowPatch(*ends, lw=lw, color=color, zorder=4, **look))

    def arc(self, center: Array, start: Array, axis: Array, angle: float) -> None:
        """Draw an angle about ``axis``, from ``center + start`` on, with a tip where it ends."""
        steps = np.linspace(0, angle, 60)[:, None]
        spokes = center + np.cos(steps) * start + np.sin(steps) * np.cross(axis, start)
        points = self.flat(spokes)
        self.axes.fill(*np.vstack([self.flat(center), points]).T, color=ANGLE_COLOR, alpha=0.13, lw=0, zorder=0)
        self.axes.plot(*points[:-4].T, color=ANGLE_COLOR, lw=1.8, zorder=3)
        self.arrow(spokes[-12], spokes[-1], ANGLE_COLOR, lw=0)

    def dot(self, point: Array, color: str = INK) -> None:
        """Mark a point."""
        x, y = self.flat(point)
        self.axes.plot([x], [y], "o", color=color, ms=6, zorder=5)

    def word(self, point: Array, text: str, color: str = INK, offset: Offset = (0, 0), size: float = 13) -> None:
        """Write ``text`` at a point, moved by ``offset``."""
        place: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "va": "center", "zorder": 6}
        paper = {"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.7}
        style = {"color": color, "fontsize": size, "bbox": paper, "annotation_clip": False}
        self.axes.annotate(text, self.flat(point), xytext=offset, **place, **style)

    def dimension(self, start: Array, end: Array, aside: Array, text: str, offset: Offset) -> None:
        """Draw a length beside what it measures, with thin lines that lead to its ends."""
        for point in (start, end):
            self.line(point, point + 1.25 * aside, lw=0.8, color=LENGTH_COLOR)
        self.arrow(start + aside, end + aside, LENGTH_COLOR, style="<|-|>", lw=1.6)
        self.word((start + end) / 2 + aside, text, LENGTH_COLOR, offset)

    def axis_of_joint(self, start: Array, end: Array, index: str, offset: Offset) -> None:
        """Draw the line that a joint moves about or along, its name at its end."""
        self.line(start, end, ls=(0, (8, 3, 2, 3)))
        self.word(end, f"axis of joint ${index}$", GREY, offset, 11)


def draw_frame(
    scene: Scene,
    T: Array,
    index: str,
    x_offset: Offset,
    z_offset: Offset,
    o_offset: Offset,
    size: float = 1.0,
) -> None:
    """Draw the x and z axes of a frame and their names; y would only crowd the picture."""
    origin = T[:3, 3]
    for column, letter, color, offset in ((0, "x", X_COLOR, x_offset), (2, "z", Z_COLOR, z_offset)):
        tip = origin + size * T[:3, column]
        scene.arrow(origin, tip, color)
        scene.word(tip, f"${letter}_{{{index}}}$", color, offset)
    scene.dot(origin)
    scene.word(origin, f"$o_{{{index}}}$", INK, o_offset, 12)


def draw_small_frame(scene: Scene, T: Array, index: str) -> None:
    """Draw a small frame, each name beyond what it names."""
    x, z = T[:3, 0], T[:3, 2]
    flat = scene.flat([x, z, -x - z])
    x_offset, z_offset, o_offset = 14 * flat / np.linalg.norm(flat, axis=1, keepdims=True)
    draw_frame(scene, T, index, tuple(x_offset), tuple(z_offset), tuple(o_offset), size=0.2)


def standard(axes: Any) -> None:
    """A_i = Rz(theta) Tz(d) Tx(a) Rx(alpha): along the axis of joint i first, then across to the next one."""
    theta, d, a, alpha = np.radians(66), 2.0, 3.0, np.radians(42)
    scene = Scene(axes, azimuth=-60, elevation=25)
    start = np.eye(4)
    half = joint_part(theta, d)
    end = half @ link_part(a, alpha)
    up, x_old, x_new, z_new = start[:3, 2], start[:3, 0], end[:3, 0], end[:3, 2]
    foot, corner, tip = start[:3, 3], half[:3, 3], end[:3, 3]

    scene.axis_of_joint(foot - 0.6 * up, corner + 1.3 * up, "i", (0, 10))
    scene.axis_of_joint(tip - 1.3 * z_new, tip + 2.6 * z_new, "i+1", (20, 10))
    scene.line(corner, tip, color=INK, lw=1.6)
    scene.word(0.3 * corner + 0.7 * tip, "common normal", GREY, (6, -19), 10)

    scene.line(corner, corner + 1.3 * x_old, ls="--", color=X_COLOR)
    scene.arc(corner, 0.95 * x_old, up, theta)
    scene.word(corner + 0.95 * joint_part(theta / 2, 0)[:3, 0], r"$\theta_i$", ANGLE_COLOR, (12, -3))

    scene.line(tip, tip + 1.4 * up, ls="--", color=Z_COLOR)
    scene.arc(tip, 1.2 * up, x_new, alpha)
    middle = (half @ link_part(0, alpha / 2))[:3, 2]
    scene.word(tip + 1.2 * middle, r"$\alpha_i$", ANGLE_COLOR, (6, 13))

    scene.dimension(foot, corner, -0.8 * joint_part(np.radians(30), 0)[:3, 0], "$d_i$", (-14, 0))
    scene.dimension(corner, tip, 0.42 * up, "$a_i$", (0, 12))
    scene.dot(corner, GREY)

    draw_frame(scene, start, "i-1", (6, -12), (20, 0), (-19, 11))
    draw_frame(scene, end, "i", (14, 4), (14, -4), (-2, -15))


def modified(axes: Any) -> None:
    """A_i = Tx(a) Rx(alpha) Rz(theta) Tz(d): across to the axis of joint i first, then along it."""
    a, alpha, theta, d = 3.0, np.radians(46), np.radians(100), 2.4
    scene = Scene(axes, azimuth=-124, elevation=20)
    start = np.eye(4)
    half = link_part(a, alpha)
    end = half @ joint_part(theta, d)
    z_old, x_old, z_new = start[:3, 2], start[:3, 0], end[:3, 2]
    foot, corner, tip = start[:3, 3], half[:3, 3], end[:3, 3]

    scene.axis_of_joint(foot - 0.8 * z_old, foot + 2.2 * z_old, "i-1", (0, 10))
    scene.axis_of_joint(corner - 0.9 * z_new, tip + 2.0 * z_new, "i", (30, 10))
    scene.line(foot, corner, color=INK, lw=1.6)
    scene.word(0.4 * foot + 0.6 * corner, "common normal", GREY, (2, 18), 10)

    scene.line(corner, corner + 1.4 * z_old, ls="--", color=Z_COLOR)
    scene.arc(corner, 1.2 * z_old, x_old, alpha)
    middle = link_part(0, alpha / 2)[:3, 2]
    scene.word(corner + 1.2 * middle, r"$\alpha_{i-1}$", ANGLE_COLOR, (6, 13))

    scene.line(tip, tip + 1.3 * x_old, ls="--", color=X_COLOR)
    scene.arc(tip, 0.95 * x_old, z_new, theta)
    scene.word(tip + 0.95 * (half @ joint_part(theta / 2, 0))[:3, 0], r"$\theta_i$", ANGLE_COLOR, (4, 13))

    scene.dimension(foot, corner, -0.5 * z_old, "$a_{i-1}$", (0, -13))
    scene.dimension(corner, tip, 0.45 * x_old, "$d_i$", (12, -6))
    scene.dot(corner, GREY)

    draw_frame(scene, start, "i-1", (0, 14), (-20, 0), (-20, -4))
    draw_frame(scene, end, "i", (-10, 6), (14, -4), (-14, -6))


def row_products(axes: Any) -> None:
    """Draw the one product of X and Z parts that both conventions cut into rows, each at its own places."""
    axes.set_axis_off()
    axes.set_aspect("equal")
    parts = [(letter, k) for k in range(4) for letter in "ZX" if not (letter == "Z" and k == 0)]
    for place, (letter, k) in enumerate(parts):
        color = X_COLOR if letter == "X" else Z_COLOR
        axes.add_patch(Rectangle((place + 0.06, 0), 0.88, 0.8, fc=color, alpha=0.12, lw=0))
        axes.add_patch(Rectangle((place + 0.06, 0), 0.88, 0.8, fc="none", ec=color, lw=1.4))
        inside = rf"$a_{k},\ \alpha_{k}$" if letter == "X" else rf"$\theta_{k},\ d_{k}$"
        axes.text(place + 0.5, 0.53, f"${letter}_{k}$", color=color, fontsize=14, ha="center", va="center")
        axes.text(place + 0.5, 0.2, inside, color=INK, fontsize=9.5, ha="center", va="center")
    for k in (1, 2, 3):
        left = 2 * k - 1
        bracket(axes, left, 1.05, f"standard row {k}: $A_{k} = Z_{k}X_{k}$", upwards=True)
        bracket(axes, left - 1, -0.25, f"modified row {k}: $A_{k} = X_{k - 1}Z_{k}$", upwards=False)
        bracket(axes, left - 1, -1.0, f"body {k}, placed at joint {k}", upwards=False)
    axes.set_xlim(-0.1, 7.1)
    axes.set_ylim(-1.6, 1.75)


def bracket(axes: Any, left: float, height: float, text: str, *, upwards: bool) -> None:
    """Embrace two boxes, from ``left`` on, above or below them."""
    leg = -0.13 if upwards else 0.13
    x = [left + 0.08, left + 0.08, left + 1.92, left + 1.92]
    axes.plot(x, [height + leg, height, height, height + leg], color=INK, lw=1.4)
    axes.text(left + 1, height - 1.8 * leg, text, color=INK, fontsize=10, ha="center", va="center")


def two_arms(axes: Any) -> None:
    """Draw the worked example's table as both conventions read it."""
    q = np.radians([20, 50])
    X = [link_part(0.3, np.radians(37.3)), link_part(0.5, np.radians(-64.1))]
    Z = [joint_part(q[0], 0.4), joint_part(np.radians(15) + q[1], 0.2)]
    scene = Scene(axes, azimuth=-58, elevation=24)
    for name, order, place in (
        ("standard", [Z[0], X[0], Z[1], X[1]], 0.0),
        ("modified", [X[0], Z[0], X[1], Z[1]], 1.2),
    ):
        T = np.eye(4)
        T[:3, 3] = place * scene.right
        scene.word(T[:3, 3] - 0.2 * scene.up + 0.2 * scene.right, f"read as {name}", INK, size=12)
        for number, part in enumerate(order):
            if number % 2 == 0:
                draw_small_frame(scene, T, str(number // 2))
            following = T @ part
            scene.line(T[:3, 3], following[:3, 3], lw=7, alpha=0.45, solid_capstyle="round")
            T = following
        draw_small_frame(scene, T, "2")


PICTURES: Final[dict[str, tuple[Callable[[Any], None], tuple[float, float]]]] = {
    "dh_standard": (standard, (7.2, 5.4)),
    "dh_modified": (modified, (7.2, 5.4)),
    "row_products": (row_products, (9.0, 4.3)),
    "two_arms": (two_arms, (8.6, 5.0)),
}


def main(folder: Path) -> None:
    mpl.rcParams.update({"svg.hashsalt": "dh2sim", "svg.fonttype": "path", "font.family": "DejaVu Sans"})
    folder.mkdir(parents=True, exist_ok=True)
    for name, (draw, size) in PICTURES.items():
        figure, axes = plt.subplots(figsize=size)
        draw(axes)
        figure.savefig(
            folder / f"{name}.svg",
            metadata={"Date": None},
            facecolor="white",
            bbox_inches="tight",
            pad_inches=0.12,
        )
        plt.close(figure)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parents[1] / "docs" / "images")
