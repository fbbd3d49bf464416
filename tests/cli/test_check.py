from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.program import dh2sim
from tests.robot_files import small, write
from tests.sample_robots import ROBOTS_DIR


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    write(tmp_path, small("arm"))
    return tmp_path


def spoil(folder: Path, angle: str = "90") -> None:
    path = folder / "arm.yaml"
    path.write_text(path.read_text(encoding="utf-8").replace("0.651", angle), encoding="utf-8")


def test_a_repository_that_is_right_passes() -> None:
    run = dh2sim("check", "--samples", "5")
    assert (run.status, run.out, run.err) == (0, "1 of 1 robot passed\n", "")


def test_a_finding_is_status_1_and_reports_are_written_in_the_forms_of_their_endings(folder: Path) -> None:
    spoil(folder)
    run = dh2sim("check", "--only", "files", "--format", "github", "-o", "a.sarif", "-o", "a.json", "-o", "a.md")
    assert run.status == 1
    assert run.out.startswith("::warning file=arm.yaml,line=4,col=")
    assert json.loads((folder / "a.sarif").read_text())["runs"][0]["results"][0]["ruleId"] == "degrees-in-rad"
    assert json.loads((folder / "a.json").read_text())["failed"] == 1
    assert (folder / "a.md").read_text().startswith("### dh2sim check: 0 of 1 robot passed")
    assert json.loads(dh2sim("check", "--only", "files", "--json").out) == json.loads((folder / "a.json").read_text())


def test_what_a_baseline_accepts_passes_until_there_is_more(folder: Path) -> None:
    spoil(folder)
    written = dh2sim("check", "--only", "files", "--write-baseline", "accepted.json")
    assert (written.status, written.err) == (0, "dh2sim: accepted.json accepts 1 finding\n")
    run = dh2sim("check", "--only", "files", "--baseline", "accepted.json")
    assert (run.status, run.out) == (0, "1 of 1 robot passed, 1 accepted by the baseline\n")
    run = dh2sim("check", "--only", "drift", "--baseline", "accepted.json")
    assert (run.status, run.out) == (0, "1 of 1 robot passed\n"), "slips were not looked for, so none is gone"
    write(folder, small("other").replace("0.651", "45"))
    run = dh2sim("check", "--only", "files", "--baseline", "accepted.json")
    assert run.status == 1
    assert [line.split(":")[0] for line in run.out.splitlines()[:-1]] == ["other.yaml"]
    (folder / "other.yaml").unlink()
    (folder / "arm.yaml").write_text(small("arm"), encoding="utf-8")
    run = dh2sim("check", "--only", "files", "--baseline", "accepted.json")
    assert (run.status, run.out) == (0, "1 of 1 robot passed; 1 entry of the baseline no longer occurs\n")


def test_robots_that_changed_are_drawn_before_and_after(folder: Path) -> None:
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    for arguments in (["init", "-q"], ["add", "-A"], ["commit", "-qm", "one"]):
        identity = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
        subprocess.run(["git", *identity, *arguments], check=True, capture_output=True)
    spoil(folder, "-0.651")
    write(folder, small("new"))
    run = dh2sim("check", "--only", "files", "--changed-since", "HEAD", "--pictures", "changes")
    assert (run.status, run.out) == (0, "2 of 2 robots passed\n")
    names = sorted(path.name for path in (folder / "changes").iterdir())
    assert names == ["arm_after.svg", "arm_before.svg", "new_after.svg"]
    before, after = ((folder / "changes" / f"arm_{state}.svg").read_text() for state in ("before", "after"))
    assert before.startswith(("<svg", "<?xml"))
    assert before != after


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--only", "pose"], "--only: 'pose' is not one of files, drift, poses"),
        (["--format", "html"], "--format: 'html' is not one of text, github, sarif, json, junit, markdown"),
        (["-o", "report.html"], "report.html: a report ends in .txt or .sarif or .json or .xml or .md"),
        (["--pictures", "x"], "--pictures needs --changed-since"),
        (["--baseline", "a", "--write-baseline", "b"], "--baseline must not be given together with --write-baseline"),
        (["--json", "--format", "sarif"], "--json must not be given together with --format"),
        (["--baseline", "none.json"], "cannot read the baseline 'none.json'"),
        (["nowhere"], "no file or folder named 'nowhere'"),
        (["-o", "no/report.json"], "there is no folder 'no'"),
    ],
)
def test_wrong_usage_is_status_2(arguments: list[str], message: str, folder: Path) -> None:
    run = dh2sim("check", "--samples", "1", *arguments)
    assert run.status == 2
    assert message in " ".join(run.err.split())
    assert sorted(path.name for path in folder.iterdir()) == ["arm.yaml"]


def test_a_file_of_another_format_is_named_as_such() -> None:
    urdf = ROBOTS_DIR.parent / "generated" / "planar_2r" / "planar_2r.urdf"
    run = dh2sim("check", urdf)
    assert (run.status, run.out) == (2, "")
    assert run.err.startswith(f"dh2sim: {urdf}: this is a URDF, not a robot file: run 'dh2sim import ")
