from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from dh2sim.simulate.controllers.protocol import OpenLoop
from tests.simulate.controllers.files import JOINTS, run, table
from tests.simulate.controllers.samples import arm, make, refused


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "needs a first line that names joints, such as joint_1, or actuators, such as joint_1_motor"),
        ("time\n0\n", "needs a first line that names joints, such as joint_1, or actuators, such as joint_1_motor"),
        ("joint_1,joint_1\n0,0\n", "has more than one column 'joint_1'"),
        ("joint_1\n", "cannot be used:\n  there are no values below the first line"),
        (
            "joint_1,joint_2,joint_3\n0,1\n0,x,1\n0,0,inf\n",
            "cannot be used:\n  line 2 has 2 values; the first line names 3 columns\n"
            "  line 3, column 'joint_2': 'x' is not a finite number\n"
            "  line 4, column 'joint_3': 'inf' is not a finite number",
        ),
        (
            "joint_1\n" + "x\n" * 9,
            "cannot be used:\n"
            + "".join(f"  line {i}, column 'joint_1': 'x' is not a finite number\n" for i in range(2, 7))
            + "  and 4 more",
        ),
        ("time,joint_1\n5,0\n", ": time must start at 0, the start of the rollout, got 5.0"),
        ("time,joint_1\n0,0\n1,0\n1,0\n", ": time must increase from row to row; 1.0 comes after 1.0"),
        (
            "joint_1,joint_2_motor\n0,0\n",
            ": columns 'joint_1' are not named after actuators, as joint_1_motor is, but 'joint_2_motor' are. "
            "A file contains either controls, or with as=reference positions of joints",
        ),
        (
            "joint_1,joint_2,joint_5\n0,0,0\n",
            " does not fit the robot, whose joints are joint_1, joint_2, joint_3:\n"
            "  missing column 'joint_3'\n  unknown column 'joint_5'; did you mean 'joint_3'?",
        ),
        (
            "joint_1_motor,joint_3_motor\n0,0\n",
            " does not fit the robot, whose actuators are joint_1_motor, joint_2_motor, joint_3_motor:\n"
            "  missing column 'joint_2_motor'",
        ),
    ],
)
def test_a_table_that_cannot_be_replayed_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, problem: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("table.csv").write_text(text, encoding="utf-8")
    space = "" if problem.startswith((" ", ":")) else " "
    assert refused("replay:file=table.csv") == f"controller 'replay': 'table.csv'{space}{problem}"


def test_joints_are_not_taken_for_controls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    table(Path("table.csv"), JOINTS, [[0, 0, 0]])
    assert refused("replay:file=table.csv,as=ctrl") == (
        "controller 'replay': 'table.csv': columns 'joint_1', 'joint_2', 'joint_3' are not named after actuators, as "
        "joint_1_motor is. A file contains either controls, or with as=reference positions of joints"
    )


def test_a_file_that_is_no_text_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("table.csv").write_bytes(b"\xff\xfe\x00")
    assert refused("replay:file=table.csv") == (
        "controller 'replay': 'table.csv' is not a CSV file: line 1 is not UTF-8: byte 0xff; it seems to be UTF-16: "
        "save it as UTF-8"
    )


def test_a_file_that_is_not_there_or_of_no_known_kind_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.txt").write_text("1", encoding="utf-8")
    Path("folder").mkdir()
    assert refused("replay:file=b.csv") == "controller 'replay': no such file 'b.csv'"
    assert refused("replay:file=a.txt") == (
        "controller 'replay': 'a.txt' cannot be replayed; it must be a .csv, .npy or .npz file or a run of dh2sim"
    )
    assert refused("replay:file=~nobody_of_this_name/b.csv") == (
        "controller 'replay': cannot read '~nobody_of_this_name/b.csv': Could not determine home directory."
    )
    assert refused(f"replay:file={'a' * 300}") == (
        f"controller 'replay': cannot read '{'a' * 300}': [Errno 36] File name too long: '{'a' * 300}'"
    )
    assert refused("replay:file=folder") == "controller 'replay': 'folder' is not a run of dh2sim"


