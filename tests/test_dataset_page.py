"""What the page on datasets says is so."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import xarray as xr

from dh2sim import build_model, load_robot
from dh2sim.model.mechanism import build_mechanism
from dh2sim.simulate.dataset_layout import STATUS, Layout
from dh2sim.simulate.options import DEFAULT_RECORD, RECORDABLE, RolloutOptions
from dh2sim.simulate.prepare import prepare
from dh2sim.simulate.quantities import QUANTITIES
from dh2sim.simulate.store.metadata import make_metadata
from tests.program import contents, dh2sim

PAGE = (Path(__file__).resolve().parent.parent / "docs" / "dataset.md").read_text(encoding="utf-8")

JOINTED = """\
name: jointed
convention: standard
joints:
  - {type: revolute, a: 0.3, limits: {effort: 10}, dynamics: {damping: 0.1, friction: 0.01, armature: 0.02}}
  - {type: prismatic, d: 0.2}
"""


def _tables(heading: str) -> Iterator[list[list[str]]]:
    """The tables below a heading, as rows of cells without the head."""
    [section] = re.findall(rf"^#+ {heading}\n(.*?)(?=^#+ |\Z)", PAGE, flags=re.MULTILINE | re.DOTALL)
    for table in re.findall(r"^\|.*\n\|[-|]+\|\n((?:\|.*\n)+)", section, flags=re.MULTILINE):
        yield [[cell.strip() for cell in line.strip("|").split(" | ")] for line in table.splitlines()]


def _names(cell: str) -> list[str]:
    return re.findall(r"`([a-z0-9_]+)`", cell)


def _first_cells(table: list[list[str]]) -> set[str]:
    return {name for row in table for name in _names(row[0])}


@pytest.fixture(scope="module")
def layouts(tmp_path_factory: pytest.TempPathFactory) -> list[Layout]:
    """Layouts that hold, between them, everything that a run can hold."""
    robot = tmp_path_factory.mktemp("robot") / "jointed.yaml"
    robot.write_text(JOINTED)
    model = build_model(load_robot(robot))
    sensed = {name: 0.1 for name in QUANTITIES if name.startswith(("encoder", "sensor"))}
    change = {name: 0.1 for name in QUANTITIES if name not in sensed}
    runs = (
        RolloutOptions(rollouts=4, steps=6, record=RECORDABLE, controller="computed-torque", floating_base=True),
        RolloutOptions(rollouts=4, steps=6, record=RECORDABLE, controller="hold", randomize=change),
        RolloutOptions(rollouts=4, steps=6, controller="computed-torque", randomize=sensed),
    )
    mechanism = prepare(build_mechanism(load_robot("four_bar")), RolloutOptions(rollouts=4, steps=6)).layout
    robot.write_text(JOINTED.replace("standard", "hayati"))
    varied = RolloutOptions(rollouts=4, steps=6, vary={"a1": 0.1, "joint_1.limits.effort": 0.1})
    designs = prepare(build_model(load_robot(robot)), varied).layout
    return [*(prepare(model, options).layout for options in runs), mechanism, designs]


def test_every_dimension_is_described_and_no_other(layouts: list[Layout]) -> None:
    dimensions, _ = _tables("Dimensions and labels")
    assert _first_cells(dimensions) == {name for layout in layouts for name in layout.sizes}


def test_every_coordinate_is_described_and_no_other(layouts: list[Layout]) -> None:
    dimensions, coordinates = _tables("Dimensions and labels")
    without = {row[0].strip("`") for row in dimensions if row[2].startswith("none")}
    reported = _first_cells(coordinates) | (_first_cells(dimensions) - without)
    assert reported == {coordinate.name for layout in layouts for coordinate in layout.coordinates}
    for row in coordinates:
        for name in _names(row[0]):
            [along] = {c.dimension for layout in layouts for c in layout.coordinates if c.name == name}
            assert _names(row[1]) == [along]


def test_every_variable_is_described_with_its_dimensions_and_type(layouts: list[Layout]) -> None:
    [variables] = _tables("Variables")
    reported = {name: row for row in variables for name in _names(row[0])}
    known = {variable.name: variable for layout in layouts for variable in layout.variables}
    varied = {name for name, variable in known.items() if "parameter" in variable.attributes}
    assert varied == {"a1", "joint_1_limits_effort"}  # the page says how their names are made
    assert set(reported) == set(known) - varied
    for name, row in reported.items():
        assert row[1].split(", ") == list(known[name].dimensions)
        dtype = known[name].dtype
        assert dtype.name == (re.findall(r"int\d+", row[2]) or ["float64"])[0], name


def test_what_is_recorded_by_default_is_starred() -> None:
    [variables] = _tables("Variables")
    starred = [row[4].split("`")[1] for row in variables if row[4].endswith("*")]
    assert tuple(starred) == DEFAULT_RECORD


def test_every_way_to_end_is_described_with_its_number() -> None:
    [endings] = _tables("How a rollout ended")
    assert {row[1].strip("`"): int(row[0]) for row in endings} == STATUS


def test_every_attribute_is_described_and_no_other(layouts: list[Layout]) -> None:
    [attributes] = _tables("Attributes")
    assert _first_cells(attributes) == set(layouts[0].attributes)


def test_every_run_that_is_described_can_be_stored_and_opened_without_a_warning(
    layouts: list[Layout], tmp_path: Path
) -> None:
    for number, layout in enumerate(layouts):
        for name, data in make_metadata(layout).items():
            file = tmp_path / f"{number}.zarr" / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(data)
        with xr.open_zarr(tmp_path / f"{number}.zarr") as dataset:
            assert set(dataset.data_vars) == {variable.name for variable in layout.variables}
            assert set(dataset.coords) == {coordinate.name for coordinate in layout.coordinates}


def _commands() -> list[list[str]]:
    return [line.split() for line in re.findall(r"^    (dh2sim .*)$", PAGE, flags=re.MULTILINE)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the page's first command was run, for shorter rollouts."""
    folder = tmp_path_factory.mktemp("page")
    program, *arguments = _commands()[0]
    assert (program, arguments[0]) == ("dh2sim", "rollout")
    with contextlib.chdir(folder):
        run = dh2sim(*arguments, "--steps", "50", "--quiet")
    assert (run.status, run.err) == (0, "")
    return folder


