from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from dh2sim import Robot
from dh2sim.errors import DesignFileError, MeasureError, OutputError, RunDiffersError, SettingsError
from tests.program import dh2sim, shell

VARY = {"a1": "uniform:0.3:0.6", "a2": 0.2}
QUICK = {"measure": "reach,manipulability", "samples": 50}


def sweep(out: Path | None = None, **options: object) -> object:
    return Robot.load("planar_2r").sweep(out=out, **{"vary": VARY, "count": 70, **QUICK, **options})  # type: ignore[arg-type]


def test_each_design_has_the_measures_of_its_own_robot() -> None:
    found = Robot.load("planar_2r").sweep(vary=VARY, count=40, measure="reach", samples=50)
    a = np.stack([found.columns["a1"], found.columns["a2"]])
    np.testing.assert_allclose(found.columns["reach"], a.sum(axis=0), rtol=1e-12)
    best = found.measures["reach"].best
    assert best.design == np.argmax(found.columns["reach"])
    assert best.parameters == {"a1": a[0, best.design], "a2": a[1, best.design]}


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_the_table_has_the_same_bytes_however_it_was_interrupted_and_extended(tmp_path: Path, ending: str) -> None:
    whole, parts = tmp_path / f"whole{ending}", tmp_path / f"parts{ending}"
    sweep(whole)
    sweep(parts, count=40)
    journal = parts.with_name(f"{parts.name}.journal")
    journal.write_bytes(journal.read_bytes()[:-30])  # as a process that was killed leaves it
    found = sweep(parts)
    assert found.measured == 70 - 32  # type: ignore[attr-defined]
    assert whole.read_bytes() == parts.read_bytes()


@pytest.mark.slow
def test_the_table_has_the_same_bytes_at_any_number_of_processes(tmp_path: Path) -> None:
    sweep(tmp_path / "1.csv", measure="reach,payload")
    sweep(tmp_path / "3.csv", measure="reach,payload", jobs=3)
    assert (tmp_path / "1.csv").read_bytes() == (tmp_path / "3.csv").read_bytes()


def test_other_settings_are_refused_with_their_difference(tmp_path: Path) -> None:
    out = tmp_path / "arms.csv"
    sweep(out, count=2)
    for changed, phrase in (
        ({"samples": 60}, "samples was 50 and is now 60"),
        ({"seed": 1}, "seed was 0 and is now 1"),
        ({"vary": {**VARY, "a2": 0.3}}, r"vary was a1=uniform:0.3:0.6,a2=0.2 and is now a1=uniform:0.3:0.6,a2=0.3"),
    ):
        with pytest.raises(RunDiffersError, match=phrase):
            sweep(out, count=2, **changed)
    sweep(out, count=2, seed=1, overwrite=True)
    (tmp_path / "other.csv").touch()
    with pytest.raises(OutputError, match="not of a sweep that can be continued"):
        sweep(tmp_path / "other.csv")


def test_functions_of_ones_own_are_given_a_robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("own_measures.py").write_text(
        "def both(robot):\n    return {'n': robot.n, 'x': robot.fk('zero')[0, 3]}\n"
        "def one(robot):\n    return robot.spec.rows[0].a\n"
        "def broken(robot):\n    return 1 / 0\n"
        "def word(robot):\n    return 'much'\n"
    )
    found = sweep(measure="own_measures:both,own_measures:one", count=3)
    a = found.columns  # type: ignore[attr-defined]
    np.testing.assert_array_equal(a["one"], a["a1"])
    np.testing.assert_allclose(a["x"], a["a1"] + a["a2"], rtol=1e-15)
    with pytest.raises(MeasureError, match=r"^design 0 \(a1=.*\): measure 'own_measures:broken': ZeroDivisionError"):
        sweep(measure="own_measures:broken")
    with pytest.raises(MeasureError, match="must return a number, or numbers by name, got 'much'"):
        sweep(measure="own_measures:word")
    with pytest.raises(MeasureError, match="has no function 'tow'"):
        sweep(measure="own_measures:tow")


def test_what_is_wrong_is_named_before_anything_is_measured(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r"measure must not contain 'reech'. Did you mean 'reach'\?"):
        sweep(measure="reech")
    with pytest.raises(SettingsError, match="there is nothing to vary"):
        sweep(vary={})
    path = tmp_path / "designs.csv"
    path.write_text("a1,joint_2.link.mass\n0.4,1\n0.5,-2\n0.6,0\n")
    with pytest.raises(DesignFileError) as caught:
        sweep(vary={}, designs=path, count=None)
    assert [(each.line, each.path) for each in caught.value.problems] == [
        (3, "design 1 (a1=0.5, joint_2.link.mass=-2)"),
        (4, "design 2 (a1=0.6, joint_2.link.mass=0)"),
    ]


def test_the_command_prints_the_best_designs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("designs.csv").write_text("a1, a2\n0.4, 0.2\n0.5, 0.3\n")
    words = ("sweep", "planar_2r", "--designs", "designs.csv", "--measure", "reach", "-o", "arms.csv")
    run = dh2sim(*words, "--json")
    assert (run.status, run.err) == (0, "")
    found = json.loads(run.out)
    best = found["measures"]["reach"]["best"]
    assert (best["design"], best["parameters"]) == (1, {"a1": 0.5, "a2": 0.3})
    assert best["value"] == pytest.approx(0.8, rel=1e-12)
    lines = Path("arms.csv").read_text().splitlines()
    assert lines[0] == "design,a1,a2,reach"
    assert lines[2] == f"1,0.5,0.3,{best['value']!r}"
    run = dh2sim(*words)
    assert run.out.startswith("planar_2r: 2 designs measured, 2 of them before\n")
    assert max(map(len, run.out.splitlines())) <= 80


@pytest.mark.parametrize("ending", [".csv", ".parquet"])
def test_a_complete_sweep_is_reported_where_nothing_can_be_written(
    tmp_path: Path, own_mounts: str, ending: str
) -> None:
    folder = tmp_path / "done"
    folder.mkdir()
    words = f"sweep planar_2r --vary a1=0.1 --measure reach --samples 9 -o {folder}/arms{ending}"
    assert dh2sim(*words.split(), "--count", "40", "-q").status == 0
    script = f"""{own_mounts} sh -c 'mount --bind -o ro "$OUT" "$OUT" && exec $DH2SIM {words} --count $COUNT'"""
    again = shell(script, OUT=str(folder), COUNT="40")
    assert (again.status, again.err) == (0, "")
    assert again.out.startswith("planar_2r: 40 designs measured, 40 of them before\n")
    refused = f"dh2sim: cannot write '{folder}/arms{ending}"
    more = shell(script, OUT=str(folder), COUNT="41")
    assert (more.status, more.out) == (2, "")
    assert more.err.startswith(refused)
    (folder / f"arms{ending}").write_text("of somebody else")
    stale = shell(script, OUT=str(folder), COUNT="40")
    assert (stale.status, stale.out) == (2, "")
    assert stale.err.startswith(refused)
