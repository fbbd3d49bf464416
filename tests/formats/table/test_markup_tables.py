"""Tables of LaTeX and HTML, and tables on their side, are read as Markdown's are."""

from __future__ import annotations

import math

import numpy as np
import pytest

from dh2sim.robot.row import Convention
from tests.formats.table.samples import STANDARD, complaints, imported, modified, numbers, standard, tool_poses, types

H = math.pi / 2
Q = (0.3, -0.5)
TABULAR = """\
\\caption{Modified Denavit-Hartenberg parameters}
\\begin{tabular}{|c|c|c|c|c|}
\\hline
$i$ & $\\alpha_{i-1}$ & $a_{i-1}$ & $d_i$ & $\\theta_i$ \\\\ \\hline
1 & $0$ & $0$ & $0.333$ & $\\theta_1$ \\\\
2 & $-\\frac{\\pi}{2}$ & $0$ & $0$ & $\\theta_2$ \\\\ \\hline
\\end{tabular}
"""
BOOKTABS = """\
Classic DH parameters of the arm, see \\cref{tab:dh} % a comment & another
\\begin{tabularx}{\\textwidth}{@{}l X c c S[table-format=1.3]@{}}
  \\toprule
  \\multirow{2}{*}{Joint} & \\multicolumn{4}{c}{Parameters} \\\\ \\cmidrule(lr){2-5}
   & {$\\theta_i$ (\\si{\\degree})} & {$d_i$ [\\si{\\milli\\metre}]}
   & \\textbf{$a_i$} (mm) & $\\alpha_i$ [$^\\circ$] \\\\[2pt]
  \\midrule
  1 & $\\theta_1^{*}$ & \\num{100} & \\SI{20}{\\milli\\metre} & \\ang{90} \\\\
  \\rowcolor{gray} 2 & $\\theta_2^* + 90^{\\circ}$ & $-50$ & 0 \\\\ % short
  3 & 0 & $d_3^\\ast$ & $\\tfrac{300}{4}$ & $-37.3^\\circ$ \\tabularnewline
  \\bottomrule
\\end{tabularx}
"""
ARRAY = """\
# My arm

Standard DH:

$$
\\begin{array}{ccccc}
i & \\theta & d\\,(\\mathrm{m}) & a\\,(\\mathrm{m}) & \\alpha \\\\
1 & \\theta_1 & L_1 & 0 & \\frac{\\pi}{2} \\\\
2 & \\theta_2 & 0 & L_2 & 0
\\end{array}
$$

with $L_1 = 0.4$ and $L_2 = 0.3\\,\\mathrm{m}$.
"""
ROWS = """\
% standard DH
i & theta & d (m) & a (m) & alpha \\\\
\\hline
1 & q1 & 0.4 & 0 & pi/2 \\\\
2 & q2 & 0 & 0.3 & 0 \\\\
"""


def test_a_tabular_is_read() -> None:
    found = imported(TABULAR, "arm.tex")
    assert found.spec.convention is Convention.MODIFIED
    expected = modified(Q[0], 0.333, 0, 0) @ modified(Q[1], 0, 0, -H)
    np.testing.assert_allclose(tool_poses(found.spec, [Q])[0], expected, atol=1e-15)


def test_rules_spans_units_and_short_rows_of_a_tabular_are_read() -> None:
    found, q = imported(BOOKTABS, "arm.tex"), (0.3, -0.5, 0.2)
    expected = standard(q[0], 0.1, 0.02, H) @ standard(q[1] + H, -0.05, 0, 0)
    expected = expected @ standard(0, q[2], 0.075, math.radians(-37.3))
    np.testing.assert_allclose(tool_poses(found.spec, [q])[0], expected, atol=1e-15)
    assert types(found.spec) == "rrp"
    assert "row 2 has 4 cells of 5: the others were read as empty" in found.notes


@pytest.mark.parametrize("text", [ARRAY, ROWS, ROWS.replace("\\hline\n", "")])
def test_an_array_in_a_formula_and_rows_without_surroundings_are_read(text: str) -> None:
    expected = [(0, 0.4, 0, H), (0, 0, 0.3, 0)]
    assert numbers(imported(text, "arm.md").spec) == expected


def test_a_cell_across_all_columns_is_no_row() -> None:
    remark = "\\multicolumn{5}{l}{$^\\star$ variable}\n\\end{tabular}"
    found = imported(TABULAR.replace("\\end{tabular}", remark), "arm.tex")
    assert types(found.spec) == "rr"
    assert "line 7 is one cell across all columns, and was not read: '*variable'" in found.notes
    html = "<table><tr><th>theta<th>d (m)<th>a (m)<th>alpha (deg)<tr><td>q1<td>0.4<td>0<td>90"
    html += "<tr><td colspan=4>all angles in degrees</table>"
    assert types(imported(html, "arm.html", **STANDARD).spec) == "r"