@pytest.mark.parametrize(
    ("array", "text", "problem"),
    [
        (np.zeros((4, 3)), "", " does not say what its numbers are: add as=ctrl or as=reference"),
        (
            np.zeros(3),
            ",as=ctrl",
            " must contain real numbers of shape (time steps, columns) or (rollouts, time steps, columns), "
            "got float64 of shape (3,)",
        ),
        (
            np.zeros((4, 3), dtype=complex),
            ",as=ctrl",
            " must contain real numbers of shape (time steps, columns) or (rollouts, time steps, columns), "
            "got complex128 of shape (4, 3)",
        ),
        (np.full((4, 3), np.nan), ",as=ctrl", ": time step 0, column 0: nan is not a finite number"),
        (
            np.concatenate([np.zeros((2, 4, 3)), np.full((1, 4, 3), np.inf)]),
            ",as=ctrl",
            ": rollout 2, time step 0, column 0: inf is not a finite number",
        ),
        (np.zeros((4, 2)), ",as=reference", " has 2 columns; the robot has 3 joints: joint_1, joint_2, joint_3"),
        (
            np.zeros((4, 4)),
            ",as=ctrl",
            " has 4 columns; the robot has 3 actuators: joint_1_position, joint_2_position, joint_3_position",
        ),
        (
            np.zeros((5, 4, 3)),
            ",as=ctrl",
            " has 5 rollouts, 0 to 4; rollout 6 of this run has none to replay. Simulate fewer rollouts, or let all "
            "replay one with rollout=NUMBER",
        ),
        (np.zeros((5, 4, 3)), ",as=ctrl,rollout=5", " has rollouts 0 to 4; rollout must be one of them, got 5"),
        (np.zeros((4, 3)), ",as=ctrl,rollout=1", " has one rollout, 0; rollout must be one of them, got 1"),
    ],
)
def test_a_numpy_file_that_cannot_be_replayed_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, array: Any, text: str, problem: str
) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("a.npy", array)
    assert refused(f"replay:file=a.npy{text}") == f"controller 'replay': 'a.npy'{problem}"


def test_a_numpy_file_of_objects_is_not_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("a.npy", np.array([[{}]], dtype=object))
    assert refused("replay:file=a.npy,as=ctrl").startswith(
        "controller 'replay': 'a.npy' is not a NumPy array: it contains Python objects"
    )


def test_a_run_of_another_program_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run(Path("run.zarr"), dh2sim_run=99)
    assert refused("replay:file=run.zarr") == "controller 'replay': 'run.zarr' is not a run of dh2sim"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes with names here")
def test_links_and_pipes_in_a_run_are_refused_and_never_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run(Path("run.zarr"))
    chunk = next(path for path in sorted(Path("run.zarr/ctrl").rglob("*")) if path.is_file() and path.suffix == "")
    for file in (Path("run.zarr/zarr.json"), Path("run.zarr/ctrl/zarr.json"), chunk):
        whole = file.read_bytes()
        Path("secret").write_bytes(whole)
        for replace in (os.mkfifo, lambda path: path.symlink_to(tmp_path / "secret")):
            file.unlink()
            replace(file)
            assert refused("replay:file=run.zarr").startswith("controller 'replay': 'run.zarr")
            file.unlink()
            file.write_bytes(whole)


def test_a_run_without_controls_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run(Path("a.zarr"))
    xr.open_zarr("a.zarr", consolidated=False).drop_vars("ctrl").load().to_zarr(
        "b.zarr", zarr_format=3, consolidated=False
    )
    assert refused("replay:file=b.zarr") == (
        "controller 'replay': 'b.zarr' has recorded no controls; run it again with 'ctrl' in record"
    )


def test_a_rollout_that_stopped_early_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    whole = run(Path("whole.zarr"))
    ctrl = whole.ctrl.copy()
    ctrl[[1, 4], 10:] = np.nan
    whole.assign(ctrl=ctrl).to_zarr("run.zarr", zarr_format=3, consolidated=False)
    why = "they stopped early, or the run is not finished"
    assert refused("replay:file=run.zarr") == (
        f"controller 'replay': 'run.zarr' does not contain all of rollouts 1, 4: {why}"
    )
    assert refused("replay:file=run.zarr,rollout=4") == (
        "controller 'replay': 'run.zarr' does not contain all of rollout 4: it stopped early, or the run is not "
        "finished"
    )
    controller, _ = make("replay:file=run.zarr", arm(), range(2, 4))
    assert isinstance(controller, OpenLoop)
    assert np.array_equal(controller.controls(0, 20), ctrl[2:4])
