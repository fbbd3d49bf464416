"""Drawings of robots: what is where agrees with the table, labels are apart, and the files are whole."""

from __future__ import annotations

import itertools
import math
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given

from dh2sim.draw.diagram.arm import place_arm
from dh2sim.draw.diagram.drawing import RobotDrawing, draw_robot
from dh2sim.draw.diagram.sheet import Sheet, text_box
from dh2sim.draw.diagram.stick import tick_step
from dh2sim.draw.projection import look_from
from dh2sim.errors import ConfigurationError, PictureError
from dh2sim.kinematics.table_oracle import table_frame_poses, table_tool_pose
from dh2sim.robot.row import Convention, JointType
from dh2sim.robot.spec import RobotSpec
from dh2sim.typing import Array
from tests.program import dh2sim, environment
from tests.sample_robots import NAMES, robot
from tests.strategies import robots_with_joint_vectors

SEEN = ("puma560", "ssrms", "scara")
STYLES = ("kinematic", "frames", "stick")
SVG = "{http://www.w3.org/2000/svg}"


def texts(drawing: RobotDrawing) -> list[str]:
    return [text.text for text in drawing.sheet.texts]


@given(robots_with_joint_vectors(max_rows=5))
def test_the_arm_is_where_the_table_has_it(sample: tuple[RobotSpec, Array]) -> None:
    spec, [q, *_] = sample
    arm = place_arm(spec, q)
    frames, tool = table_frame_poses(spec, q), table_tool_pose(spec, q)
    near = 1e-9 * max(1.0, float(np.abs(frames).max()), float(np.abs(tool).max()))
    assert np.allclose(arm.frames, frames, rtol=0, atol=near)
    assert np.allclose(arm.T_base_tool, tool, rtol=0, atol=near)
    for joint, row, before, here in zip(arm.joints, spec.rows, frames, frames[1:], strict=False):
        z = (here if row.convention is Convention.MODIFIED else before)[:3, 2]
        assert np.allclose(joint.direction, z, rtol=0, atol=1e-9)
        along = joint.left - joint.reached
        assert np.allclose(np.cross(along, z), 0.0, rtol=0, atol=10.0 * near), "it stays on the axis"
    coordinates = iter(q)
    drawn = {(s.letter, s.index): float(np.linalg.norm(s.end - s.start)) for s in arm.segments}
    for i, row in enumerate(spec.rows, start=1):
        value = float(next(coordinates)) if row.type.moves else 0.0
        slide = 0.0 if row.type.turns or not row.type.moves else value
        d = row.d + (-slide if row.flip else slide)
        if row.convention is Convention.HAYATI:
            continue  # what slides along a Hayati row's z is no length of its table
        a_index = i - 1 if row.convention is Convention.MODIFIED else i
        for key, length in ((("d", i), abs(d)), (("a", a_index), abs(row.a))):
            found = drawn.get(key, 0.0)
            mixed = len({row.convention for row in spec.rows}) > 1
            assert mixed or math.isclose(found, length, abs_tol=1e-5 * arm.reach + 10.0 * near), (key, found, length)


@pytest.mark.parametrize(
    ("name", "style"),
    [
        *(("puma560", style) for style in STYLES),
        *(pytest.param(name, style, marks=pytest.mark.slow) for name in ("ssrms", "scara") for style in STYLES),
        *(pytest.param(name, "kinematic", marks=pytest.mark.slow) for name in NAMES if name not in SEEN),
    ],
)
def test_labels_are_never_on_each_other(name: str, style: str) -> None:
    boxes = []
    for text in draw_robot(robot(name), style=style).sheet.texts:
        half = 0.5 * np.array(text_box(text.text, text.size))
        boxes.append((text.text, text.centre - half, text.centre + half))
    assert len(boxes) > 6
    for (one, low, high), (other, least, most) in itertools.combinations(boxes, 2):
        assert bool((low >= most).any() or (high <= least).any()), f"{one} is on {other}"


