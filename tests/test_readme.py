"""What README.md and docs/importing.md show is what happens."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from dh2sim.robot.read import parse_robot
from scripts.update_readme import CONSOLE, IMPORTING, files, run

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.MULTILINE | re.DOTALL)


def shown_commands() -> list[tuple[str, str]]:
    """Every ``$ dh2sim …`` of the pages, with what they show below."""
    pages = [README, IMPORTING.read_text(encoding="utf-8")]
    blocks = [
        found[0].removeprefix("```console\n$ ").removesuffix("```")
        for page in pages
        for found in CONSOLE.finditer(page)
    ]
    return [(block.split("\n", 1)[0], block.split("\n", 1)[1]) for block in blocks]


def without_rounding_noise(text: str) -> list[str]:
    """The lines of a text; the digits of numbers like 6.7e-16 and 0.0e+00 depend on the machine."""
    text = re.sub(r"\d\.\de(-\d\d|\+00)", "#e-#", text)
    return [" ".join(line.split()) for line in text.splitlines()]


@pytest.mark.slow
@pytest.mark.parametrize(("command", "output"), shown_commands(), ids=[command for command, _ in shown_commands()])
def test_commands_print_what_the_pages_show(command: str, output: str, tmp_path: Path) -> None:
    for name, content in files().items():
        if name in command.split():
            (tmp_path / name).write_text(content, encoding="utf-8")
    assert without_rounding_noise(run(command, tmp_path)) == without_rounding_noise(output)


def test_there_are_commands_to_check() -> None:
    assert [command.split()[1] for command, _ in shown_commands()] == [
        "new",
        "export",
        "validate",
        "info",
        "fk",
        "ik",
        "symbolic",
        "trajectory",
        "import",
    ]


def test_the_robot_file_of_the_readme_is_right() -> None:
    spec = parse_robot(blocks("yaml")[0])
    assert (spec.name, len(spec.rows)) == ("my_arm", 3)


def test_the_python_of_the_readme_runs() -> None:
    [code] = blocks("python")
    names: dict[str, object] = {}
    exec(compile(code, "README.md", "exec"), names)
    assert str(names["urdf"]).startswith("<?xml")
    assert [getattr(names[name], "shape", None) for name in ("T_base_tool", "J")] == [(1000, 4, 4), (1000, 6, 3)]


def test_the_python_of_the_importing_page_runs(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    [code] = re.findall(
        r"^```python\n(.*?)^```", IMPORTING.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL
    )
    monkeypatch.chdir(ROOT)
    names: dict[str, object] = {}
    exec(compile(code, "importing.md", "exec"), names)
    assert capsys.readouterr().out.startswith("Residual(position=")
    assert "model" in names


def test_the_readmes_first_commands_write_into_no_tracked_file() -> None:
    exports = [line for line in README.splitlines() if re.match(r"(\$ |python3 .*/)dh2sim export", line)]
    assert len(exports) == 2
    assert all("--out build" in line for line in exports)


def test_every_link_of_the_pages_leads_somewhere() -> None:
    for page in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]:
        text = page.read_text(encoding="utf-8")
        for target, anchor in re.findall(r"\]\((?!https?:)([^)#\s]*)#?([^)\s]*)\)", text):
            place = (page.parent / target) if target else page
            assert place.exists(), f"{page.name}: {target}"
            if anchor:
                headings = re.findall(r"^#+ (.*)$", place.read_text(encoding="utf-8"), flags=re.MULTILINE)
                slugs = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
                assert anchor in slugs, f"{page.name}: {target}#{anchor}"
