"""``dh2sim symbolic … --as c``: a robot as code; and what its inverse dynamics cost."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from dh2sim.cli.common import choice, load_one
from dh2sim.cli.output import hand_over, require_free
from dh2sim.codegen.languages import Language
from dh2sim.codegen.program import What

if TYPE_CHECKING:
    from dh2sim.codegen.generate import CodeSummary
    from dh2sim.robot.spec import RobotSpec

LANGUAGES = tuple(Language)


def is_about_code(what: Sequence[str], as_: str) -> bool:
    """Whether options ask for code: for a language, or for what there is code of alone."""
    return as_.lower() in LANGUAGES or len(what) > 1 or what[0].lower() == What.INVERSE_DYNAMICS


def print_code(robot: str, what: Sequence[str], as_: str, out: Path | None, *, force: bool) -> None:
    """Write code, or with ``--as text`` and ``--as json`` what the inverse dynamics cost.

    Args:
        robot: Path or name.
        what: Of ``--what``.
        as_: Of ``--as``.
        out: File to write.
        force: Whether to overwrite it.

    Raises:
        BadParameter: An option has a wrong value.
    """
    from dh2sim.codegen.generate import generate_code, summarize

    wanted = [choice(word, What, "--what") for word in what]
    require_free(out, force=force)
    spec = load_one(robot)
    about = ", ".join(word for word in wanted if word is not None)
    if as_.lower() in LANGUAGES:
        # MATLAB calls a function by the name of its file
        name = out.stem if out is not None and as_.lower() == Language.MATLAB else None
        text = generate_code(spec, as_.lower(), [word for word in wanted if word is not None], name=name)
    elif about != What.INVERSE_DYNAMICS:
        raise typer.BadParameter(f"takes one of {', '.join(Language)} for several functions", param_hint="--as")
    elif as_ == "json":
        text = json.dumps(_as_dict(spec, summarize(spec)), indent=2) + "\n"
    elif as_ == "text":
        text = _as_text(spec, summarize(spec))
    else:
        allowed = f"text, json, {', '.join(Language)}"
        raise typer.BadParameter(f"takes one of {allowed} for inverse-dynamics", param_hint="--as")
    hand_over(text, out, summary=f"{spec.name}: {about} as {as_}", quiet=out is None)


def _as_dict(spec: RobotSpec, summary: CodeSummary) -> dict[str, object]:
    [operations] = summary.operations.values()
    constants = [{"name": name, "value": value, "note": note} for name, value, note in summary.constants]
    return {"robot": spec.name, "operations": asdict(operations), "constants": constants}


def _as_text(spec: RobotSpec, summary: CodeSummary) -> str:
    [operations] = summary.operations.values()
    width = max((len(name) for name, _, _ in summary.constants), default=0)
    constants = [
        "Constants: lengths, gravity, and base inertial parameters, XX2 to MZ2 of what",
        "row 2 moves, with all that may be regrouped from the links after it:",
        "",
        *(f"  {name:{width}}  {value:<23.16g} {note}".rstrip() for name, value, note in summary.constants),
    ]
    lines = [
        f"{spec.name}: inverse dynamics by the recursive Newton-Euler algorithm",
        "",
        f"Each call takes {operations}.",
        *(constants if summary.constants else ()),
        "",
        f"The code: dh2sim symbolic {spec.name} --what inverse-dynamics --as c",
        f"Languages: {', '.join(Language)}",
    ]
    return "\n".join(lines) + "\n"