def test_a_wrong_cell_of_a_tabular_has_its_place() -> None:
    assert complaints(TABULAR.replace("0.333", "0.3.33"), "arm.tex") == [
        "arm.tex:5:17: row 1, d: '$0.3.33$' cannot be read: in '0.3 .33': unexpected '.33' after '0.3'"
    ]


HTML = """\
<h2>Standard DH parameters</h2>
<table class="x"><caption>Arm</caption>
  <thead><tr><th rowspan="2">Joint</th><th colspan="4">Parameters</th></tr>
  <tr><th>&theta;<sub>i</sub></th><th>d<sub>i</sub> [mm]</th>
  <th>a<sub>i</sub> (mm)</th><th>&alpha;<sub>i</sub> (&deg;)</th></tr></thead>
  <tbody>
    <tr><td>1</td><td>&theta;<sub>1</sub><sup>*</sup></td><td>100</td><td><b>0</b></td><td>90</td></tr>
    <tr><td>2<td>q2 + 90<sup>o</sup><td>0<td>200<br/></tr>
  </tbody>
</table>
<p>d<sub>1</sub> = 7</p>
"""


def test_a_table_of_html_is_read_with_spans_and_without_end_tags() -> None:
    found = imported(HTML, "page.html")
    expected = standard(Q[0], 0.1, 0, H) @ standard(Q[1] + H, 0, 0.2, 0)
    np.testing.assert_allclose(tool_poses(found.spec, [Q])[0], expected, atol=1e-15)
    assert numbers(imported(f"# Arm\n\nText\n\n{HTML}").spec) == numbers(found.spec)


def test_a_wrong_cell_of_html_has_its_place() -> None:
    assert complaints(HTML.replace(">200<", ">two<"), "page.html") == [
        "page.html:8:46: row 2, a: the symbol 'two' has no value; write the number, or give its value in the text "
        "around the table, such as 'two = 0.4 m'"
    ]


WIKI = """\
Standard DH, lengths in mm:

{| class="wikitable" style="text-align: center"
|+ style="caption-side: bottom" | The arm
|-
! rowspan="2" | ''i'' !! colspan=2 | Joint !! colspan=2 | Link<ref name="x">note | d</ref>
|-
! θ<sub>''i''</sub> !! d<sub>''i''</sub> [[Metre|(mm)]] !! a<sub>''i''</sub> [mm] !! <math>\\alpha_i</math> (°)
|- style="background: #eee"
! scope="row" | 1
| <math>\\theta_1^*</math> || 100 || 20 || {{math|90}}
|-
| 2 || θ<sub>2</sub> + 90° || style="color: red" | &minus;50 ||
| '''&minus;37.3'''
|-
| 3
|
0
| d<sub>3</sub>|| 75||0
|}

| not | of the | table |
"""


def test_a_table_of_a_wiki_is_read() -> None:
    found, q = imported(WIKI, "arm.wiki"), (0.3, -0.5, 0.2)
    expected = standard(q[0], 0.1, 0.02, H) @ standard(q[1] + H, -0.05, 0, math.radians(-37.3))
    expected = expected @ standard(0, q[2], 0.075, 0)
    np.testing.assert_allclose(tool_poses(found.spec, [q])[0], expected, atol=1e-15)
    assert types(found.spec) == "rrp"


def test_a_wrong_cell_of_a_wiki_has_its_place() -> None:
    assert complaints(WIKI.replace("100", "one"), "arm.wiki") == [
        "arm.wiki:11:30: row 1, d: the symbol 'one' has no value; write the number, or give its value in the text "
        "around the table, such as 'one = 0.4 m'"
    ]


def test_a_table_of_a_wiki_that_never_ends_is_none() -> None:
    assert "no table of" in complaints(WIKI.replace("|}", "") + "=" * 100_000, "arm.wiki")[0]


SIDE = """\
Standard DH parameters (deg, mm)

| Joint | 1 | 2 | 3 |
|---|---|---|---|
| θ | θ1 | θ2 | θ3 |
| d | 100 | 0 | 0 |
| a | 0 | 200 | 150 |
| α | 90 | 0 | 0 |
"""


