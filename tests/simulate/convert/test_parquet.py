from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from dh2sim.simulate.convert import parquet
from dh2sim.simulate.convert.parquet import parquet_files, to_parquet
from dh2sim.simulate.dataset_layout import POSE, STATUS, TWIST, Layout
from tests.simulate.convert.samples import (
    ACTUATORS,
    AXES,
    BLOCK,
    JOINTS,
    LINKS,
    RECORDS,
    ROLLOUTS,
    STOP_RECORD,
    STOPPED,
    TOUCHED,
    Arrays,
    make_arrays,
    make_layout,
    write_run,
)

DRIVEN = {"shoulder": 0, "slide": 1}
"""Which actuator drives a joint."""

Rows = list[dict[str, Any]]


def _tables(run: Path, folder: Path) -> tuple[Rows, Rows, Rows]:
    joints, steps, rollouts = (pq.read_table(file).to_pylist() for file in to_parquet(run, folder / "out.parquet"))
    return joints, steps, rollouts


def _or_none(value: Any) -> Any:
    """A recorded number; None where nothing was recorded."""
    number = value.item()
    return None if (isinstance(number, float) and math.isnan(number)) or number == -1 else number


def test_a_row_of_joints_holds_what_was_recorded_of_that_rollout_step_and_joint(
    run: Path, arrays: Arrays, tmp_path: Path
) -> None:
    joints, _, _ = _tables(run, tmp_path)
    rows = iter(joints)
    for i in range(ROLLOUTS):
        for k in range(RECORDS + 1):
            for j, joint in enumerate(JOINTS):
                row = next(rows)
                last, driven = k == RECORDS, DRIVEN.get(joint)
                assert row == {
                    "rollout": i,
                    "step": k,
                    "time": 0.004 * k,
                    "joint": joint,
                    **{name: _or_none(arrays[name][i, k, j]) for name in ("qpos", "qvel", "qpos_ref")},
                    "ctrl": None if last or driven is None else _or_none(arrays["ctrl"][i, k, driven]),
                    "torque": None if last else _or_none(arrays["torque"][i, k, j]),
                }
    assert next(rows, None) is None


def test_a_row_of_steps_holds_what_was_recorded_of_the_whole_robot(run: Path, arrays: Arrays, tmp_path: Path) -> None:
    _, steps, _ = _tables(run, tmp_path)
    rows = iter(steps)
    for i in range(ROLLOUTS):
        for k in range(RECORDS + 1):
            expected: dict[str, Any] = {"rollout": i, "step": k, "time": 0.004 * k}
            for c, label in enumerate(POSE):
                expected[f"tool_{label}"] = _or_none(arrays["tool_pose"][i, k, c])
                expected[f"base_{label}"] = _or_none(arrays["base_pose"][i, k, c])
            for c, label in enumerate(TWIST):
                expected[f"base_{label}"] = _or_none(arrays["base_twist"][i, k, c])
            for c, label in enumerate(("potential", "kinetic")):
                expected[f"energy_{label}"] = _or_none(arrays["energy"][i, k, c])
            expected["contacts"] = None if k == RECORDS else _or_none(arrays["contacts"][i, k])
            assert next(rows) == expected
    assert next(rows, None) is None


def test_a_row_of_rollouts_tells_how_it_ended_and_what_was_its_own(run: Path, arrays: Arrays, tmp_path: Path) -> None:
    _, _, rollouts = _tables(run, tmp_path)
    assert rollouts == [
        {
            "rollout": i,
            "status": "bad_qacc" if i == STOPPED else "finished",
            "stop_step": 5 if i == STOPPED else None,
            "contact_step": 3 if i == TOUCHED else None,
            "contact_link_a": "base_link" if i == TOUCHED else "none",
            "contact_link_b": "link_3" if i == TOUCHED else "none",
            **{f"saturation_{name}": arrays["saturation"][i, c] for c, name in enumerate(ACTUATORS)},
            **{f"mass_scale_{name}": arrays["mass_scale"][i, c] for c, name in enumerate(LINKS)},
            **{f"gain_scale_{name}": arrays["gain_scale"][i, c] for c, name in enumerate(ACTUATORS)},
            **{
                f"com_offset_{name}_{axis}": arrays["com_offset"][i, c, k]
                for c, name in enumerate(LINKS)
                for k, axis in enumerate(AXES)
            },
        }
        for i in range(ROLLOUTS)
    ]


def test_columns_stand_in_the_order_in_which_people_look_for_them(run: Path, tmp_path: Path) -> None:
    files = to_parquet(run, tmp_path / "out.parquet")
    joints, steps, rollouts = (pq.read_schema(file).names for file in files)
    keys = ["rollout", "step", "time"]
    assert joints == [*keys, "joint", "qpos", "qvel", "qpos_ref", "ctrl", "torque"]
    assert steps[:10] == [*keys, *(f"tool_{label}" for label in POSE)]
    assert rollouts[:3] == ["rollout", "status", "stop_step"]


def test_what_was_not_recorded_is_null_and_not_a_nan(run: Path, tmp_path: Path) -> None:
    for file in to_parquet(run, tmp_path / "out.parquet"):
        for name, column in zip((table := pq.read_table(file)).column_names, table.columns, strict=True):
            if pa.types.is_floating(column.type):
                values = column.drop_null().to_numpy()
                assert np.isfinite(values).all(), name
    after = [row for row in pq.read_table(tmp_path / "out.parquet").to_pylist() if row["rollout"] == STOPPED]
    assert [row["qpos"] is None for row in after[:: len(JOINTS)]] == [k > STOP_RECORD for k in range(RECORDS + 1)]