@pytest.mark.parametrize(
    "name", ["stanford", *(pytest.param(name, marks=pytest.mark.slow) for name in NAMES if name != "stanford")]
)
def test_every_joint_axis_and_length_is_named_in_the_diagram(name: str) -> None:
    spec = robot(name)
    arm = place_arm(spec, spec.named_configurations["home"])
    found = texts(draw_robot(spec))
    for i, row in enumerate(spec.rows, start=1):
        if row.type.moves:
            assert (f"θ_{i}" if row.type.turns else f"d_{i}") in found
    assert {f"{s.letter}_{s.index}" for s in arm.segments} <= set(found)
    for letter in "xz":
        indices = [text.removeprefix(f"{letter}_") for text in found if text.startswith(f"{letter}_")]
        counted: list[int] = []
        for part in ",".join(indices).split(","):
            first, _, last = part.partition("…")
            counted += range(int(first), int(last or first) + 1)
        assert sorted(counted) == list(range(len(spec.rows) + 1)), "each frame's axis once"


def test_symbols_of_joints_are_apart_although_their_axes_meet() -> None:
    found = draw_robot(robot("stanford"))
    places = {text.text: text.centre for text in found.sheet.texts if text.text.startswith("θ")}
    assert set(places) == {"θ_1", "θ_2", "θ_4", "θ_5", "θ_6"}
    caps = [stroke.points for stroke in found.sheet.strokes if stroke.fill == "#ffffff" and len(stroke.points) == 48]
    middles = [cap.mean(axis=0) for cap in caps]
    assert len(middles) == 5
    assert all(np.linalg.norm(a - b) > 15.0 for a, b in itertools.combinations(middles, 2))
    assert sum(stroke.fill == "#ffffff" and len(stroke.points) == 4 for stroke in found.sheet.strokes) == 3, "a box"


def test_a_stick_plot_has_the_shadow_below_the_arm_in_its_box() -> None:
    spec, q = robot("stanford"), [0.3, -0.7, 0.5, 1.1, 0.6, -0.4]
    sheet = draw_robot(spec, q, style="stick", workspace=(-1, 1, -1, 1, -1, 2), reach=1.0).sheet
    view = look_from(-127.5, 30.0)
    by_color = {stroke.color: stroke.points for stroke in sheet.strokes if stroke.fill is None and not stroke.arrow}
    points = np.vstack([np.zeros(3), table_frame_poses(spec, q)[:, :3, 3], table_tool_pose(spec, q)[None, :3, 3]])
    arm, shadow = by_color["#2f6fb5"], by_color["#b9bfc7"]
    scale = float(np.linalg.norm(arm[-1] - arm[0]) / np.linalg.norm(view.project(points[-1] - points[0])))
    assert np.allclose(arm, scale * view.project(points), rtol=0, atol=1e-6)
    points[:, 2] = -1.0
    assert np.allclose(shadow, scale * view.project(points), rtol=0, atol=1e-6)
    named = [text.text for text in sheet.texts]
    assert {"X", "Y", "Z", "x", "y", "z", "stanford", "\N{MINUS SIGN}0.5", "0.5", "2"} <= set(named)
    assert named.count("0") == 3


@pytest.mark.parametrize(
    ("length", "step"), [(1.0, 0.2), (2.0, 0.5), (4.0, 1.0), (3.0, 1.0), (50.0, 10.0), (1e-3, 2e-4)]
)
def test_ticks_are_at_round_numbers(length: float, step: float) -> None:
    assert tick_step(length) == pytest.approx(step)


@pytest.mark.slow
@pytest.mark.parametrize("style", STYLES)
def test_svg_is_well_formed_the_same_every_time_and_complete(style: str) -> None:
    drawing = draw_robot(robot("puma560"), style=style)
    root = ET.fromstring(drawing.svg)
    assert root.tag == f"{SVG}svg"
    written = ["".join(element.itertext()) for element in root.iter(f"{SVG}text")]
    assert written == [text.replace("_", "") if text[1:2] == "_" else text for text in texts(drawing)]
    assert drawing.svg == draw_robot(robot("puma560"), style=style).svg
    assert drawing.tikz == draw_robot(robot("puma560"), style=style).tikz
    assert "nan" not in drawing.svg


