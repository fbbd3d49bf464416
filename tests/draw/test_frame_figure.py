from __future__ import annotations

import itertools
import xml.etree.ElementTree as ET
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest

from dh2sim.draw.frame_figure.figure import draw_assignment, require_frame_figure
from dh2sim.draw.frame_figure.paper import text_size
from dh2sim.draw.frame_figure.robot import ring_around
from dh2sim.draw.frame_figure.scene import make_scene
from dh2sim.draw.frame_figure.view import best_view
from dh2sim.draw.labels import Label, place_labels
from dh2sim.draw.plot_style import plot_style
from dh2sim.draw.projection import look_from
from dh2sim.errors import OutputError, PictureError
from dh2sim.importing.axes import import_axes
from dh2sim.importing.result import Imported
from dh2sim.importing.sources import ImportOptions, import_data
from dh2sim.robot.axes_file import read_axes
from dh2sim.robot.row import Convention, Limits
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.typing import Array
from tests.importing.axes_samples import MODIFIED, SLIDE, STANDARD, TURN, made_of, random_axes

AXES = Path(__file__).resolve().parents[2] / "docs" / "puma560_axes.yaml"
UP, X, Y = (0, 0, 1), (1, 0, 0), (0, 1, 0)


def puma(convention: Convention = STANDARD) -> Imported:
    spec = read_axes(AXES.read_bytes(), file=AXES.name, directory=AXES.parent)
    return import_axes(spec, convention=convention)


def gantry(*limits: Limits) -> Imported:
    axes = ((SLIDE, (0, 0, 0), UP), (SLIDE, (0, 0, 0), X), (SLIDE, (0, 0, 0), Y))
    return made_of(*axes, tip=(0.4, 0.2, 0.6), limits=limits)


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".svg", ".png", ".pdf"])
def test_the_same_robot_gives_the_same_bytes(ending: str, tmp_path: Path) -> None:
    for name in ("one", "two"):
        draw_assignment(puma(), tmp_path / f"{name}{ending}")
    assert (tmp_path / f"one{ending}").read_bytes() == (tmp_path / f"two{ending}").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"one{ending}", f"two{ending}"]


@pytest.mark.slow
def test_a_picture_is_of_the_kind_that_its_ending_says(tmp_path: Path) -> None:
    draw_assignment(puma(), tmp_path / "a.SVG")
    draw_assignment(puma(), tmp_path / "a.png")
    draw_assignment(puma(), tmp_path / "a.pdf")
    assert ET.parse(tmp_path / "a.SVG").getroot().tag == "{http://www.w3.org/2000/svg}svg"
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.slow
def test_users_settings_of_matplotlib_neither_matter_nor_change(tmp_path: Path) -> None:
    draw_assignment(puma(), tmp_path / "plain.svg")
    with mpl.rc_context({"lines.linewidth": 9.0, "font.family": "serif", "text.color": "red"}):
        before = dict(mpl.rcParams)
        draw_assignment(puma(), tmp_path / "theirs.svg")
        assert dict(mpl.rcParams) == before
    assert (tmp_path / "theirs.svg").read_bytes() == (tmp_path / "plain.svg").read_bytes()


@pytest.mark.parametrize("name", ["frames.gif", "frames"])
def test_other_endings_are_refused(name: str, tmp_path: Path) -> None:
    message = f"cannot write '{name}' as a plot; allowed endings: .png, .svg, .pdf"
    with pytest.raises(PictureError) as caught:
        draw_assignment(puma(), tmp_path / name)
    assert str(caught.value) == message
    with pytest.raises(PictureError) as caught:
        require_frame_figure(Path(name))
    assert str(caught.value) == message
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_there_is_reported(tmp_path: Path) -> None:
    out = tmp_path / "nowhere" / "a.svg"
    with pytest.raises(OutputError) as caught:
        draw_assignment(puma(), out)
    assert str(caught.value) == f"cannot write '{out}': there is no folder '{out.parent}'"