def test_names_are_stored_once_and_read_by_pandas_as_categories(run: Path, tmp_path: Path) -> None:
    joints, _, rollouts = map(pd.read_parquet, to_parquet(run, tmp_path / "out.parquet"))
    assert list(joints["joint"].cat.categories) == list(JOINTS)
    assert list(rollouts["status"].cat.categories) == list(STATUS)
    assert (joints["qpos"].dtype, joints["step"].dtype) == (np.float64, np.int64)
    merged = joints.merge(rollouts, on="rollout")
    assert len(merged[merged["status"] == "finished"]) == (ROLLOUTS - 1) * (RECORDS + 1) * len(JOINTS)


def test_the_metadata_hold_units_and_all_attributes(run: Path, tmp_path: Path) -> None:
    expected = dict(make_layout().attributes)
    for file in to_parquet(run, tmp_path / "out.parquet"):
        reported = {key.decode(): value.decode() for key, value in pq.read_schema(file).metadata.items()}
        labels = {name: json.loads(reported.pop(name)) for name in ("joint", "joint_unit", "joint_lower", "actuator")}
        assert labels == {
            "joint": list(JOINTS),
            "joint_unit": ["rad", "rad", "m"],
            "joint_lower": [-2.0, None, 0.0],
            "actuator": list(ACTUATORS),
        }
        assert json.loads(reported.pop("actuator_unit")) == ["rad", "N"]
        assert {
            name: value if isinstance(expected[name], str) else json.loads(value) for name, value in reported.items()
        } == expected
    fields = pq.read_schema(tmp_path / "out.parquet")
    assert fields.field("qpos").metadata == {b"units": b"rad or m", b"long_name": b"qpos of the run"}
    assert fields.field("time").metadata == {b"units": b"s"}


def test_many_small_row_groups_hold_the_same_rows(run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = _tables(run, tmp_path / "whole")
    monkeypatch.setattr(parquet, "GROUP_ROWS", 16)
    assert _tables(run, tmp_path / "pieces") == whole
    groups = [pq.ParquetFile(file).num_row_groups for file in parquet_files(tmp_path / "pieces" / "out.parquet")]
    assert groups == [ROLLOUTS, 3, 3]


def test_rollouts_not_yet_run_are_null_and_say_so(unfinished: Path, tmp_path: Path) -> None:
    joints, steps, rollouts = _tables(unfinished, tmp_path)
    there = 2 * BLOCK
    assert [row["status"] for row in rollouts[there:]] == ["not_run"] * (ROLLOUTS - there)
    keys = {"rollout", "step", "time", "joint"}
    for rows, each in ((joints, len(JOINTS)), (steps, 1)):
        assert len(rows) == ROLLOUTS * (RECORDS + 1) * each
        rest = [row for row in rows if row["rollout"] >= there]
        assert all(value is None for row in rest for name, value in row.items() if name not in keys)


def test_a_block_that_was_never_committed_is_not_read(run: Path, arrays: Arrays, tmp_path: Path) -> None:
    torn = write_run(tmp_path / "torn.zarr", make_layout(), arrays)
    (torn / "blocks" / "record" / "c.1").unlink()
    (torn / "qpos" / "c.1.0.0").write_bytes(b"torn")
    _, _, rollouts = _tables(torn, tmp_path)
    assert [row["status"] for row in rollouts[BLOCK : 2 * BLOCK]] == ["not_run"] * BLOCK


def test_a_robot_without_actuators_has_no_controls(tmp_path: Path) -> None:
    layout = make_layout(actuators=())
    joints, _, rollouts = _tables(write_run(tmp_path / "run.zarr", layout, make_arrays(layout)), tmp_path)
    assert {row["ctrl"] for row in joints} == {None}
    assert not [name for name in rollouts[0] if name.startswith(("saturation", "gain_scale"))]


def test_a_table_of_which_nothing_was_recorded_has_no_rows(tmp_path: Path) -> None:
    whole = make_layout()
    few = Layout(
        sizes=whole.sizes,
        coordinates=whole.coordinates,
        variables=tuple(v for v in whole.variables if v.name in ("tool_pose", "status", "stop_step", "saturation")),
        attributes=whole.attributes,
        block=whole.block,
    )
    joints, steps, rollouts = _tables(write_run(tmp_path / "run.zarr", few, make_arrays(few)), tmp_path)
    assert (len(joints), len(steps), len(rollouts)) == (0, ROLLOUTS * (RECORDS + 1), ROLLOUTS)


def test_progress_of_a_parquet_conversion_advances_by_blocks(run: Path, tmp_path: Path) -> None:
    reported: list[int] = []
    to_parquet(run, tmp_path / "out.parquet", advance=reported.append)
    assert reported == [3, 3, 1]


@pytest.mark.parametrize(
    ("out", "names"),
    [
        ("a.parquet", ["a.parquet", "a.steps.parquet", "a.rollouts.parquet"]),
        ("b.c.pq", ["b.c.pq", "b.c.pq.steps.parquet", "b.c.pq.rollouts.parquet"]),
    ],
)
def test_the_tables_of_steps_and_rollouts_stand_beside_that_of_joints(out: str, names: list[str]) -> None:
    assert [path.as_posix() for path in parquet_files(Path("x") / out)] == [f"x/{name}" for name in names]
