from __future__ import annotations

import json
from pathlib import Path

import pytest

from dh2sim.cli.output import size_text
from dh2sim.simulate.dataset_layout import STATUS, Layout
from dh2sim.simulate.description import resumed
from tests.program import Outcome, contents, dh2sim
from tests.simulate.convert.samples import Arrays, make_arrays, make_layout, write_run

TEXT = """\
run.zarr  complete
  robot       sample
  controller  pd:kp=10
  randomised  mass ±10 %
  rollouts    7: 6 finished, 1 stopped early
              stopped early: bad_qacc 1
                rollout 4: bad_qacc in step 5 (0.01 s)
              links touched in 1 (first: base_link and link_3 in rollout 2 at
              0.006 s)
              controls clipped in 7: slide in 7; a longer period takes less:
              --controller pd:kp=10,period=2
  steps       8 of 0.002 s = 0.016 s, one in 2 recorded
  integrator  implicitfast
  start       home, seed 0
  recorded    qpos            7 x 5 x 3  rollout, step, joint
              qvel            7 x 5 x 3  rollout, step, joint
              ctrl            7 x 4 x 2  rollout, interval, actuator
              qpos_ref        7 x 5 x 3  rollout, step, joint
              torque          7 x 4 x 3  rollout, interval, joint
              tool_pose       7 x 5 x 7  rollout, step, pose
              base_pose       7 x 5 x 7  rollout, step, pose
              base_twist      7 x 5 x 6  rollout, step, twist
              energy          7 x 5 x 2  rollout, step, energy_kind
              mass_scale      7 x 3      rollout, link
              gain_scale      7 x 2      rollout, actuator
              com_offset      7 x 3 x 3  rollout, link, axis
              contacts        7 x 4      rollout, interval
              status          7          rollout
              stop_step       7          rollout
              saturation      7 x 2      rollout, actuator
              contact_step    7          rollout
              contact_link_a  7          rollout
              contact_link_b  7          rollout
  size        {size}
  speed       {speed}
  made        2026-11-22 01:02:03 UTC
              with dh2sim 0.1.0, MuJoCo 3.17.0, NumPy 2.4.1, Python 3.11.9
  command     dh2sim rollout sample.yaml --out run.zarr
"""
STEPS = 6 * 8 + 5
"""Time steps of the run: one of its seven rollouts stopped in step 5."""
SECONDS = 3 * 0.25


@pytest.fixture
def arrays() -> Arrays:
    arrays = make_arrays(make_layout())
    arrays["saturation"][:] = [0, 3]
    return arrays


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    return tmp_path


@pytest.fixture
def run(folder: Path, arrays: Arrays) -> Path:
    """A complete run in the current folder."""
    return write_run(Path("run.zarr"), make_layout(), arrays)


def _bytes_on_disk(run: Path) -> int:
    return sum(len(data) for data in contents(run).values())


def test_a_run_is_reported_in_eighty_columns(run: Path, arrays: Arrays) -> None:
    numbers = sum(array.nbytes for array in arrays.values())
    disk = _bytes_on_disk(run)
    size = f"{disk / 1000:.1f} kB on disk for {numbers / 1000:.1f} kB of numbers ({100 * disk / numbers:.0f} %)"
    speed = f"{STEPS / SECONDS:.0f} steps/s over 0.75 s"
    assert dh2sim("runs", run) == Outcome(status=0, out=TEXT.format(size=size, speed=speed), err="")
    assert max(map(len, dh2sim("runs", run).out.splitlines())) <= 80


