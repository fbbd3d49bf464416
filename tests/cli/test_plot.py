"""``dh2sim plot``, on a run that ``dh2sim rollout`` wrote."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from tests.program import Outcome, dh2sim

WHAT = "joints, tool, energy, tracking"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("runs") / "run.zarr"
    done = dh2sim(
        *("rollout", "rpr", "--out", path, "--rollouts", "2", "--steps", "40", "--controller", "computed-torque"),
        *("--record", "qpos,qvel,ctrl,reference,torque", "--quiet"),
    )
    assert done == Outcome(status=0, out="", err="")
    return path


@pytest.mark.slow
def test_a_plot_is_written_beside_its_run(run: Path) -> None:
    out = run.with_name("run-1-joints.png")
    done = dh2sim("plot", run, "--rollout", "1", "--size", "700x500", "--dpi", "60")
    assert done == Outcome(status=0, out=f"{out}: joints of run.zarr, rollout 1\n", err="")
    with Image.open(out) as picture:
        assert (picture.format, picture.size) == ("PNG", (700, 500))


@pytest.mark.slow
def test_a_plot_is_a_drawing_where_its_ending_says_so(run: Path, tmp_path: Path) -> None:
    assert dh2sim("plot", run, "--what", "tracking", "--out", tmp_path / "a.svg", "--quiet").out == ""
    assert dh2sim("plot", run, "--what", "tracking", "--out", tmp_path / "a.PDF").status == 0
    assert b"<svg" in (tmp_path / "a.svg").read_bytes()
    assert (tmp_path / "a.PDF").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("arguments", "printed"),
    [
        (["--what", "tol"], f"unknown plot 'tol'. Did you mean 'tool'? Allowed: {WHAT}"),
        (["--rollout", "2"], "run.zarr has no rollout 2; it contains rollouts 0 to 1"),
        (["--out", "a.mp4"], "cannot write 'a.mp4' as a plot; allowed endings: .png, .svg, .pdf"),
        (["--out", "no/a.png"], "cannot write 'no/a.png': there is no folder 'no'"),
        (
            ["--what", "tool", "--out", "a.png"],
            "run.zarr: this plot needs tool_pose, which the run does not contain; record again with tool_pose "
            "(recorded: qpos, qvel, qpos_ref, qvel_ref, ctrl, torque)",
        ),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_cannot_be_plotted_is_reported(
    run: Path, arguments: list[str], printed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert dh2sim("plot", run, *arguments) == Outcome(status=2, out="", err=f"dh2sim: {printed}\n")
    assert list(tmp_path.iterdir()) == []


def test_what_is_not_a_run_is_reported(tmp_path: Path) -> None:
    printed = f"dh2sim: '{tmp_path}' is not a run of dh2sim\n"
    assert dh2sim("plot", tmp_path) == Outcome(status=2, out="", err=printed)
    assert dh2sim("plot", "no.zarr") == Outcome(status=2, out="", err="dh2sim: there is no 'no.zarr'\n")


@pytest.mark.parametrize("command", ["plot", "render"])
@pytest.mark.parametrize("place", ["", ".", "/"])
def test_a_folder_without_a_name_is_not_a_run(command: str, place: str) -> None:
    printed = f"dh2sim: '{Path(place)}' is not a run of dh2sim\n"
    assert dh2sim(command, place) == Outcome(status=2, out="", err=printed)


def test_a_run_can_be_plotted_from_inside(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(run)
    done = dh2sim("plot", ".", "--what", "tracking")
    assert done == Outcome(
        status=0, out=f"{run.parent}/run-0-tracking.png: tracking of run.zarr, rollout 0\n", err=""
    )


@pytest.mark.parametrize(
    ("arguments", "printed"),
    [
        (["--size", "100x100"], "--size must be from 200 to 20000 pixels each way, got 100x100"),
        (["--size", "100"], "--size: '100' must have the form WIDTHxHEIGHT, such as 1280x720"),
    ],
)
def test_sizes_that_cannot_be_are_reported(run: Path, arguments: list[str], printed: str) -> None:
    done = dh2sim("plot", run, *arguments)
    assert (done.status, done.out) == (2, "")
    assert printed in " ".join(done.err.split())