@pytest.mark.slow
def test_everything_is_inside_the_picture() -> None:
    for style in STYLES:
        sheet = draw_robot(robot("ssrms"), style=style).sheet
        left, bottom, right, top = sheet.bounds
        points = np.concatenate([stroke.points for stroke in sheet.strokes])
        assert (points >= [left + 4.0, bottom + 4.0]).all()
        assert (points <= [right - 4.0, top - 4.0]).all()


def test_angle_brackets_and_other_marks_are_text() -> None:
    sheet = Sheet()
    sheet.write([0.0, 0.0], "<a&b>_$%", 10.0, "#000000")
    drawing = RobotDrawing(sheet=sheet)
    assert "".join(ET.fromstring(drawing.svg).itertext()).strip() == "<a&b>_$%"
    assert r"<a\&b>\_\$\%" in drawing.tikz


@pytest.mark.slow
@pytest.mark.parametrize("style", STYLES)
def test_tikz_compiles(style: str, tmp_path: Path) -> None:
    if shutil.which("pdflatex") is None:
        pytest.skip("pdflatex is not installed")
    if subprocess.run(["kpsewhich", "tikz.sty"], capture_output=True, check=False).returncode:
        pytest.skip("TikZ is not installed")
    pictures = [draw_robot(robot(name), style=style).tikz for name in ("stanford", "puma560_standard", "ssrms")]
    body = "\n\n".join(pictures)
    text = f"\\documentclass{{article}}\n\\usepackage{{tikz}}\n\\begin{{document}}\n{body}\\end{{document}}\n"
    (tmp_path / "page.tex").write_text(text, encoding="utf-8")
    done = subprocess.run(
        ["pdflatex", "-halt-on-error", "-interaction=nonstopmode", "page.tex"],
        cwd=tmp_path, capture_output=True, text=True, timeout=180, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-2000:]
    assert (tmp_path / "page.pdf").read_bytes().startswith(b"%PDF")
    assert "Missing character" not in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ending", "begins"), [(".png", b"\x89PNG"), (".pdf", b"%PDF"), (".svg", b"<svg"), (".tex", b"\\beg")]
)
def test_files_are_the_same_every_time(ending: str, begins: bytes, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="the extra 'plot' is not installed")
    for name in ("one", "two"):
        draw_robot(robot("cylindrical"), style="stick").save(tmp_path / f"{name}{ending}")
    data = (tmp_path / f"one{ending}").read_bytes()
    assert data.startswith(begins)
    assert data == (tmp_path / f"two{ending}").read_bytes()


def test_a_notebook_shows_the_drawing() -> None:
    drawing = draw_robot(robot("planar_2r"))
    assert drawing._repr_svg_() == drawing.svg


def test_a_robot_whose_points_are_all_one_is_drawn() -> None:
    spec = robot("spherical_wrist")
    at_one_point = type(spec)(
        **{
            **{name: getattr(spec, name) for name in ("name", "convention")},
            "rows": tuple(
                type(row)(name=row.name, type=JointType.REVOLUTE, a=0.0, alpha=row.alpha, d=0.0, theta=0.0)
                for row in spec.rows
            ),
        }
    )
    for style in STYLES:
        assert "nan" not in draw_robot(at_one_point, style=style).svg


def test_wrong_arguments_are_named() -> None:
    spec = robot("scara")
    for options, message in (
        ({"style": "sketch"}, "unknown style 'sketch'. Allowed: kinematic, frames, stick"),
        ({"workspace": [0] * 6}, "workspace and reach are of the style 'stick'"),
        ({"style": "stick", "workspace": [0, 1, 2]}, "workspace must be six finite numbers"),
        ({"style": "stick", "workspace": [0, 1, 1, 0, 0, 1]}, "workspace must have least values below the greatest"),
        ({"style": "stick", "workspace": [0, 1, 0, math.nan, 0, 1]}, "workspace must be six finite numbers"),
        ({"style": "stick", "reach": 0.0}, "reach must be a length above 0, got 0.0"),
    ):
        with pytest.raises(PictureError) as caught:
            draw_robot(spec, **options)
        assert str(caught.value).startswith(message)
    with pytest.raises(ConfigurationError, match=r"scara has no configuration 'hom'\. Did you mean 'home'"):
        draw_robot(spec, "hom")


