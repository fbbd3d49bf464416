from __future__ import annotations

from pathlib import Path

import jsonschema
import numpy as np
import pytest
from ruamel.yaml import YAML

from dh2sim import plan_trajectory, read_trajectory
from dh2sim.errors import OutputError, SettingsError, TrajectoryError
from dh2sim.trajectory.files import SUFFIXES
from dh2sim.trajectory.waypoints import waypoint_schema
from tests.refusals import refusal
from tests.sample_robots import NAMES, model


@pytest.mark.parametrize("name", NAMES)
def test_files_of_every_robot_read_back_as_the_same_numbers(name: str, tmp_path: Path) -> None:
    home = np.array(model(name).home)
    lower, upper = model(name).travel
    planned = plan_trajectory(
        model(name), [home, home + 0.1 * (0.5 * (lower + upper) - home) + 1e-3 * (upper - home)]
    )
    for suffix in (".csv", ".npz"):
        planned.save(tmp_path / f"motion{suffix}", rate=200.0)
        read = read_trajectory(tmp_path / f"motion{suffix}")
        states = planned.at(read.time)
        assert read.joints == planned.joints
        assert read.q.tolist() == states[0].tolist()
        assert read.duration == planned.duration
        if suffix == ".npz":
            for given, found in zip((read.qd, read.qdd, read.qddd), states[1:], strict=True):
                assert given is not None
                assert given.tolist() == found.tolist()
            assert (read.robot, read.turns) == (name, planned.limits.turns)


@pytest.mark.parametrize(("suffix", "allowed"), [(".npz", 1e-9), (".csv", 1e-6)])
def test_between_samples_the_motion_is_that_of_the_trajectory(tmp_path: Path, suffix: str, allowed: float) -> None:
    planned = plan_trajectory(model("puma560"), ["home", "zero", "home"])
    planned.save(tmp_path / f"motion{suffix}")
    t = np.random.default_rng(0).uniform(0.0, planned.duration, 500)
    q = read_trajectory(tmp_path / f"motion{suffix}").at(t)[0]
    np.testing.assert_allclose(q, planned.at(t)[0], atol=allowed)


def test_a_trajectory_is_written_as_the_same_bytes_and_over_nothing(tmp_path: Path) -> None:
    planned = plan_trajectory(model("scara"), ["home", "zero"])
    for suffix in (".csv", ".npz"):
        one, other = tmp_path / f"one{suffix}", tmp_path / f"other{suffix}"
        planned.save(one, samples=50)
        planned.save(other, samples=50)
        assert one.read_bytes() == other.read_bytes()
        with pytest.raises(OutputError, match=r"already exists; choose another name, or pass overwrite=True"):
            planned.save(one)
    with pytest.raises(SettingsError, match=r"out must end in .csv or .npz, got"):
        planned.save(tmp_path / "motion.txt")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "the first line must be 'time' and the names of joints"),
        ("joint_1,joint_2\n0,0\n", "the first line must be 'time' and the names of joints"),
        ("time,a,a\n0,1,2\n", "names a more than once"),
        ("time,a\n", "there are no values below the first line"),
        ("time,a\n0,1\n0.1\n", "line 3 has 1 values; the first line names 2 columns"),
        ("time,a\n0,x\n", "line 2, column 'a': 'x' is not a finite number"),
        ("time,a\n0,nan\n", "line 2, column 'a': 'nan' is not a finite number"),
        ("time,a\n1,1\n", "time must start at 0, got 1.0"),
        ("time,a\n0,1\n1,1\n1,2\n", "time must increase from row to row; 1.0 comes after 1.0"),
    ],
)
def test_a_table_that_is_no_trajectory_is_refused_with_the_line(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "motion.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(TrajectoryError) as refused:
        read_trajectory(file)
    assert said in str(refused.value)
    assert str(file) in str(refused.value)


@pytest.mark.parametrize(
    ("arrays", "said"),
    [
        ({"time": [0.0, 1.0]}, "lacks the arrays q, joints; it has time"),
        (
            {"time": [0.0, 1.0], "q": [[1.0]], "joints": ["a"]},
            "q must be real numbers of shape (2, 1), got float64 of (1, 1)",
        ),
        ({"time": [0.0], "q": [[np.inf]], "joints": ["a"]}, "q must hold finite numbers"),
        ({"time": [0.0], "q": [[1.0, 2.0]], "joints": ["a", "a"]}, "joints must have different names"),
        ({"time": [0.0], "q": [["x"]], "joints": ["a"]}, "q must be real numbers"),
    ],
)
def test_an_archive_that_is_no_trajectory_is_refused(tmp_path: Path, arrays: dict[str, object], said: str) -> None:
    file = tmp_path / "motion.npz"
    np.savez(file, **arrays)  # type: ignore[arg-type]
    with pytest.raises(TrajectoryError) as refused:
        read_trajectory(file)
    assert said in str(refused.value)
    file.write_bytes(b"PK nothing")
    with pytest.raises(TrajectoryError, match="is not a NumPy archive"):
        read_trajectory(file)


def test_a_file_that_could_not_be_read_again_is_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    planned = plan_trajectory(model("scara"), ["home", "zero"])
    monkeypatch.setattr("dh2sim.trajectory.files.MOST_BYTES", 1000)
    for suffix in SUFFIXES:
        assert "larger than 0 MB: take fewer samples" in refusal(OutputError, planned.save, tmp_path / f"a{suffix}")
    assert not list(tmp_path.iterdir())


def test_samples_end_where_the_trajectory_does() -> None:
    planned = plan_trajectory(model("scara"), ["home", "zero"], duration=1.0)
    assert len(planned.sample(rate=10.0).time) == 11
    assert planned.sample(rate=3.0).time.tolist() == pytest.approx([0.0, 1 / 3, 2 / 3, 1.0])
    assert planned.sample(samples=2).time.tolist() == [0.0, planned.duration]
    for wrong in ({"rate": 0.0}, {"rate": 1e12}, {"samples": 1}, {"rate": 1.0, "samples": 5}):
        with pytest.raises(SettingsError):
            planned.sample(**wrong)


def test_the_schema_of_waypoint_files_takes_what_the_reader_takes() -> None:
    schema = waypoint_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    valid = jsonschema.Draft202012Validator(schema).is_valid
    page = YAML(typ="safe", pure=True).load(Path("docs/waypoints.yaml").read_text(encoding="utf-8"))
    assert valid(page)
    assert schema["properties"]["profile"]["$ref"] == "#/$defs/Profile"
    assert "default" not in schema["$defs"]["WaypointUnitsEntry"]["properties"]["angle"]
    for point in ("home", [1, 2], {"q": "home", "stop": False}, {"xyz": [1, "2 * lift", 3], "rpy": [0, 0, 0]}):
        assert valid({"waypoints": [point, "zero"], "limits": {"jerk": {"joint_1": "50%"}, "tool_speed": 2}})
    for wrong in (
        {"waypoints": [{"xyz": [1, 2]}, "home"]},
        {"waypoints": [{"foo": 1}, "home"]},
        {"waypoints": ["home", "zero"], "limits": {"speed": 1}},
        {"waypoints": ["home", "zero"], "kind": "spline"},
        {"kind": "line"},
    ):
        assert not valid(wrong), wrong