def test_json_tells_the_same_alone(run: Path, arrays: Arrays) -> None:
    printed = dh2sim("runs", run, "--json")
    assert (printed.status, printed.err) == (0, "")
    values = json.loads(printed.out)
    recorded = values.pop("recorded")
    assert recorded["qpos"] == {
        "units": "rad or m",
        "dimensions": ["rollout", "step", "joint"],
        "shape": [7, 5, 3],
    }
    assert list(recorded) == values.pop("variables") == list(arrays)
    assert values == {
        "path": "run.zarr",
        "robot": "sample",
        "controller": "pd:kp=10",
        "rollouts": 7,
        "finished": 6,
        "unstable": 1,
        "not_run": 0,
        "reasons": {"bad_qacc": 1},
        "stopped": [{"rollout": 4, "reason": "bad_qacc", "step": 5}],
        "touched": 1,
        "first_contact": {"rollout": 2, "step": 3, "time": 0.006, "links": ["base_link", "link_3"]},
        "loop_gap": None,
        "saturated": 7,
        "saturated_joints": {"slide": 7},
        "steps": 8,
        "timestep": 0.002,
        "every": 2,
        "duration": 0.016,
        "integrator": "implicitfast",
        "engine": "mujoco",
        "device": "",
        "start": "home",
        "randomize": {"mass": 0.1},
        "vary": {},
        "designs": None,
        "per_design": 1,
        "bytes_on_disk": _bytes_on_disk(run),
        "bytes_in_memory": sum(array.nbytes for array in arrays.values()),
        "blocks": 3,
        "blocks_done": 3,
        "blocks_missing": [],
        "seconds": SECONDS,
        "steps_per_second": STEPS / SECONDS,
        "seed": 0,
        "created": "2026-11-22T01:02:03+00:00",
        "versions": {"dh2sim": "0.1.0", "mujoco": "3.17.0", "numpy": "2.4.1", "python": "3.11.9"},
        "complete": True,
        "command": "dh2sim rollout sample.yaml --out run.zarr",
        "resume_command": None,
    }


def test_an_unfinished_run_tells_how_to_carry_on(folder: Path, arrays: Arrays) -> None:
    run = write_run(Path("run.zarr"), make_layout(), arrays, blocks=1)
    lines = dh2sim("runs", run).out.splitlines()
    assert lines[0] == "run.zarr  not complete"
    assert "  rollouts    7: 3 finished, 4 not yet run" in lines
    assert lines[-1] == "  carry on    dh2sim rollout sample.yaml --out run.zarr --resume"
    printed = json.loads(dh2sim("runs", run, "--json").out)
    assert (printed["complete"], printed["not_run"], printed["stopped"]) == (False, 4, [])
    assert printed["resume_command"] == "dh2sim rollout sample.yaml --out run.zarr --resume"
    assert printed["bytes_in_memory"] == sum(array[:3].nbytes for array in arrays.values())


def test_a_run_that_has_nothing_yet_has_neither_speed_nor_size_of_numbers(folder: Path, arrays: Arrays) -> None:
    layout = make_layout()
    run = write_run(Path("run.zarr"), _with(layout, command="", randomize={}), arrays, blocks=0)
    lines = dh2sim("runs", run).out.splitlines()
    assert "  rollouts    7: 0 finished, 7 not yet run" in lines
    assert "  randomised  nothing" in lines
    assert f"  size        {_bytes_on_disk(run) / 1000:.1f} kB on disk" in lines
    assert not [line for line in lines if line.startswith(("  speed", "  command"))]
    assert lines[-1] == "  carry on    with the same call and resume=True; it was made by the library"


def _with(layout: Layout, **attributes: object) -> Layout:
    return Layout(
        sizes=layout.sizes,
        coordinates=layout.coordinates,
        variables=layout.variables,
        attributes={**layout.attributes, **attributes},
        block=layout.block,
    )


@pytest.mark.parametrize(
    ("command", "again"),
    [
        ("dh2sim rollout a --out b", "dh2sim rollout a --out b --resume"),
        ("dh2sim rollout a --overwrite --out 'b c'", "dh2sim rollout a --out 'b c' --resume"),
        ("dh2sim rollout a --out b --resume --seed 1", "dh2sim rollout a --out b --seed 1 --resume"),
        ("dh2sim rollout 'a", "dh2sim rollout 'a --resume"),
    ],
)
def test_the_command_that_carries_on_never_overwrites(command: str, again: str) -> None:
    assert resumed(command) == again


