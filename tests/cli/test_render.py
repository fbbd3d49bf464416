"""``dh2sim render``, on runs that ``dh2sim rollout`` wrote."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.draw.drawing import require_gl
from tests.program import Outcome, dh2sim, environment

UNSTABLE = """
name: shaky
convention: standard
joints:
  - {type: revolute, a: 0.3, alpha: 0.4, actuator: {type: position, kp: 1e9, kv: 1e-6}}
  - {type: revolute, a: 0.2, actuator: {type: position, kp: 1e9, kv: 1e-6}}
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("runs") / "run.zarr"
    done = dh2sim("rollout", "rpr", "--out", path, "--rollouts", "3", "--steps", "100", "--every", "2", "--quiet")
    assert done == Outcome(status=0, out="", err="")
    return path


def test_a_rollout_becomes_a_film_beside_its_run(run: Path) -> None:
    require_gl()
    film = run.with_name("run-1.mp4")
    done = dh2sim("render", run, "--rollout", "1", "--size", "96x64", "--fps", "10")
    assert done == Outcome(status=0, out=f"{film}: run.zarr, rollout 1, 0.2 s in 3 pictures, 96x64\n", err="")
    assert film.read_bytes()[4:8] == b"ftyp"


@pytest.mark.slow
def test_a_gif_and_a_still_are_chosen_by_their_ending(run: Path, tmp_path: Path) -> None:
    require_gl()
    done = dh2sim("render", run, "--out", tmp_path / "a.gif", "--size", "96x64", "--speed", "2", "--frames")
    expected = f"{tmp_path / 'a.gif'}: run.zarr, rollout 0, 0.2 s in 3 pictures, 96x64\n"
    assert done == Outcome(status=0, out=expected, err="")
    with Image.open(tmp_path / "a.gif") as film:
        assert (film.format, film.size) == ("GIF", (96, 64))
    done = dh2sim("render", run, "--out", tmp_path / "a.png", "--size", "96x64", "--time", "0.1", "--no-trace")
    expected = f"{tmp_path / 'a.png'}: run.zarr, rollout 0 at 0.1 s, 96x64\n"
    assert done == Outcome(status=0, out=expected, err="")
    assert dh2sim("render", run, "--out", tmp_path / "b.png", "--size", "96x64", "--quiet").out == ""
    with Image.open(tmp_path / "a.png") as a, Image.open(tmp_path / "b.png") as b:
        assert not np.array_equal(np.asarray(a), np.asarray(b))


def test_a_robot_becomes_a_picture_in_the_folder_that_one_is_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    require_gl()
    monkeypatch.chdir(tmp_path)
    done = dh2sim("render", "stanford", "--size", "96x64", "--configuration", "printed", "--camera", "overview")
    assert done == Outcome(status=0, out="stanford.png: stanford at printed, 96x64\n", err="")
    assert [path.name for path in tmp_path.iterdir()] == ["stanford.png"]


