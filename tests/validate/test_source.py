"""An imported robot's masses against those of the file that it was made from."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from dh2sim.formats.urdf.write import to_urdf
from tests.program import dh2sim
from tests.sample_robots import model
from tests.validate.files import failures, validated


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "source.urdf"
    path.write_text(to_urdf(model("odd")), encoding="utf-8")
    assert dh2sim("import", path, "--out", tmp_path / "made.yaml").status == 0
    return path


def test_an_imported_robot_matches_its_source(source: Path) -> None:
    report = validated(source.parent / "made.yaml", None, "--source", str(source), samples=7)
    [robot] = report["robots"]
    compared = [entry for entry in robot["engines"] if entry.get("reference") == "source.urdf"]
    assert [(entry["quantity"], entry["ok"], entry["samples"]) for entry in compared] == [
        ("mass matrix", True, 7),
        ("gravity force", True, 7),
    ]
    assert all(entry["max_error"] < 1e-7 for entry in compared)


def test_a_changed_mass_is_found(source: Path) -> None:
    made = source.parent / "made.yaml"
    text = made.read_text(encoding="utf-8")
    mass = re.findall(r"mass: (\S+)", text)[1]
    made.write_text(text.replace(f"mass: {mass}", f"mass: {1.01 * float(mass)!r}"), encoding="utf-8")
    failed = failures(validated(made, None, "--source", str(source)))
    assert set(failed) == {("mujoco-mjcf", "mass matrix"), ("mujoco-mjcf", "gravity force")}
    run = dh2sim("validate", made, "--source", source, "--samples", "5")
    assert [line.split()[:3] for line in run.out.splitlines() if line.endswith("FAILED")] == [
        ["mujoco-mjcf", "masses", "(source)"],
        ["mujoco-mjcf", "gravity", "(source)"],
    ]
    assert max(map(len, run.out.splitlines())) <= 80


def test_a_source_without_masses_is_skipped(source: Path) -> None:
    text = source.read_text(encoding="utf-8")
    source.write_text(re.sub(r"<inertial>.*?</inertial>", "", text, flags=re.DOTALL), encoding="utf-8")
    report = validated(source.parent / "made.yaml", None, "--source", str(source))
    assert [
        entry["reason"]
        for entry in report["robots"][0]["engines"]
        if entry["engine"] == "mujoco-mjcf" and entry["ok"] is None
    ] == [f"{source} gives no masses to compare with"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["stanford", "--source", "source.urdf"], "its arm has no joint joint_1, joint_2"),
        (["made.yaml", "--source", "none.urdf"], "none.urdf: cannot be read"),
        (["made.yaml", "--source", "made.yaml"], "must be a URDF or an MJCF"),
        (["made.yaml", "--tip", "tool0"], "--tip needs --source"),
        (["made.yaml", "stanford", "--source", "source.urdf"], "is the source of one robot"),
    ],
)
def test_a_source_that_does_not_fit_is_an_error(
    source: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: str
) -> None:
    monkeypatch.chdir(source.parent)
    run = dh2sim("validate", *arguments, "--samples", "3")
    assert (run.status, run.out) == (2, "")
    assert words in " ".join(run.err.replace("│", " ").split())