def test_of_many_early_stops_the_first_few_are_named(folder: Path) -> None:
    layout = make_layout(rollouts=9)
    arrays = make_arrays(layout)
    arrays["status"][1:], arrays["stop_step"][1:] = STATUS["bad_qvel"], range(8)
    lines = dh2sim("runs", write_run(Path("run.zarr"), layout, arrays)).out.splitlines()
    first = lines.index("              stopped early: bad_qvel 8")
    assert [line.strip() for line in lines[first + 1 : first + 7]] == [
        *(f"rollout {i}: bad_qvel in step {i - 1} ({0.002 * (i - 1):.4g} s)" for i in range(1, 6)),
        "and 3 more (--json names all)",
    ]


def test_several_runs_are_reported_one_after_the_other_and_as_a_list(run: Path, arrays: Arrays) -> None:
    other = write_run(Path("other.zarr"), make_layout(), arrays, blocks=2)
    printed = dh2sim("runs", run, other)
    assert printed.out == f"{dh2sim('runs', run).out}\n{dh2sim('runs', other).out}"
    values = json.loads(dh2sim("runs", run, other, "--json").out)
    assert values == [json.loads(dh2sim("runs", path, "--json").out) for path in (run, other)]


def test_what_is_not_a_run_is_reported_and_the_others_all_the_same(run: Path) -> None:
    Path("folder").mkdir()
    Path("file").write_text("text")
    printed = dh2sim("runs", "none.zarr", "folder", run, "file")
    assert printed == Outcome(
        status=2,
        out=dh2sim("runs", run).out,
        err=(
            "dh2sim: there is no 'none.zarr'\n"
            "dh2sim: 'folder' is not a run of dh2sim\n"
            "dh2sim: 'file' is not a run of dh2sim\n"
        ),
    )
    assert dh2sim("runs", run, "none.zarr", "--json").out == ""


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ["--to", "hdf"],
            "--to: 'hdf' is not one of parquet, hdf5. Did you mean 'hdf5'?",
        ),
        (["--out", "x"], "--out needs --to: without it nothing is written"),
        (["--overwrite"], "--overwrite needs --to: without it nothing is written"),
        (["--to", "hdf5", "--json"], "--json must not be given together with --to"),
        (["b.zarr", "--to", "hdf5", "--out", "x"], "--out is one file; convert one run at a time"),
    ],
    ids=["format", "out", "overwrite", "json", "several"],
)
def test_options_that_make_no_sense_are_reported(run: Path, options: list[str], message: str) -> None:
    printed = dh2sim("runs", run, *options)
    assert (printed.status, printed.out) == (2, "")
    assert printed.err.splitlines()[-1] == f"dh2sim: {message}"


@pytest.mark.parametrize(
    ("count", "text"),
    [
        (0, "0 B"),
        (999, "999 B"),
        (1000, "1.0 kB"),
        (12_345_678, "12.3 MB"),
        (999_960, "1.0 MB"),
        (5 * 10**15, "5000.0 TB"),
    ],
)
def test_sizes_are_reported_with_a_digit_and_a_unit(count: int, text: str) -> None:
    assert size_text(count) == text


def test_the_designs_of_a_run_are_described(tmp_path: Path) -> None:
    path = tmp_path / "run.zarr"
    options = ["--vary", "a1=0.05,joint_1.link.mass=uniform:1:2", "--rollouts", "2", "--per-design", "2", "-q"]
    assert dh2sim("rollout", "planar_2r", "--out", str(path), "--steps", "2", *options).status == 0
    found = dh2sim("runs", str(path)).out
    assert "  designs     a1 ±5 %, joint_1.link.mass uniform:1.0:2.0; 2 rollouts each\n" in found
    described = json.loads(dh2sim("runs", str(path), "--json").out)
    assert described["vary"] == {"a1": "0.05", "joint_1.link.mass": "uniform:1.0:2.0"}
    assert (described["designs"], described["per_design"]) == (None, 2)
