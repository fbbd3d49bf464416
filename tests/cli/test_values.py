"""Values of options are converted as typer does, without what typer imports for it."""

from __future__ import annotations

import io
from contextlib import redirect_stderr
from pathlib import Path
from typing import Annotated

import pytest
import typer
from typer.core import TyperCommand

from dh2sim.cli.values import PlainValues
from tests.program import shell

WITHOUT_PYDANTIC = """
$PYTHON -c '
import sys
from dh2sim.cli.main import main
try:
    main()
except SystemExit as end:
    print(end.code, "pydantic" in sys.modules, file=sys.stderr)
' {arguments} > out.txt
"""


class OwnValues(PlainValues, TyperCommand):
    """A command whose values are converted as ours are, and whose errors typer reports."""


def outcome(kind: type[TyperCommand], words: list[str]) -> object:
    seen: list[object] = []

    def command(
        names: Annotated[list[str], typer.Argument()],
        count: Annotated[int | None, typer.Option("--count", min=1, max=9)] = None,
        size: Annotated[float, typer.Option("--size", min=-2)] = 1.0,
        share: Annotated[float | None, typer.Option("--share")] = None,
        file: Annotated[Path, typer.Option("--file")] = Path("made"),
        files: Annotated[list[Path] | None, typer.Option("--also")] = None,
        corner: Annotated[tuple[str, str] | None, typer.Option("--corner")] = None,
        flag: Annotated[bool, typer.Option("--flag/--no-flag")] = True,
    ) -> None:
        seen.extend((names, count, size, share, file, files, corner, flag))

    app = typer.Typer(rich_markup_mode=None, pretty_exceptions_enable=False, add_completion=False)
    app.command(cls=kind)(command)
    error = io.StringIO()
    with redirect_stderr(error), pytest.raises(SystemExit) as end:
        app(words, prog_name="program")
    return end.value.code, error.getvalue(), [(type(value), repr(value)) for value in seen]  # NaN differs from itself


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["a"],
        ["a", "", "ü"],
        ["--no-flag", "a"],
        *(["a", f"--count={n}"] for n in ("1", "9", "0", "10", "-3", "3.0", " 4", "+5", "1_0", "x", "", "٣", "1e0")),
        *(
            ["a", f"--size={x}"]
            for x in ("1", "-2", "-2.5", ".5", "5.", "1e-3", "inf", "nan", "1e999", " 1", "x", "")
        ),
        *(["a", f"--share={x}"] for x in ("-1.5E+3", "infinity", "0x10", "1_0.0", "٣.٥")),
        *(["a", f"--file={path}"] for path in ("here", "none/there", ".", "", "-", "unreadable", "a//b/../c")),
        ["a", "--also", "x", "--also", "y"],
        ["a", "--corner", "1", "-2"],
        ["a", "--corner", "1"],
    ],
    ids=" ".join,
)
def test_values_are_those_of_typer_and_so_are_its_words(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("here").touch()
    Path("unreadable").touch(mode=0o000)
    assert outcome(OwnValues, words) == outcome(TyperCommand, words)


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments", ["symbolic planar_2r", "fk stanford home", "export planar_2r", "list", "--version"]
)
def test_a_short_command_imports_no_pydantic(arguments: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert shell(WITHOUT_PYDANTIC.format(arguments=arguments)).err == "0 False\n"
    assert Path("out.txt").read_text(encoding="utf-8")