def test_a_rollout_that_stopped_early_says_where_its_film_ends(tmp_path: Path) -> None:
    require_gl()
    (tmp_path / "shaky.yaml").write_text(UNSTABLE)
    path = tmp_path / "run.zarr"
    made = dh2sim(
        *("rollout", tmp_path / "shaky.yaml", "--out", path, "--rollouts", "1", "--steps", "200", "--quiet"),
        *("--timestep", "0.02", "--controller", "sine", "--integrator", "Euler"),
    )
    assert made.status == 0
    done = dh2sim("render", path, "--size", "96x64", "--out", tmp_path / "a.png")
    assert done.status == 0
    assert done.err.startswith("dh2sim: run.zarr, rollout 0 stopped early in time step ")
    assert ": what is shown ends at " in done.err


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--rollout", "3"], "run.zarr has no rollout 3; it contains rollouts 0 to 2"),
        (["--out", "a.avi"], "cannot write 'a.avi' as a picture; allowed endings: .mp4, .gif, .png"),
        (["--out", "no/a.mp4"], "cannot write 'no/a.mp4': there is no folder 'no'"),
        (["--size", "97x64"], "an .mp4 needs an even width and height, got 97x64; use 98x64"),
        (["--size", "10x64"], "the width must be from 64 to 8192 pixels, got 10"),
        (["--fps", "0"], "the rate must be from 1 to 240 pictures per second, got 0"),
        (["--out", "a.png", "--time", "3"], "the motion lasts from 0 to 0.2 s, got 3 s"),
        (
            ["--camera", "side"],
            "unknown camera 'side'. Cameras: overview; or azimuth,elevation[,distance] in degrees and m, such as "
            "120,-20",
        ),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_cannot_be_rendered_is_reported(
    run: Path, arguments: list[str], expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    require_gl()
    monkeypatch.chdir(tmp_path)
    output = [] if "--out" in arguments else ["--out", "a.mp4"]
    assert dh2sim("render", run, *output, *arguments) == Outcome(status=2, out="", err=f"dh2sim: {expected}\n")
    assert list(tmp_path.iterdir()) == []


def test_what_is_neither_run_nor_robot_is_reported(tmp_path: Path) -> None:
    missing = tmp_path / "no.zarr"
    assert dh2sim("render", missing) == Outcome(status=2, out="", err=f"dh2sim: there is no '{missing}'\n")
    expected = f"dh2sim: '{tmp_path}' is not a run of dh2sim\n"
    assert dh2sim("render", tmp_path) == Outcome(status=2, out="", err=expected)
    assert dh2sim("render", "stanfrd").err == dh2sim("info", "stanfrd").err


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["stanford", "--out", "a.mp4"], "dh2sim: a robot does not move: write 'a.png', or render a run\n"),
        (["stanford", "--time", "1"], "--time does not apply to a robot"),
        (["run.zarr", "--configuration", "home"], "--configuration does not apply to a run"),
        (["run.zarr", "--time", "1"], "--time does not apply to a video"),
        (["run.zarr", "--out", "a.png", "--fps", "9"], "--fps does not apply to a .png"),
        (["run.zarr", "--size", "big"], "--size: 'big' must have the form WIDTHxHEIGHT, such as"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_options_that_do_not_fit_are_reported(arguments: list[str], expected: str) -> None:
    done = dh2sim("render", *arguments)
    assert (done.status, done.out) == (2, "")
    assert expected in done.err


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["mp4", "gif"])
def test_an_interrupted_film_leaves_nothing(run: Path, tmp_path: Path, ending: str) -> None:
    require_gl()
    program = subprocess.Popen(
        [sys.executable, "-m", "dh2sim", "render", run, "--out", tmp_path / f"a.{ending}", "--speed", "0.01"],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 180
    while not list(tmp_path.iterdir()):
        assert time.monotonic() < deadline, "no film was begun"
        time.sleep(0.02)
    time.sleep(0.5)
    program.send_signal(signal.SIGINT)
    out, err = program.communicate(timeout=180)
    assert (program.returncode, out, err) == (130, "", "dh2sim: interrupted\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs limits of POSIX")
@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("a.mp4", "ffmpeg was ended by a signal: File size limit exceeded"),
        ("a.gif", "ffmpeg was ended by a signal: File size limit exceeded"),
        ("a.png", "File too large"),
    ],
)
def test_a_file_that_cannot_be_written_whole_is_not_there(run: Path, tmp_path: Path, name: str, why: str) -> None:
    require_gl()
    out = tmp_path / name
    done = subprocess.run(
        ["sh", "-c", 'ulimit -f 4; exec "$@"', "sh", sys.executable, "-m", "dh2sim", "render", run, "--out", out],
        env=environment(),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert (done.returncode, done.stderr) == (2, f"dh2sim: cannot write '{out}': {why}\n")
    assert list(tmp_path.iterdir()) == []
