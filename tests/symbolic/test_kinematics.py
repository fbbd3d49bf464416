"""Poses in symbols: equal to the table at random configurations, whatever the table."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.errors import Dh2simError, MismatchError, UnknownFrameError
from dh2sim.kinematics.chain import build_chain
from dh2sim.kinematics.forward import frame_pose
from dh2sim.robot.links import BaseSpec, Pose, ToolSpec
from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.symbolic.check import SampledConfigurations, check_form
from dh2sim.symbolic.expression import Factor, Lengths, Style, Sum, Term, evaluated, operation_count
from dh2sim.symbolic.form import Equation, Form
from dh2sim.symbolic.reading import symbolic_table
from dh2sim.symbolic.request import symbolic_form
from dh2sim.symbolic.table import Fold
from tests.sample_robots import NAMES, row
from tests.sample_robots import robot as spec_of
from tests.strategies import robot_specs


@given(
    robot_specs(max_rows=4),
    st.sampled_from(Style),
    st.none() | st.sampled_from(Lengths),
    st.sampled_from(Fold),
    st.booleans(),
    st.booleans(),
)
def test_pose_equals_the_table_for_any_rows_in_any_style(
    spec: RobotSpec, style: Style, lengths: Lengths | None, fold: Fold, names: bool, letters: bool
) -> None:
    form = symbolic_form(spec, style=style, lengths=lengths, fold=fold, names=names, letters=letters)
    table, (pose,) = form.form.table, form.equations
    configurations = SampledConfigurations(table, seed=1)
    assert str(form)
    expected = frame_pose(build_chain(spec), "tool0", configurations.q)
    assert check_form(form.form, {pose.name: expected}, configurations) <= 1e-13


@pytest.mark.parametrize("name", NAMES)
def test_every_frame_of_every_robot_can_be_had_in_every_other(name: str) -> None:
    spec = spec_of(name)
    n = len(spec.rows)
    for source, target in [("dh_1", "dh_3"), ("tool0", "base_link"), (f"dh_{n}", "dh_0"), ("link_2", "tool0")]:
        if target not in form_frames(spec):
            continue
        form = symbolic_form(spec, source=source, target=target)
        configurations = SampledConfigurations(form.form.table, seed=2)
        chain = build_chain(spec)
        T = np.linalg.inv(frame_pose(chain, source, configurations.q)) @ frame_pose(chain, target, configurations.q)
        assert check_form(form.form, {form.equations[0].name: T}, configurations) <= 1e-13


def form_frames(spec: RobotSpec) -> set[str]:
    return set(symbolic_table(spec).frames)


def test_a_form_that_differs_from_the_table_is_not_shown() -> None:
    form = symbolic_form(spec_of("planar_2r"))
    (pose,) = form.equations
    wrong = ((Sum((Term(1),)), *pose.entries[0][1:]), *pose.entries[1:])
    bad = Form(
        what="pose",
        table=form.form.table,
        equations=(Equation(name=pose.name, entries=wrong, entry_names=pose.entry_names),),
    )
    configurations = SampledConfigurations(form.form.table)
    with pytest.raises(MismatchError, match="planar_2r: T_0_2 in symbols differs from the table by"):
        check_form(bad, {pose.name: configurations.pose("base_link", "tool0")}, configurations)


def test_a_frame_that_does_not_exist_is_an_error_that_names_the_frames() -> None:
    with pytest.raises(
        UnknownFrameError, match=r"scara: unknown frame 'dh_9'\..*Frames: base_link, dh_0 … dh_4, link_1 … link_4"
    ):
        symbolic_form(spec_of("scara"), target="dh_9")


def test_an_arm_that_nobody_could_read_is_refused() -> None:
    rows = tuple(row(f"j{i}", a=0.1 * i, d=0.2, alpha=0.3 + 0.1 * i) for i in range(1, 13))
    with pytest.raises(Dh2simError, match="has more than 20000 terms when it is written out; ask for a shorter part"):
        symbolic_form(RobotSpec(name="long", rows=rows))


PARAMETERS = """
name: arm
convention: standard
units: {angle: deg, length: mm}
parameters: {l1: 400, l2: 2 * l1, tilt: 37.5, right: 90, odd: sqrt(l1**2 + 30**2)}
joints:
  - {type: revolute, d: l1 / 2 + 10, alpha: right}
  - {type: revolute, a: l2, alpha: -tilt, theta: 30 + tilt}
  - {type: prismatic, d: -(1.5 + l1), a: 0.1, alpha: 3 * tilt, flip: true}
  - {type: revolute, a: odd, d: sqrt(l1 * l2), alpha: 75}