def test_the_example_of_the_page_runs_and_has_five_lines(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    [code] = re.findall(r"^```python\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    assert len([line for line in code.splitlines() if line]) == 5
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(compile(code, "dataset.md", "exec"), {})
    lines = [line.split() for line in printed.getvalue().splitlines()]
    joints = [joint.name for joint in build_model(load_robot("stanford")).moving_joints]
    swings = {line[0]: float(line[1]) for line in lines if line[0] in joints}
    with xr.open_zarr("run.zarr") as run:
        assert (run["status"] == 0).all()
        for j, joint in enumerate(joints):
            expected = np.ptp(run["qpos"].values[:, :, j], axis=1).mean()
            assert swings[joint] == pytest.approx(expected, abs=1e-6)


def test_a_run_holds_what_the_page_says_of_times_and_files(folder: Path) -> None:
    text = load_robot("stanford").source_file
    with xr.open_zarr(folder / "run.zarr") as run:
        np.testing.assert_array_equal(run["time"], 0.002 * np.arange(51))
        np.testing.assert_array_equal(run["interval_time"], run["time"][:-1])
        assert text is not None
        assert run.attrs["robot_file"] == text.text
        assert run.attrs["robot_file_sha256"] == hashlib.sha256(text.text.encode()).hexdigest()
        assert run["status"].encoding["chunks"] == (64,)
        assert run["qpos"].encoding["chunks"] == (64, 51, 6)


def test_a_state_can_be_simulated_on_from_the_model_in_the_attributes(folder: Path) -> None:
    import mujoco

    [example] = re.findall(r"^    model = mujoco.*?\n\n", PAGE, flags=re.MULTILINE | re.DOTALL)
    code = "\n".join(line.removeprefix("    ") for line in example.splitlines()).replace("100", "10")
    with xr.open_zarr(folder / "run.zarr") as run:
        names: dict[str, object] = {"mujoco": mujoco, "run": run}
        exec(compile(code, "dataset.md", "exec"), names)
        model, data = names["model"], names["data"]
        data.ctrl = run["ctrl"][0, 10]  # type: ignore[attr-defined]
        mujoco.mj_step(model, data)
        # bits may differ in the first step, since the solver does not start from the step before
        np.testing.assert_allclose(data.qpos, run["qpos"][0, 11], rtol=0, atol=1e-9)  # type: ignore[attr-defined]


def test_the_conversions_of_the_page_make_the_files_that_it_names(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    before = set(contents(folder))
    for _, *arguments in _commands()[1:]:
        assert arguments[:2] == ["runs", "run.zarr"]
        assert dh2sim(*arguments).status == 0
    [tables] = _tables("Other formats")
    files = [row[0].strip("`") for row in tables]
    assert set(contents(folder)) - before == {*files, "run.h5"}
    rows = (["rollout", "step", "time", "joint"], ["rollout", "step", "time"], ["rollout"])
    for file, keys in zip(files, rows, strict=True):
        schema = pq.read_schema(file)
        assert schema.names[: len(keys)] == keys
        assert json.loads(schema.metadata[b"settings"])["steps"] == 50
    with xr.open_dataset("run.h5", engine="h5netcdf") as run:
        assert run.sizes["rollout"] == 64


def test_the_first_rollouts_of_a_long_run_are_those_of_a_short_one(folder: Path, tmp_path: Path) -> None:
    arguments = _commands()[0][1:]
    arguments[arguments.index("64")] = "5"
    arguments[arguments.index("run.zarr")] = str(tmp_path / "short.zarr")
    assert dh2sim(*arguments, "--steps", "50", "--quiet", "--threads", "1").status == 0
    with xr.open_zarr(folder / "run.zarr") as long, xr.open_zarr(tmp_path / "short.zarr") as short:
        for name in short.data_vars:
            assert short[name].values.tobytes() == long[name].values[:5].tobytes(), name