def test_a_robot_made_of_a_table_has_no_axes_to_draw(tmp_path: Path) -> None:
    options = ImportOptions(convention=STANDARD, angle=AngleUnit.DEG, length=LengthUnit.M)
    imported = import_data(b"| theta | d | a | alpha |\n|---|---|---|---|\n| q1 | 0 | 0.3 | 90 |\n", "t.md", options)
    with pytest.raises(ValueError, match=r"^frames were not assigned: the source is a table$"):
        draw_assignment(imported, tmp_path / "a.svg")


@pytest.mark.slow
@pytest.mark.parametrize("convention", [STANDARD, MODIFIED])
@pytest.mark.parametrize("seed", range(6))
def test_any_robot_can_be_drawn(seed: int, convention: Convention, tmp_path: Path) -> None:
    imported = made_of(*random_axes(seed), tip=(0.3, -0.2, 0.7), rpy=(10, 20, 30), convention=convention)
    draw_assignment(imported, tmp_path / "a.svg")
    root = ET.parse(tmp_path / "a.svg").getroot()
    width, height = (float(root.attrib[side].removesuffix("pt")) for side in ("width", "height"))
    assert 300 < width < 900
    assert 250 < height < 900


def test_a_robot_without_any_length_can_be_drawn(tmp_path: Path) -> None:
    draw_assignment(made_of((TURN, (0, 0, 0), UP), tip=(0, 0, 0)), tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 5000


@pytest.mark.parametrize(
    ("convention", "lengths"),
    [
        (STANDARD, [("a", 2, 0.4318), ("d", 3, 0.15005), ("a", 3, 0.0203), ("d", 4, 0.4318)]),
        (MODIFIED, [("a", 2, 0.4318), ("d", 3, 0.15005), ("a", 3, 0.0203), ("d", 4, 0.4318)]),
    ],
)
def test_the_lengths_of_the_table_are_drawn_from_end_to_end(
    convention: Convention, lengths: list[tuple[str, int, float]]
) -> None:
    segments = make_scene(puma(convention)).segments
    found = [(s.letter, s.index, float(np.linalg.norm(s.end - s.start))) for s in segments]
    assert [item[:2] for item in found] == [item[:2] for item in lengths]
    np.testing.assert_allclose([item[2] for item in found], [item[2] for item in lengths], rtol=1e-12)
    for before, after in itertools.pairwise(segments):
        np.testing.assert_allclose(before.end, after.start, atol=1e-12)
    np.testing.assert_allclose(segments[-1].end, [0.4521, -0.15005, 0.4318], atol=1e-12)


def test_frames_in_one_place_share_their_arrows() -> None:
    scene = make_scene(puma())
    names = {(pointer.letter, pointer.indices) for pointer in scene.pointers if pointer.letter != "y"}
    assert names == {
        ("x", (0, 1)),
        ("z", (0,)),
        ("z", (1,)),
        ("x", (2,)),
        ("z", (2,)),
        ("x", (3,)),
        ("z", (3,)),
        ("x", (4, 5, 6)),
        ("z", (4,)),
        ("z", (5, 6)),
    }
    assert len(scene.origins) == 4


def test_joints_in_line_share_an_axis_in_their_order() -> None:
    scene = make_scene(puma())
    assert [axis.joints for axis in scene.axes] == [(1,), (2,), (3,), (4, 6), (5,)]
    [shared] = [axis for axis in scene.axes if axis.joints == (4, 6)]
    assert shared.senses == (1, 1)
    np.testing.assert_allclose(shared.start, [0.4521, -0.15005, 0], atol=1e-12)
    np.testing.assert_allclose(shared.end, [0.4521, -0.15005, 0.4318], atol=1e-12)


def test_joints_in_line_that_turn_against_each_other_are_distinguished() -> None:
    scene = make_scene(made_of((TURN, (0, 0, 0), UP), (TURN, (0, 0, 0.3), (0, 0, -1)), tip=(0, 0, 0.5)))
    [axis] = scene.axes
    assert (axis.joints, axis.senses) == ((1, 2), (1, -1))


def test_sliding_joints_that_would_hide_a_length_are_extended_within_their_limits() -> None:
    ways = Limits(position=(0.0, 0.05)), Limits(position=(-0.3, -0.1)), Limits(position=(-0.2, 0.0))
    lone = made_of((TURN, (0, 0, 0), UP), (SLIDE, (0, 0, 0), X), (TURN, (0, 0, 0), UP), tip=(0.4, 0, 0))
    assert make_scene(lone).extended == ((2, 0.1),)
    assert make_scene(gantry(*ways)).extended == ()
    for limits, drawn in zip(ways, (0.05, -0.1, -0.1), strict=True):
        axes = (TURN, (0, 0, 0), UP), (SLIDE, (0, 0, 0), X), (TURN, (0, 0, 0), UP)
        scene = make_scene(made_of(*axes, tip=(0.4, 0, 0), limits=(Limits(), limits, Limits())))
        assert scene.extended == ((2, drawn),)
        slid = [s for s in scene.segments if s.letter == "d" and s.index == 2]
        assert [float(np.linalg.norm(s.end - s.start)) for s in slid] == pytest.approx([abs(drawn)])


def test_the_view_is_a_projection_along_one_direction_with_z_upright() -> None:
    for azimuth, elevation in ((-55, 22), (130, 14), (20, 38)):
        view = look_from(azimuth, elevation)
        np.testing.assert_allclose(
            [view.right @ view.right, view.up @ view.up, view.right @ view.up], [1, 1, 0], atol=1e-12
        )
        flat = view.project([[0, 0, 1], [0, 0, 0]])
        assert flat[0, 1] > flat[1, 1]
        assert flat[0, 0] == pytest.approx(flat[1, 0])


def test_the_view_shows_the_puma_without_crossings_and_with_its_axes_apart() -> None:
    scene = make_scene(puma())
    view = best_view(scene)
    directions = view.project(np.eye(3))
    assert np.linalg.norm(directions, axis=1).min() > 0.35
    places = view.project(np.array(scene.origins))
    size = np.ptp(places, axis=0).max()
    assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(places, 2)) > 0.05 * size
    lengths = {(s.letter, s.index): view.project([s.start, s.end]) for s in scene.segments}
    a2, d4 = lengths["a", 2], lengths["d", 4]
    shares = np.linalg.solve(np.column_stack([a2[1] - a2[0], d4[0] - d4[1]]), d4[0] - a2[0])
    assert not (0 < shares[0] < 1 and 0 < shares[1] < 1), "the forearm does not hide the upper arm"


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, -1, 0), (0.6, 0, -0.8)])
def test_the_arrow_around_a_turning_joint_is_right_handed(direction: tuple[float, ...]) -> None:
    axis = np.array(direction)
    up = look_from(-55, 22).up
    ring = ring_around(axis, up)
    np.testing.assert_allclose(ring @ axis, 0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(ring, axis=1), 1, atol=1e-12)
    assert all(np.cross(a, b) @ axis > 0 for a, b in itertools.pairwise(ring))
    across = up - (up @ axis) * axis
    assert (ring @ (across / np.linalg.norm(across))).max() < np.cos(np.radians(30)), "the gap is above"


def test_labels_keep_off_each_other_and_off_what_is_drawn() -> None:
    line = np.column_stack([np.linspace(0, 200, 101), np.zeros(101)])
    labels = [
        Label(
            text=f"$x_{k}$",
            color="k",
            size=10,
            box=text_size(f"$x_{k}$", 10),
            anchor=np.array([100.0, 0.0]),
            towards=np.array([1.0, 0.0]),
        )
        for k in range(8)
    ]
    with plot_style():
        placed = place_labels(labels, line)
        boxes = [_box(item.centre, item.label) for item in placed]
    for (low, high), (other_low, other_high) in itertools.combinations(boxes, 2):
        assert np.any(low > other_high) or np.any(other_low > high)
    for low, high in boxes:
        assert not np.any(np.all((line > low) & (line < high), axis=1))


def _box(centre: Array, label: Label) -> tuple[Array, Array]:
    half = 0.5 * np.array(text_size(label.text, label.size))
    return centre - half, centre + half
