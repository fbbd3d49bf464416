"""The one description of what is asked for in symbols, with its defaults."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, TypedDict

from dh2sim.arguments import text
from dh2sim.errors import Dh2simError
from dh2sim.kinematics.chain import serial_spec_of
from dh2sim.messages import member
from dh2sim.robot.spec import SpecLike
from dh2sim.symbolic.expression import Lengths, Style
from dh2sim.symbolic.form import Equation, Form, JointNames
from dh2sim.symbolic.kinematics import FormNotation, jacobian_form, matrices_form, pose_form
from dh2sim.symbolic.reading import symbolic_table
from dh2sim.symbolic.table import Fold
from dh2sim.symbolic.text import form_text

if TYPE_CHECKING:
    from dh2sim.symbolic.dynamics import Bodies


class What(StrEnum):
    """What can be had in symbols."""

    POSE = "pose"
    MATRICES = "matrices"
    JACOBIAN = "jacobian"
    DYNAMICS = "dynamics"


class SymbolicKeywords(TypedDict, total=False):
    """Options of ``symbolic_form``, all of which have defaults."""

    source: str
    target: str
    style: Style | str
    lengths: Lengths | str | None
    names: bool
    numbers: bool
    letters: bool
    fold: Fold | str
    joint_names: JointNames | str


@dataclass(frozen=True, eq=False)
class SymbolicForm:
    """Kinematics or dynamics of a robot in symbols, compared with numbers; ``str`` gives it as text."""

    form: Form

    def __repr__(self) -> str:
        name, what = self.form.table.spec.name, self.form.what
        return f"<SymbolicForm of '{name}': {what}; print it, or .latex(), .markdown(), .data()>"

    @property
    def equations(self) -> tuple[Equation, ...]:
        """The matrices, in nested expressions."""
        return self.form.equations

    def __str__(self) -> str:
        """Return the form as text, at most 80 characters wide where that is possible."""
        return form_text(self.form)

    def latex(self) -> str:
        """Return a LaTeX document that compiles as it stands; wide matrices are listed entry by entry."""
        from dh2sim.symbolic.latex import latex_document

        return latex_document(self.form, self._title)

    def markdown(self) -> str:
        """Return Markdown with formulas."""
        from dh2sim.symbolic.latex import markdown

        return markdown(self.form, self._title)

    def data(self) -> dict[str, Any]:
        """Return the form as data ready for JSON, as ``docs/symbolic.md`` describes it."""
        from dh2sim.symbolic.data import form_data

        return form_data(self.form)

    def _repr_latex_(self) -> str:
        from dh2sim.symbolic.latex import latex_fragment

        return latex_fragment(self.form)

    @property
    def _title(self) -> str:
        return f"{self.form.table.spec.name}: {self.form.what}"


def symbolic_form(
    robot: SpecLike,
    what: What | str = "pose",
    *,
    source: str = "base_link",
    target: str = "tool0",
    style: Style | str = "base",
    lengths: Lengths | str | None = None,
    names: bool = True,
    numbers: bool = False,
    letters: bool = False,
    fold: Fold | str = "parallel",
    joint_names: JointNames | str = "theta",
) -> SymbolicForm:
    """Return the kinematics of a robot in symbols, compared with its table at random configurations.

    Args:
        robot: The robot in any form; for dynamics in numbers, with what links weigh: a ``Robot`` or a ``RobotModel``.
        what: 'pose': a frame in another one; 'matrices': the transform of every row and every DH frame in frame 0;
            'jacobian': the geometric Jacobian, and its determinant in factors; 'dynamics': mass matrix, Coriolis
            matrix and gravity vector of up to four joints.
        source: Frame that a pose is given in.
        target: Frame whose pose it is.
        style: 'base': nested from the base, as textbooks print it; 'tool': nested from the tool, as computer
            algebra does; 'expanded': sums of products.
        lengths: 'first' (outside) or 'last' (inside); by default first with style 'tool', else last.
        names: Whether sums that recur are named #1, #2, …
        numbers: Whether parameters of the robot file are numbers instead of letters.
        letters: Whether lengths that are plain numbers get letters too: a1, d1, …; in dynamics, m_i, lc_i and I_i
            stand for what links weigh, which are numbers otherwise, and so are lengths.
        fold: Across which axes angles are added up: 'parallel', 'all' (antiparallel ones too) or 'none'.
        joint_names: 'theta', with d_i for slides, or 'q'.

    Returns:
        The form; ``str`` gives it as text.

    Raises:
        UnknownFrameError: There is no such frame.
        ModelError: The robot has branches or closures.
        MismatchError: The form differs from the table by more than 1e-13 of the reach.
        Dh2simError: An argument has a value that is not allowed.
    """
    wanted = member(What, what, "form")
    text("source", source)
    text("target", target)
    if wanted is What.DYNAMICS:
        numbers = not letters
        bodies: Bodies | None = getattr(getattr(robot, "model", robot), "bodies", None) if numbers else None
        if numbers and bodies is None:
            raise Dh2simError("dynamics in numbers needs a Robot or a RobotModel; pass letters=True for letters")
    table = symbolic_table(serial_spec_of(robot), letters=letters, numbers=numbers)
    notation = FormNotation(
        style=member(Style, style, "style"),
        lengths=None if lengths is None else member(Lengths, lengths, "lengths"),
        names=names,
        fold=member(Fold, fold, "fold"),
        joint_names=member(JointNames, joint_names, "joint_names"),
    )
    match wanted:
        case What.DYNAMICS:
            from dh2sim.symbolic.motion_form import dynamics_form

            form = dynamics_form(table, bodies, names=names, joint_names=notation.joint_names)
        case What.POSE:
            form = pose_form(table, source, target, notation)
        case What.JACOBIAN:
            form = jacobian_form(table, source, target, notation)
        case What.MATRICES:
            form = matrices_form(table, notation)
    return SymbolicForm(form)