"""


def test_parameters_stay_letters_and_expressions_over_them_stay_exact() -> None:
    form = symbolic_form(parse_robot(PARAMETERS), "matrices")
    lines = [" ".join(line.split()) for line in str(form).splitlines()]
    assert "[ c1 0 s1 0 ]" in lines
    assert "[ 0 1 0 0.5*l1 + 10 ]" in lines
    assert any("l1 = 400 mm" in line for line in lines)
    assert any("tilt = 37.5°" in line for line in lines)
    assert "d4 = sqrt(l1 * l2) = 565.685424949 mm" in " ".join(lines)
    assert "odd = sqrt(l1**2 + 30**2)" in " ".join(lines)


@pytest.mark.parametrize("numbers", [False, True])
def test_parameters_of_any_kind_are_evaluated_as_the_table_has_them(numbers: bool) -> None:
    spec = parse_robot(PARAMETERS)
    for what in ("pose", "matrices"):
        form = symbolic_form(spec, what, numbers=numbers)
        assert ("l1" in form.form.table.letters) is not numbers


def test_a_spec_changed_after_it_was_read_is_what_counts() -> None:
    spec = spec_of("puma560")
    changed = replace(spec, rows=(*spec.rows[:2], replace(spec.rows[2], a=0.5), *spec.rows[3:]))
    assert "0.5*c2" in str(symbolic_form(changed))


def test_right_angles_and_multiples_of_15_degrees_are_exact() -> None:
    spec = RobotSpec(name="x", rows=(row("a", alpha=math.pi / 12), row("b", alpha=math.pi / 4), row("c")))
    text = str(symbolic_form(spec, "matrices"))
    assert "0.25*sqrt(2)*sqrt(3)" in text
    assert "0.5*sqrt(2)" in text


@pytest.mark.parametrize("style", ["base", "tool"])
def test_a_turned_base_or_tool_costs_no_more_than_its_own_three_rotations(style: str) -> None:
    def operations(spec: RobotSpec) -> tuple[int, int]:
        form = symbolic_form(spec, style=style, lengths="last").form
        return operation_count([*form.sums, *form.named.values()])

    puma = spec_of("puma560")
    plain = operations(puma)
    turn = Pose(rpy=np.array([0.1, 0.2, 0.37]))
    turned = replace(puma, base=BaseSpec(pose=turn)) if style == "base" else replace(puma, tool=ToolSpec.at(turn))
    found = operations(turned)
    assert found[0] <= plain[0] + 3 * 4 * 4
    assert found[1] <= plain[1] + 3 * 4 * 2


def test_numbers_go_outside_as_letters_do_where_lengths_are_first() -> None:
    """And odd twists stay inside, or nothing would be left to nest."""
    rows = tuple(row(f"j{i}", a=0.1 * i, alpha=0.3 * i, d=0.07 * i) for i in range(1, 5))
    spec = RobotSpec(name="odd_4r", rows=rows)

    def operations(style: str, *, letters: bool) -> tuple[int, int]:
        form = symbolic_form(spec, style=style, letters=letters).form
        return operation_count([*form.sums, *form.named.values()])

    numbers, letters = operations("tool", letters=False), operations("tool", letters=True)
    assert numbers[0] <= 1.3 * letters[0]
    assert letters <= operations("base", letters=True)


def test_evaluation_uses_names() -> None:
    named = {"#1": Sum((Term(2, (Factor("x"),)),))}
    assert evaluated([Sum((Term(3, (Factor("#1", 2),)),))], named, {"x": 5.0}) == [300.0]


def test_a_table_in_symbols_knows_its_moving_rows() -> None:
    table = symbolic_table(spec_of("scara"))
    assert table.moving == (1, 2, 3, 4)