def test_a_table_on_its_side_is_turned() -> None:
    q = (0.3, -0.5, 0.7)
    found = imported(SIDE)
    expected = standard(q[0], 0.1, 0, H) @ standard(q[1], 0, 0.2, 0) @ standard(q[2], 0, 0.15, 0)
    np.testing.assert_allclose(tool_poses(found.spec, [q])[0], expected, atol=1e-15)
    assert "every row was read as a parameter, and every column as a joint" in found.notes


@pytest.mark.parametrize(
    "text",
    [
        "Parameter | Unit | Joint 1 | Joint 2\n---|---|---|---\na_{i-1} | mm | 0 | 20\nα_{i-1} | ° | 0 | -90\n"
        "d_i | mm | 100 | 0\nθ_i | ° | θ_1 | θ_2+90\n",
        "| | J1 | J2 |\n|---|---|---|\n| a_{i-1} (mm) | 0 | 20 |\n| α_{i-1} (deg) | 0 | -90 |\n"
        "| d_i (mm) | 100 | 0 |\n| θ_i (deg) | 0 | 90 |\n",
        "\\begin{tabular}{lrr}\n$a_{i-1}$ (mm) & 0 & 20 \\\\\n$\\alpha_{i-1}$ ($^\\circ$) & 0 & $-90$ \\\\\n"
        "$d_i$ (mm) & 100 & 0 \\\\\n$\\theta_i$ & $\\theta_1$ & $\\theta_2 + 90$\\end{tabular}",
        "<table><tr><th>a_{i-1} (mm)<td>0<td>20<tr><th>α_{i-1} (deg)<td>0<td>-90<tr><th>d_i (mm)<td>100<td>0</table>"
        "<table><tr><td>x</table>",
    ],
)
def test_tables_on_their_side_of_any_markup_are_turned(text: str) -> None:
    found = numbers(imported(text).spec)
    assert [(d, a, alpha) for _, d, a, alpha in found] == [(0.1, 0, 0), (0, 0.02, -H)]
    if "θ" in text or "theta" in text:
        assert found[1][0] == H


def test_a_parameter_with_fewer_values_on_a_table_on_its_side_is_noted() -> None:
    found = imported(
        "| θ | θ1 | θ2 |\n|---|---|---|\n| d (m) | 1 |\n| a (m) | 1 | 2 |\n| α | 90° | 0 |\n", **STANDARD
    )
    assert numbers(found.spec) == [(0, 1, 1, H), (0, 0, 2, 0)]
    assert "'d (m)' has fewer values than others: the rest was read as empty" in found.notes


SIMPLE = """\
Standard DH

=====  =========  =====  =====  =====
Joint  theta      d (m)  a (m)  alpha
=====  =========  =====  =====  =====
1      q1         0.4    0      pi/2
2      q2 + pi/2         0.3    0
=====  =========  =====  =====  =====

Text.
"""
LIST = """\
Standard DH

.. list-table:: Parameters
   :header-rows: 1

   * - Joint
     - theta
     - d (m)
     - a (m)
     - alpha
   * - 1
     - q1
     - 0.4
     -
     - pi/2
   * - 2
     - q2 + pi/2
     - 0
     - 0.3

Text - after it.
"""
CSV_TABLE = """\
.. csv-table:: Standard DH
   :header: theta, d (m), a (m), alpha
   :widths: 1, 1, 1, 1

   q1, 0.4, 0, pi/2
   q2 + pi/2, 0, 0.3, 0
"""
GRID = """\
Standard DH

+-------+-----------+-------+-------+-------+
| Joint | theta     | d (m) | a (m) | alpha |
+=======+===========+=======+=======+=======+
| 1     | q1        | 0.4   | 0     | pi/2  |
+-------+-----------+-------+-------+-------+
| 2     | q2 + pi/2 | 0     | 0.3   | 0     |
+-------+-----------+-------+-------+-------+
"""


@pytest.mark.parametrize("text", [SIMPLE, LIST, CSV_TABLE, GRID])
def test_tables_of_restructured_text_are_read(text: str) -> None:
    expected = standard(Q[0], 0.4, 0, H) @ standard(Q[1] + H, 0, 0.3, 0)
    np.testing.assert_allclose(tool_poses(imported(text, "arm.rst").spec, [Q])[0], expected, atol=1e-15)


def test_csv_on_its_side_is_turned() -> None:
    text = "# standard DH\njoint;1;2\ntheta;q1;q2 + pi/2\nd (m);0.4;0\na (m);0;0.3\nalpha;pi/2;0\n"
    expected = standard(Q[0], 0.4, 0, H) @ standard(Q[1] + H, 0, 0.3, 0)
    np.testing.assert_allclose(tool_poses(imported(text, "arm.csv").spec, [Q])[0], expected, atol=1e-15)
