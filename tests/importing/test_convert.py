"""A table in the other convention, as a robot file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from dh2sim.errors import Dh2simError, MismatchError
from dh2sim.importing import convert as converted
from dh2sim.importing.convert import convert_robot
from dh2sim.kinematics.compaction import compact_rows
from dh2sim.kinematics.table_oracle import table_tool_pose
from dh2sim.model.build import build_model
from dh2sim.robot.catalog import builtin_robots
from dh2sim.robot.read import load_robot, parse_robot
from dh2sim.robot.row import Convention
from dh2sim.robot.spec import RobotSpec
from dh2sim.robot.units import AngleUnit, LengthUnit
from dh2sim.robot.write import robot_file_text
from tests.kinematics.perturbed_arms import KINDS, perturbed, textbook_table
from tests.kinematics.test_compaction import UR5, calibrated_ur5
from tests.strategies import robot_specs

OTHER = {Convention.STANDARD: Convention.MODIFIED, Convention.MODIFIED: Convention.STANDARD}


@pytest.mark.parametrize("name", builtin_robots())
def test_a_robot_converted_there_and_back_has_the_same_table(name: str) -> None:
    spec = load_robot(name)
    there = convert_robot(spec, OTHER[spec.convention])
    assert {row.convention for row in there.spec.rows} == {OTHER[spec.convention]}
    back = convert_robot(there.spec, spec.convention)
    assert [(r.a, r.alpha, r.d, r.theta) for r in back.spec.rows] == [(r.a, r.alpha, r.d, r.theta) for r in spec.rows]
    assert back.spec.source == spec.source
    assert list(back.spec.configurations) == list(spec.configurations)


@settings(max_examples=min(40, settings().max_examples))
@given(spec=robot_specs(max_rows=8))
def test_what_is_written_is_the_same_arm(spec: RobotSpec) -> None:
    q = np.random.default_rng(1).uniform(-2, 2, (50, len(spec.moving_rows)))
    for to in OTHER:
        made = convert_robot(spec, to)
        error = np.abs(table_tool_pose(made.spec, q) - table_tool_pose(spec, q)).max()
        assert error < 1e-13 * max(1.0, np.abs(table_tool_pose(spec, q)).max())


def test_the_summary_says_how_well_it_was_checked() -> None:
    made = convert_robot(load_robot("stanford"), Convention.MODIFIED)
    assert made.summary == (
        f"stanford, 6 rows, modified; tool0 off by at most {made.position_error:.1e} m and "
        f"{made.rotation_error:.1e} rad at 1000 configurations"
    )
    assert made.notes == ("Parameters are replaced by their values.",)


def test_a_conversion_that_moves_the_tool_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:

    def wrong(spec: RobotSpec, **options: Any) -> str:
        return robot_file_text(spec, **options).replace("d:  0.4", "d:  0.5")

    monkeypatch.setattr(converted, "robot_file_text", wrong)
    with pytest.raises(MismatchError) as caught:
        convert_robot(load_robot("stanford"), Convention.MODIFIED)
    assert str(caught.value).startswith("stanford: tool0 of the converted table is off by 1.0e-01 m and ")


def test_a_compact_table_is_checked_in_exact_arithmetic() -> None:
    spec = calibrated_ur5()
    made = convert_robot(spec, "compact")
    assert made.configurations == 100
    assert made.position_error < 1e-15
    assert made.rotation_error < 1e-15
    assert [row.convention.value for row in made.spec.rows].count("hayati") == 2
    assert made.notes == compact_rows(spec).notes
    # in doubles the far rows of the original cost three digits
    q = np.random.default_rng(0).uniform(-3, 3, (100, 6))
    assert np.abs(table_tool_pose(made.spec, q) - table_tool_pose(spec, q)).max() < 1e-11


def test_a_compact_table_that_moves_the_tool_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:

    def wrong(spec: RobotSpec, **options: Any) -> str:
        return robot_file_text(spec, **options).replace("a: -0.42522725704007", "a: -0.42522725704")

    monkeypatch.setattr(converted, "robot_file_text", wrong)
    monkeypatch.setattr(converted, "TOLERANCE", 1e-14)
    with pytest.raises(MismatchError, match=r"tool0 of the converted table is off by \d\.\de-14 m"):
        convert_robot(calibrated_ur5(), "compact")


def test_a_table_that_is_compact_already_is_written_as_it_is() -> None:
    spec = load_robot("scara")
    made = convert_robot(spec, "compact")
    assert [(r.a, r.alpha, r.d, r.theta) for r in made.spec.rows] == [(r.a, r.alpha, r.d, r.theta) for r in spec.rows]
    assert made.notes[0] == "Every frame is within reach of the arm already: no row was changed."
    assert made.position_error == 0.0


def test_the_units_of_the_file_are_kept() -> None:
    text = robot_file_text(calibrated_ur5(), angle=AngleUnit.RAD, length=LengthUnit.MM)
    made = convert_robot(parse_robot(text), "compact")
    assert "units: {angle: rad, length: mm}" in made.text.splitlines()
    assert made.position_error < 1e-15


def test_hayati_is_no_form_of_a_whole_table() -> None:
    with pytest.raises(Dh2simError, match="can be converted to standard, modified or compact, not to hayati"):
        convert_robot(load_robot("scara"), Convention.HAYATI)


def _tables(text: str) -> list[list[list[str]]]:
    """The Markdown tables of a text, without their heads."""
    tables: list[list[list[str]]] = [[]]
    for line in text.splitlines():
        if not line.startswith("|"):
            tables.append([])
        elif not line.startswith("|-"):
            tables[-1].append([cell.strip() for cell in line.strip("|").split("|")])
    return [table for table in tables if table]


def test_the_compact_table_on_the_page_is_that_of_the_one_above_it() -> None:
    page = (Path(__file__).parents[2] / "docs" / "importing.md").read_text(encoding="utf-8")
    section = page.partition("## A compact table")[2].partition("## Axes")[0]
    given, compact = _tables(section)
    assert [tuple(map(float, row[1:])) for row in given[1:]] == list(UR5)
    rows = compact_rows(calibrated_ur5()).spec.rows
    assert [row[1] for row in compact[1:]] == [row.convention.value for row in rows]
    shown = [[float(cell or 0) for cell in row[2:]] for row in compact[1:]]
    assert shown == [[row.theta, row.a, row.d, row.alpha, row.beta] for row in rows]


@pytest.mark.parametrize("kind", KINDS)
def test_a_compact_table_has_the_bodies_and_the_reach_of_the_far_one(kind: str) -> None:
    far = textbook_table(*perturbed(kind, 1e-3, 0))
    models = [build_model(spec) for spec in (far, convert_robot(far, "compact").spec)]
    assert models[1].reach == pytest.approx(models[0].reach, rel=1e-10)
    assert models[1].mass == pytest.approx(models[0].mass, rel=1e-10)
    # and is as long and as heavy as the arm with exactly parallel axes
    exact = build_model(textbook_table(*perturbed(kind, 0.0, 0)))
    assert models[1].reach == pytest.approx(exact.reach, rel=0.02)
    assert models[1].mass == pytest.approx(exact.mass, rel=0.2)