@pytest.mark.slow
def test_the_command_writes_what_the_library_draws(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    done = dh2sim("draw", "scara")
    assert (done.status, done.err) == (0, "")
    assert done.out.startswith("scara.svg: scara, kinematic, home: ")
    assert (tmp_path / "scara.svg").read_text(encoding="utf-8") == draw_robot(robot("scara")).svg
    done = dh2sim("draw", "scara", "--as", "tikz", "-o", "-", "--style", "frames", "--configuration", "zero")
    assert (done.status, done.out) == (0, draw_robot(robot("scara"), "zero", style="frames").tikz)
    box = ("--workspace", "-1", "1", "-1", "1", "-1", "1")
    done = dh2sim("draw", "scara", "30", "-45", "0.1", "0", "--style", "stick", *box, "--reach", "1", "-o", "a.tex")
    assert (done.status, done.err) == (0, "")
    q = [math.radians(30), math.radians(-45), 0.1, 0.0]
    expected = draw_robot(robot("scara"), q, style="stick", workspace=(-1, 1, -1, 1, -1, 1), reach=1.0)
    assert (tmp_path / "a.tex").read_text(encoding="utf-8") == expected.tikz


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--style", "stik"], "unknown style 'stik'. Did you mean 'stick'? Allowed: kinematic, frames, stick"),
        (["--as", "gif"], "unknown format 'gif'. Allowed: svg, tikz, png, pdf"),
        (["-o", "arm.bmp"], "cannot write 'arm.bmp' as a drawing; allowed endings: .svg, .tikz, .tex, .png, .pdf"),
        (["--style", "stick", "--workspace", "1", "2"], "must be six numbers, least and greatest x, y and z, m, got"),
        (["--reach", "1"], "workspace and reach are of the style 'stick'"),
        (["--as", "png", "-o", "-"], "prints svg or tikz; name a file for png or pdf"),
        (["--configuration", "hom"], "scara has no configuration 'hom'. Did you mean 'home'?"),
        (["home", "--configuration", "zero"], "gives the configuration already; leave Q out"),
        (["-o", "nowhere/a.svg"], "cannot write 'nowhere/a.svg': there is no folder 'nowhere'"),
    ],
)  # fmt: skip
def test_wrong_options_are_refused(
    options: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = dh2sim("draw", "scara", *options)
    assert (done.status, done.out, list(tmp_path.iterdir())) == (2, "", [])
    assert message in " ".join(done.err.split())


@pytest.mark.slow
def test_the_pictures_of_the_page_are_what_the_command_draws() -> None:
    from scripts.draw_robots import FOLDER, drawings

    for name, drawing in drawings().items():
        assert (FOLDER / name).read_text(encoding="utf-8") == drawing.svg, "run python scripts/draw_robots.py"
        assert f"images/{name}" in (FOLDER.parent / "drawings.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_only_png_and_pdf_need_matplotlib(tmp_path: Path) -> None:
    code = "import sys; sys.modules['matplotlib'] = None; from dh2sim.cli.main import main; main()"

    def run(*options: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", code, "draw", "scara", *options],
            cwd=tmp_path, env=environment(), capture_output=True, text=True, timeout=180, check=False,
        )  # fmt: skip

    for ending in ("svg", "tex"):
        done = run("-o", f"a.{ending}")
        assert (done.returncode, done.stderr) == (0, "")
    done = run("-o", "a.png")
    message = "dh2sim: a drawing as PNG needs the extra 'plot': pip install 'dh2sim[plot]'\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", message)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.svg", "a.tex"]
