"""What the README shows is what happens."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from dh2sim.robot.read import parse_robot
from dh2sim.simulate import rollout
from scripts.update_readme import files
from tests.program import dh2sim_process

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.MULTILINE | re.DOTALL)


def shown_commands() -> list[tuple[str, str]]:
    """Every ``$ dh2sim …`` of the page, with what it shows below."""
    found = [block.split("\n", 1) for block in blocks("console")]
    return [(command.removeprefix("$ "), output) for command, output in found]


def without_rounding_noise(text: str) -> list[str]:
    """The lines of a text; the digits of numbers like 6.7e-16 depend on the machine, and so do times and speeds."""
    for noise, sign in (
        (r"\d\.\de-\d\d", "#e-#"),
        (r"in [\d.]+ s: [\d,]+ steps/s", "in # s: # steps/s"),
        (r"[\d.]+ MB", "# MB"),
    ):
        text = re.sub(noise, sign, text)
    return [" ".join(line.split()) for line in text.splitlines()]


@pytest.mark.slow
@pytest.mark.parametrize(("command", "output"), shown_commands(), ids=[command for command, _ in shown_commands()])
def test_commands_print_what_the_readme_shows(command: str, output: str, tmp_path: Path) -> None:
    program, *arguments = command.split()
    assert program == "dh2sim"
    for name, content in files(README).items():
        if name in arguments:
            (tmp_path / name).write_text(content, encoding="utf-8")
    done = dh2sim_process(*arguments, cwd=tmp_path, variables={"COLUMNS": "80"})
    printed = without_rounding_noise(done.out + done.err)
    assert printed == without_rounding_noise(output)


def test_there_are_commands_to_check() -> None:
    assert [command.split()[1] for command, _ in shown_commands()] == [
        "new",
        "export",
        "validate",
        "info",
        "fk",
        "import",
        "rollout",
    ]


def test_the_robot_file_of_the_readme_is_right() -> None:
    spec = parse_robot(blocks("yaml")[0])
    assert (spec.name, len(spec.rows)) == ("my_arm", 3)


def test_the_python_that_reads_a_run_reads_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    [code] = [block for block in blocks("python") if "open_zarr" in block]
    monkeypatch.chdir(tmp_path)
    rollout("stanford", out="run.zarr", rollouts=2, steps=50, controller="computed-torque")
    exec(compile(code, "README.md", "exec"), {})
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()][1:7] == [
        f"joint_{i}" for i in range(1, 7)
    ]


def test_the_python_of_the_readme_runs() -> None:
    [code] = [block for block in blocks("python") if "dh2sim" in block]
    names: dict[str, object] = {}
    exec(compile(code, "README.md", "exec"), names)
    assert str(names["urdf"]).startswith("<?xml")
    assert [getattr(names[name], "shape", None) for name in ("T_base_tool", "J")] == [(1000, 4, 4), (1000, 6, 3)]


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
