"""Forms as LaTeX and Markdown."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from dh2sim.robot.read import parse_robot
from dh2sim.robot.spec import RobotSpec
from dh2sim.symbolic.latex import latex_name
from dh2sim.symbolic.request import symbolic_form
from tests.sample_robots import NAMES, row
from tests.sample_robots import robot as spec_of

PDFLATEX = shutil.which("pdflatex")

AWKWARD = parse_robot(
    """
name: odd-_arm
convention: modified
parameters: {long_name_2: 0.3, alpha: 0.2, _: 0.1, e1e: 0.4, c1: 0.5}
joints:
  - {name: a_b, type: revolute, a: long_name_2, alpha: alpha, theta: 0.1}
  - {type: prismatic, d: _ / 3, a: e1e, alpha: 0.5235987755982988}
  - {type: revolute, a: c1, alpha: -alpha, theta: 2 * alpha}
"""
)


def compiled(text: str, folder: Path) -> str:
    """Compile a document and return TeX's log."""
    assert PDFLATEX is not None
    (folder / "form.tex").write_text(text, encoding="utf-8")
    done = subprocess.run(
        [PDFLATEX, "-interaction=nonstopmode", "-halt-on-error", "form.tex"],
        cwd=folder,
        capture_output=True,
        check=False,
        timeout=300,
    )
    log = (folder / "form.log").read_text(encoding="latin-1")
    assert done.returncode == 0, log[-2000:]
    return log


def one_document(specs: list[RobotSpec], what: str) -> str:
    """Put the bodies of several documents into one: TeX takes longer to start than to set them."""
    letters = what == "dynamics"
    texts = [symbolic_form(spec, what, letters=letters).latex() for spec in specs]
    head = texts[0].split(r"\begin{document}")[0]
    bodies = [text.split(r"\begin{document}")[1].split(r"\end{document}")[0] for text in texts]
    return "\n".join([head, r"\begin{document}", *bodies, r"\end{document}"])


@pytest.mark.slow
@pytest.mark.skipif(PDFLATEX is None, reason="pdflatex is not installed")
@pytest.mark.parametrize("what", ["pose", "matrices", "jacobian"])
def test_latex_compiles_as_it_stands_and_fits_the_page(what: str, tmp_path: Path) -> None:
    log = compiled(one_document([*map(spec_of, NAMES), AWKWARD], what), tmp_path)
    assert "Overfull" not in log


@pytest.mark.slow
@pytest.mark.skipif(PDFLATEX is None, reason="pdflatex is not installed")
def test_equations_of_motion_and_long_chains_compile(tmp_path: Path) -> None:
    arms = [spec_of(name) for name in ("planar_2r", "rpr", "cylindrical", "spherical_wrist", "scara")]
    snake = RobotSpec(name="snake", rows=tuple(row(f"j{i}", a=0.1) for i in range(12)))
    text = one_document(arms, "dynamics").replace(r"\end{document}", "")
    body = symbolic_form(snake).latex().split(r"\begin{document}")[1]
    assert "Overfull" not in compiled(text + body, tmp_path)


@pytest.mark.slow
@pytest.mark.skipif(PDFLATEX is None, reason="pdflatex is not installed")
@pytest.mark.parametrize("style", ["tool", "expanded"])
def test_wide_matrices_are_broken_so_that_they_fit_the_page(style: str, tmp_path: Path) -> None:
    text = symbolic_form(spec_of("kinova_gen3"), style=style, names=style == "tool").latex()
    assert "Overfull" not in compiled(text, tmp_path)


@pytest.mark.parametrize(
    ("name", "latex"),
    [
        ("a2", "a_{2}"),
        ("L2", "L_{2}"),
        ("alpha_2", r"\alpha_{2}"),
        ("bend2", r"\mathrm{bend}_{2}"),
        ("lc2", "l_{c2}"),
        ("Ixx12", "I_{xx12}"),
        ("base_x", r"\mathrm{base}_{\mathrm{x}}"),
        ("long_name_2", r"\mathrm{long}_{\mathrm{name\_2}}"),
        ("_", r"\mathrm{\_}"),
    ],
)
def test_a_letter_has_its_number_as_an_index(name: str, latex: str) -> None:
    assert latex_name(name) == latex


def test_a_matrix_that_fits_is_a_matrix_and_one_that_does_not_is_a_list() -> None:
    assert r"{}^{0}T_{2} &= \begin{bmatrix}" in symbolic_form(spec_of("planar_2r")).latex()
    assert r"r_{11} &= " in symbolic_form(spec_of("puma560"), names=False).latex()


def test_the_determinant_and_its_zeros_are_there() -> None:
    text = symbolic_form(spec_of("puma560"), "jacobian").latex()
    assert (
        r"\det J &= -a_{2}\,s_{5}\,(a_{3}\,s_{3} + d_{4}\,c_{3})\,(a_{2}\,c_{2} + a_{3}\,c_{23} - d_{4}\,s_{23})"
        in text
    )
    assert r"\text{(wrist)} \quad \theta_{5} = 0^\circ\text{ or }180^\circ" in text


def test_markdown_has_formulas_between_dollar_signs() -> None:
    text = symbolic_form(spec_of("planar_2r")).markdown()
    assert text.startswith("## planar_2r: pose\n")
    assert text.count("$$") == 4
    assert r"a_{1}\,c_{1} + a_{2}\,c_{12}" in text


def test_a_notebook_shows_formulas() -> None:
    assert symbolic_form(spec_of("planar_2r"))._repr_latex_().startswith("$$\\begin{aligned}")


def test_no_two_things_are_written_alike() -> None:
    file = """{name: x, convention: standard, parameters: {theta_1: 2, a_2: 3, a2: 4, d_2: 5, c_3: 6},
      joints: [{type: revolute, a: theta_1, d: a2}, {type: prismatic, a: a_2, alpha: 1.5707963267948966, d: d_2},
      {type: revolute, a: c_3}]}"""
    text = symbolic_form(parse_robot(file), fold="none").latex()
    legend = text[text.rindex(r"\begin{align*}") :]
    names = [line.split(" &=")[0] for line in legend.splitlines() if " &= " in line]
    assert len(names) == len(set(names))
    assert r"\theta_{1} &= 2\,\mathrm{m}" in legend
    assert r"\cos(q_{1})" in text
    assert r"\mathrm{a2} &= 4\,\mathrm{m}" in legend
    assert "d_{2} + q_{2}" in text
    assert r"\cos(\theta_{3})" in text


def test_a_wide_factor_of_a_determinant_is_broken_behind_the_zero() -> None:
    text = symbolic_form(spec_of("franka_panda"), "jacobian", source="dh_0", target="dh_6").latex()
    conditions = text[text.index("Singular where") :]
    conditions = conditions[: conditions.index("with")]
    assert "0 &= 0.004764375" in conditions
    assert r"\qquad" in conditions


def test_long_lists_of_equations_are_aligned_in_parts() -> None:
    rows = tuple(row(f"j{i}", a=0.1 * i, d=0.2, alpha=0.3 + 0.1 * i) for i in range(1, 6))
    text = symbolic_form(RobotSpec(name="general", rows=rows), style="expanded").latex()
    blocks = text.split(r"\begin{align*}")[1:]
    assert len(blocks) > 2
    assert all(block.count("\n") <= 62 for block in blocks)
