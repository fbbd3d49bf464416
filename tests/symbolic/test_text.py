"""Forms as text for a terminal."""

from __future__ import annotations

import pytest

from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.symbolic.request import symbolic_form
from tests.sample_robots import NAMES, row
from tests.sample_robots import robot as spec_of

PUMA = """\
T_0_6, pose of tool0 in base_link
  [ c1*#2         c1*#5       -c1*#7       c1*#8 - d3*s1   ]
  [ + s1*#3       + s1*#6     - s1*s4*s5                   ]
  [                                                        ]
  [ s1*#2         -c1*#6      c1*s4*s5     d3*c1 + s1*#8   ]
  [ - c1*#3       + s1*#5     - s1*#7                      ]
  [                                                        ]
  [ -s23*#1       c23*s5*s6   s23*c4*s5    -a2*s2 - d4*c23 ]
  [ - c23*s5*c6   + s23*#4    - c23*c5     - a3*s23        ]
  [                                                        ]
  [ 0             0           0            1               ]

with
  #1 = c4*c5*c6 - s4*s6
  #2 = c23*#1 - s23*s5*c6
  #3 = c4*s6 + s4*c5*c6
  #4 = c4*c5*s6 + s4*c6
  #5 = s23*s5*s6 - c23*#4
  #6 = c4*c6 - s4*c5*s6
  #7 = c23*c4*s5 + s23*c5
  #8 = a2*c2 + a3*c23 - d4*s23

c23 = cos(theta_2 + theta_3), s23 = sin(theta_2 + theta_3), a2 = 0.4318 m,
a3 = 0.0203 m, d3 = 0.15005 m, d4 = 0.4318 m"""


def test_the_puma_is_printed_as_craig_prints_it_with_sums_named() -> None:
    assert str(symbolic_form(spec_of("puma560"))) == PUMA


@pytest.mark.parametrize("name", NAMES)
def test_text_fits_a_terminal_of_80_columns(name: str) -> None:
    for what in ("pose", "jacobian"):
        assert max(map(len, str(symbolic_form(spec_of(name), what)).splitlines())) <= 80


@pytest.mark.slow
@pytest.mark.parametrize("style", ["base", "tool", "expanded"])
@pytest.mark.parametrize("name", NAMES)
def test_text_of_any_style_fits_a_terminal_of_80_columns(name: str, style: str) -> None:
    for what in ("pose", "matrices", "jacobian"):
        for names in (True, False):
            text = str(symbolic_form(spec_of(name), what, style=style, names=names))
            assert max(map(len, text.splitlines())) <= 80


def test_the_legend_fits_a_terminal_of_80_columns() -> None:
    text = str(symbolic_form(spec_of("so101"), numbers=True))
    assert max(map(len, text.splitlines())) <= 80
    assert "cos(theta_2 + theta_3 + theta_4 + phi_2 + phi_3 + phi_4)" in " ".join(text.split())


def test_cosines_of_constants_are_not_broken_between_lines() -> None:
    file = """{name: x, convention: standard, units: {angle: deg}, parameters: {elbow: 7},
      base: {rpy: [elbow*3, elbow*2 + 45, elbow + 30]},
      joints: [{type: revolute, a: 1, alpha: elbow*2}, {type: revolute, a: 2, theta: elbow}]}"""
    text = str(symbolic_form(parse_robot(file), style="expanded"))
    matrix = text[: text.index("elbow = 7")]
    assert "cos(2*elbow+45°)" in matrix
    assert all(line.count("(") == line.count(")") for line in matrix.splitlines() if "cos(theta" not in line)


def test_sums_stay_in_place_without_names() -> None:
    text = str(symbolic_form(spec_of("puma560"), names=False))
    assert "r11 = c1*(c23*(c4*c5*c6 - s4*s6) - s23*s5*c6) + s1*(c4*s6 + s4*c5*c6)" in text
    assert "#" not in text


def test_coordinates_are_named_theta_and_d_or_q() -> None:
    assert "c1 = cos(theta_1)" in str(symbolic_form(spec_of("stanford")))
    assert "d3*c2" in str(symbolic_form(spec_of("stanford"), target="dh_3"))
    text = str(symbolic_form(spec_of("stanford"), target="dh_3", joint_names="q"))
    assert "c1 = cos(q1)" in text
    assert "q3*c2" in text


def test_a_slide_whose_row_has_a_parameter_of_its_name_is_called_q() -> None:
    file = "{name: x, convention: standard, parameters: {d1: 2}, joints: [{type: prismatic, d: d1}]}"
    assert "d1 + q1" in str(symbolic_form(parse_robot(file)))


def test_a_parameter_named_like_a_cosine_is_not_taken_for_one() -> None:
    file = "{name: x, convention: standard, parameters: {c1: 2}, joints: [{type: revolute, a: c1}]}"
    assert "c1*c(1)" in str(symbolic_form(parse_robot(file)))


def test_numbers_of_rows_are_kept_apart_where_there_are_ten() -> None:
    rows = tuple(row(f"j{i}", a=0.1) for i in range(12))
    text = str(symbolic_form(RobotSpec(name="snake", rows=rows)))
    assert "0.1*c1_2_3" in text
    assert "0.1*c1..12" in text
    assert "c1..12 = cos(theta_1 + … + theta_12)" in text
    assert max(map(len, text.splitlines())) <= 80


def test_folding_across_opposite_axes_is_for_those_who_ask() -> None:
    assert "c12*c4 + s12*s4" in str(symbolic_form(spec_of("scara")))
    assert "c(1+2-4)" in str(symbolic_form(spec_of("scara"), fold="all"))
    assert "c1*c2 - s1*s2" in str(symbolic_form(spec_of("planar_2r"), fold="none", names=False))


def test_an_odd_offset_or_twist_has_a_name_and_a_value() -> None:
    spec = RobotSpec(name="x", rows=(row("a", a=1.0, alpha=0.6510078109938848, theta=0.3), row("b", a=0.5)))
    text = str(symbolic_form(spec))
    assert "cos(alpha_1)" in text
    assert "alpha_1 = 37.3°" in text
    assert "c(1+phi_1) = cos(theta_1 + phi_1)" in text
    assert "phi_1 = 17.18873385°" in text


def test_lengths_get_letters_on_request_and_parameters_numbers() -> None:
    letters = str(symbolic_form(spec_of("ur5e"), letters=True))
    assert "a2*c2" in letters
    assert "a2 = -0.425 m" in letters
    assert "0.4318*c2" in str(symbolic_form(spec_of("puma560"), numbers=True))
