"""``dh2sim workspace``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.program import dh2sim

QUICK = ("--samples", "2000", "--size", "0.1")


def test_workspace_prints_what_is_reached() -> None:
    run = dh2sim("workspace", "planar_2r", "--section", *QUICK)
    assert (run.status, run.err) == (0, "")
    assert run.out.startswith("planar_2r: tool0 reaches a part of a plane\n")
    assert "outermost  1.700000" in run.out
    assert max(map(len, run.out.splitlines())) <= 80


def test_json_has_numbers_alone() -> None:
    run = dh2sim("workspace", "cylindrical", "--section", "--json", *QUICK)
    content = json.loads(run.out)
    assert content["section"]["coordinates"] == ["r", "z"]
    assert content["section"]["area"] == pytest.approx(0.3, rel=1e-6)
    assert content["reach"]["outermost"]["value"] == pytest.approx(0.5, abs=1e-9)
    assert set(content["section"]["boundary"][0]["held_by"]) <= {"singular", "joint_2", "joint_3"}
    assert content["voxels"] > content["sampled_voxels"] > 0


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["npz", "csv", "ply", "svg", "png"])
@pytest.mark.parametrize("section", [(), ("--section",)])
def test_files_of_all_kinds_are_written(tmp_path: Path, ending: str, section: tuple[str, ...]) -> None:
    if ending in ("svg", "png"):
        pytest.importorskip("matplotlib")
    out = tmp_path / f"reach.{ending}"
    run = dh2sim("workspace", "rpr", *section, "-o", str(out), "-q", *QUICK)
    assert (run.status, run.out, run.err) == (0, "", "")
    match ending:
        case "npz":
            with np.load(out) as arrays:
                assert arrays["center"].shape == (len(arrays["count"]), 3)
                assert ("boundary_0" in arrays) == bool(section)
        case "csv":
            head = out.read_text().split("\n", 1)[0]
            assert head == ("curve,x,y,held_by" if section else "x,y,z,count,manipulability,joint_1,joint_2,joint_3")
        case "ply":
            header, body = out.read_bytes().split(b"end_header\n", 1)
            count = int(header.split(b"element vertex ")[1].split(b"\n")[0])
            assert len(body) == count * (4 * 4 + 3 + 4)
        case _:
            assert out.stat().st_size > 2000


def test_the_same_command_writes_the_same_bytes(tmp_path: Path) -> None:
    texts = []
    for threads in ("1", "2"):
        out = tmp_path / f"{threads}.csv"
        dh2sim("workspace", "scara", "--threads", threads, "-o", str(out), *QUICK)
        texts.append(out.read_bytes())
    assert texts[0] == texts[1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["puma560", "--size", "0.001"], "--size of 0.001 m would need"),
        (["puma560", "--size", "nan"], "--size must be a length above 0, in m, got nan"),
        (["puma560", "--samples", "0"], "--samples must be a whole number from 1 to"),
        (["puma560", "--orientations", "5"], "needs --dexterity"),
        (["puma560", "--frame", "dh_9"], "unknown frame 'dh_9'"),
        (["puma560", "-o", "reach.gif"], "allowed endings: .png, .svg, .pdf, .npz, .csv, .ply"),
        (["puma560", "-o", "nowhere/reach.csv"], "there is no folder 'nowhere'"),
        (["planar_2r", "--dexterity", "--samples", "50"], "cannot choose the orientation at a position"),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(arguments: list[str], message: str) -> None:
    run = dh2sim("workspace", *arguments)
    assert (run.status, run.out) == (2, "")
    assert message in run.err
