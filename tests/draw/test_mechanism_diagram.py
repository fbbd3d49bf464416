"""Drawings of mechanisms: joints where the tables have them, closures with their names, in all styles and formats."""

from __future__ import annotations

import dataclasses
import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from dh2sim import Robot
from dh2sim.draw.diagram.drawing import draw_robot
from dh2sim.draw.diagram.kinematic import DRIVEN, OPEN
from dh2sim.draw.diagram.linkage import place_mechanism, plane_view
from dh2sim.draw.diagram.sheet import text_box
from dh2sim.errors import ConfigurationError
from dh2sim.kinematics.loop_motion import mechanism_configuration
from dh2sim.kinematics.table_oracle import table_mechanism_frames
from dh2sim.robot.catalog import builtin_mechanisms
from dh2sim.robot.read import parse_robot
from tests.program import dh2sim

PLANAR = {"four_bar", "parallel_four_bar", "stretched_four_bar", "slider_crank", "five_bar"}
LENGTHS = {
    "four_bar": ["crank", "coupler", "rocker"],
    "parallel_four_bar": 3 * ["crank"] + ["span"],
    "stretched_four_bar": ["crank", "coupler", "rocker"],
    "slider_crank": ["crank", "rod"],
    "five_bar": 2 * ["crank", "rod"],
    "bennett": 2 * ["long", "short"],
    "sarrus": 4 * ["leg"] + ["side"],
}
"""Parameters that are lengths in the tables."""
COSTLY = [name if name == "four_bar" else pytest.param(name, marks=pytest.mark.slow) for name in builtin_mechanisms()]


def middles(name: str, fill: str) -> list[list[float]]:
    """Return where circles of a colour are in a diagram whose axes point at the reader, pt."""
    strokes = draw_robot(Robot.load(name)).sheet.strokes
    return [stroke.points[:48].mean(axis=0).tolist() for stroke in strokes if stroke.fill == fill]


def test_the_pins_of_a_four_bar_have_the_distances_of_its_table() -> None:
    driven, passive = middles("four_bar", DRIVEN), middles("four_bar", "#ffffff")
    A = np.array(driven[-1])
    B, D, C = (np.array(passive[k]) for k in (1, 3, 5))  # two outlines each, the closure last
    scale = 2.0 / float(np.linalg.norm(D - A))
    lengths = [scale * float(np.linalg.norm(b - a)) for a, b in ((A, B), (B, C), (C, D))]
    assert np.allclose(lengths, [0.6, 1.8, 1.4], rtol=0, atol=1e-9)
    assert D[1] == pytest.approx(A[1]), "the ground is level"
    assert min(B[1], C[1]) > A[1]


@pytest.mark.parametrize("name", COSTLY)
def test_every_joint_and_closure_is_named_once_and_labels_are_apart(name: str) -> None:
    spec = Robot.load(name).spec
    if not spec.is_mechanism:
        pytest.skip("a serial robot")
    texts = draw_robot(spec).sheet.texts
    rows = spec.moving_rows
    expected = [f"{'θ' if row.type.turns else 'd'}_{k}" for k, row in enumerate(rows, start=1)]
    expected += [closure.name for closure in spec.closures]
    expected += LENGTHS.get(name, ())
    assert sorted(text.text for text in texts) == sorted([*expected, "tool0"])
    boxes = [(text.centre, 0.5 * np.array(text_box(text.text, text.size))) for text in texts]
    for (a, half), (b, other) in itertools.combinations(boxes, 2):
        assert (np.abs(a - b) >= half + other).any()
    for style in ("frames", "stick"):
        assert "nan" not in draw_robot(spec, style=style).svg


@pytest.mark.parametrize("name", [*sorted(PLANAR), "bennett", "spherical_four_bar", "sarrus"])
def test_what_moves_in_a_plane_is_seen_across_it(name: str) -> None:
    spec = Robot.load(name).spec
    view = plane_view(place_mechanism(spec, "home"))
    assert (view is not None) == (name in PLANAR)
    if view is not None:
        assert (view.right.tolist(), view.up.tolist()) == ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])


def test_joints_are_where_the_table_has_them_and_the_driven_ones_are_known() -> None:
    robot = Robot.load("delta")
    arm = place_mechanism(robot.spec, [0.3, 0.4, 0.5])
    moving = [joint for joint in arm.joints if joint.type.moves]
    assert [joint.index for joint in moving] == list(range(1, 22))
    assert [joint.index for joint in moving if joint.driven] == [1, 8, 15]
    q = mechanism_configuration(robot.spec, [0.3, 0.4, 0.5])
    table = table_mechanism_frames(robot.spec, q)
    assert arm.names[0] == "dh_0"
    for name, T in zip(arm.names, arm.frames, strict=True):
        assert np.allclose(T, table[name], rtol=0, atol=1e-12)


def test_frames_of_all_branches_are_named_where_they_are() -> None:
    texts = {text.text for text in draw_robot(Robot.load("four_bar"), style="frames").sheet.texts}
    assert texts == {"dh_0", "dh_1", "dh_2, rocker/dh_1", "rocker/dh_0"}


def test_lengths_without_a_name_are_those_of_the_joint_vector() -> None:
    text = Path("robots/mechanisms/four_bar.yaml").read_text(encoding="utf-8")
    text = text.replace("a: crank", "a: 600").replace("a: coupler", "a: -coupler").replace("length: m", "length: mm")
    text = text.replace("{ground: 2, crank: 0.6, coupler: 1.8, rocker: 1.4}", "{ground: 2000, coupler: -1800}")
    spec = parse_robot(text.replace("a: rocker", "a: 0.7 * ground"))
    texts = {text.text for text in draw_robot(spec).sheet.texts}
    assert texts == {"θ_1", "θ_2", "θ_3", "C", "tool0", "a_1", "coupler", "a_3"}
    longer = dataclasses.replace(spec, parameters={"ground": 2000.0, "coupler": -1700.0})
    assert "a_2" in {text.text for text in draw_robot(longer).sheet.texts}, "the file says it no longer"


def test_an_open_loop_is_drawn_open_and_the_command_says_so(tmp_path: Path) -> None:
    q = [math.radians(x) for x in (70, -50, 120)]
    assert OPEN in {stroke.color for stroke in draw_robot(Robot.load("four_bar"), q).sheet.strokes}
    assert OPEN not in {stroke.color for stroke in draw_robot(Robot.load("four_bar")).sheet.strokes}
    out = tmp_path / "open.svg"
    done = dh2sim("draw", "four_bar", "70", "-50", "120", "-o", out)
    assert (done.status, done.out) == (0, f"{out}: four_bar, kinematic, 70 deg, -50 deg, 120 deg\n")
    assert done.err.startswith("dh2sim: warning: the loops are not closed at these coordinates: C stays open by ")
    assert out.read_text(encoding="utf-8") == draw_robot(Robot.load("four_bar"), q).svg


def test_a_driven_joint_moves_the_passive_ones() -> None:
    four_bar = Robot.load("four_bar")
    assert four_bar.draw([2.0]).svg != four_bar.draw().svg
    with pytest.raises(ConfigurationError, match="four_bar has no configuration 'hom'"):
        four_bar.draw("hom")


def test_a_closure_may_have_a_name_with_underscores(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="the extra 'plot' is not installed")
    spec = Robot.load("four_bar").spec
    [closure] = spec.closures
    drawing = draw_robot(dataclasses.replace(spec, closures=(dataclasses.replace(closure, name="C_a_b"),)))
    assert r"{$C_{a\_b}$}" in drawing.tikz
    drawing.save(tmp_path / "a.png")
