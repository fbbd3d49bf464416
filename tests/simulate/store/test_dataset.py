from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray
import zarr
from zarr.codecs import BloscCodec, Crc32cCodec

from dh2sim.errors import RunDamagedError, RunError
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.store.reader import open_dataset, reading
from dh2sim.simulate.store.writer import RunWriter
from tests.simulate.store.runs import JOINTS, SECONDS, block_of, finish, lasting, layout, make, whole


def test_numbers_are_read_back_bit_for_bit(tmp_path: Path) -> None:
    of = layout()
    dataset = open_dataset(make(tmp_path / "run.zarr", of))
    for name, values in whole(of).items():
        read = dataset[name].to_numpy()
        assert read.dtype == values.dtype
        assert read.tobytes() == values.tobytes()


@pytest.mark.parametrize("how", ["open_zarr", "open_dataset"])
def test_plain_xarray_opens_a_run_with_its_dimensions_coordinates_and_attributes(tmp_path: Path, how: str) -> None:
    of = layout()
    path = make(tmp_path / "run.zarr", of)
    dataset = xarray.open_zarr(path) if how == "open_zarr" else xarray.open_dataset(path, engine="zarr")
    assert dict(dataset.sizes) == of.sizes
    assert list(dataset.data_vars) == [variable.name for variable in of.variables]
    assert sorted(dataset.coords) == sorted(coordinate.name for coordinate in of.coordinates)
    for variable in of.variables:
        assert dataset[variable.name].dims == variable.dimensions
        assert dataset[variable.name].attrs == variable.attributes
    for coordinate in of.coordinates:
        assert dataset[coordinate.name].dims == (coordinate.dimension,)
        assert dataset[coordinate.name].to_numpy().tolist() == list(np.asarray(coordinate.values).tolist())
        assert dataset[coordinate.name].attrs == coordinate.attributes
    assert dataset.attrs == of.attributes
    assert dataset.qpos.sel(joint=JOINTS[1], rollout=6).shape == (5,)


def test_open_dataset_returns_what_plain_xarray_returns(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout())
    assert open_dataset(str(path)).identical(xarray.open_zarr(path))


def test_chunks_are_those_that_zarr_itself_would_have_written(tmp_path: Path) -> None:
    of = layout()
    path = make(tmp_path / "run.zarr", of)
    for variable in of.variables:
        array = zarr.create_array(
            tmp_path / "zarr" / variable.name,
            shape=of.shape(variable),
            chunks=(of.block, *of.shape(variable)[1:]),
            dtype=variable.dtype,
            fill_value=variable.fill,
            compressors=[BloscCodec(cname="lz4", clevel=3, shuffle="shuffle"), Crc32cCodec()],
            config={"write_empty_chunks": True},
        )
        array[...] = whole(of)[variable.name]
        for block in range(of.blocks):
            rest = ["0"] * (len(variable.dimensions) - 1)
            theirs = tmp_path / "zarr" / variable.name / "/".join(["c", str(block), *rest])
            ours = path / variable.name / ".".join(["c", str(block), *rest])
            assert ours.read_bytes() == theirs.read_bytes()


def test_a_run_is_the_same_bytes_whatever_the_order_of_its_blocks(tmp_path: Path) -> None:
    of = layout()
    with RunWriter.create(tmp_path / "backwards.zarr", of) as writer:
        for block in reversed(range(of.blocks)):
            writer.write(block, block_of(of, block), SECONDS)
    assert lasting(tmp_path / "backwards.zarr") == lasting(make(tmp_path / "run.zarr", of))


@pytest.mark.parametrize("block", [1, 2, 7, 100])
def test_the_size_of_a_block_is_not_seen_in_the_dataset(tmp_path: Path, block: int) -> None:
    path = make(tmp_path / "run.zarr", layout(block=block))
    assert open_dataset(path).identical(open_dataset(make(tmp_path / "other.zarr", layout(block=3))))


def test_rollouts_that_are_not_run_yet_read_as_such(tmp_path: Path) -> None:
    of = layout()
    with RunWriter.create(tmp_path / "run.zarr", of) as writer:
        writer.write(1, block_of(of, 1), SECONDS)
        dataset = open_dataset(tmp_path / "run.zarr").load()
    assert dataset.status.values.tolist() == [-1, -1, -1, 0, 1 + 5, 0, -1]
    assert np.isnan(dataset.qpos.values[[0, 1, 2, 6]]).all()
    assert not np.isnan(dataset.qpos.values[[3, 5]]).any()
    assert dataset.contacts.dtype == np.int32
    assert dataset.status.dtype == np.int8


def test_a_robot_without_actuators_has_a_run(tmp_path: Path) -> None:
    of = layout()
    coordinates = tuple(one for one in of.coordinates if one.name != "actuator")
    none: list[str] = []
    actuators = replace(of.coordinates[6], values=none)
    of = replace(of, sizes={**of.sizes, "actuator": 0}, coordinates=(*coordinates, actuators))
    path = make(tmp_path / "run.zarr", of)
    dataset = xarray.open_zarr(path)
    assert dataset.ctrl.shape == (7, 4, 0)
    assert dataset.qpos.to_numpy().tobytes() == whole(of)["qpos"].tobytes()
    with RunWriter.resume(path, of) as writer:
        assert writer.pending() == ()


def test_numbers_that_zarr_gives_to_others_are_checked_by_them(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout())
    chunk = path / "qpos" / "c.1.0.0"
    data = bytearray(chunk.read_bytes())
    data[len(data) // 2] ^= 1
    chunk.write_bytes(data)
    dataset = open_dataset(path)
    with pytest.raises(RunDamagedError) as caught, reading(path):
        dataset.qpos.load()
    assert str(caught.value) == (
        f"'{path}' is damaged; resume it with the same options to compute the damaged blocks again"
    )


@pytest.mark.parametrize("missing", ["qpos/c.1.0.0", "status/c.2"])
def test_chunks_that_are_missing_are_not_read_as_blanks(tmp_path: Path, missing: str) -> None:
    path = make(tmp_path / "run.zarr", layout())
    (path / missing).unlink()
    with pytest.raises(RunDamagedError) as caught:
        open_dataset(path)
    assert str(caught.value).startswith(f"'{path}' is damaged; resume it")


@pytest.mark.parametrize("damage", [Path.unlink, lambda file: file.write_bytes(file.read_bytes()[:-1])])
def test_a_coordinate_that_is_damaged_is_named(tmp_path: Path, damage: Callable[[Path], object]) -> None:
    path = make(tmp_path / "run.zarr", layout())
    damage(path / "joint_unit" / "c.0")
    with pytest.raises(RunDamagedError) as caught:
        open_dataset(path)
    assert str(caught.value).startswith(f"'{path / 'joint_unit' / 'c.0'}' is missing or damaged and ")


def test_zarr_walks_a_run_without_a_warning_and_reads_its_records(tmp_path: Path) -> None:
    of = layout()
    with RunWriter.create(tmp_path / "run.zarr", of) as writer:
        writer.write(1, block_of(of, 1), SECONDS)
    names = {name for name, _ in zarr.open_group(tmp_path / "run.zarr", use_consolidated=False).members(None)}
    assert names == {*open_dataset(tmp_path / "run.zarr").variables, "blocks", "blocks/record"}
    records = np.asarray(zarr.open_array(tmp_path / "run.zarr" / "blocks" / "record")[:]).tolist()
    assert [records[0], records[2]] == ["", ""]
    record = json.loads(records[1])
    assert (record["block"], record["seconds"]) == (1, SECONDS)
    assert record["checksums"].keys() == {variable.name for variable in of.variables}


def test_what_is_no_run_is_not_opened(tmp_path: Path) -> None:
    with pytest.raises(RunError) as caught:
        open_dataset(tmp_path / "run.zarr")
    assert str(caught.value) == f"there is no '{tmp_path / 'run.zarr'}'"
    zarr.create_group(tmp_path / "other.zarr")
    for name in ("other.zarr", "."):
        with pytest.raises(RunError) as caught:
            open_dataset(tmp_path / name)
        assert str(caught.value) == f"'{tmp_path / name}' is not a run of dh2sim"


def _set(file: Path, attribute: str, value: object) -> None:
    node = json.loads(file.read_text())
    node["attributes"][attribute] = value
    file.write_text(json.dumps(node))


@pytest.mark.parametrize(
    ("file", "attribute", "known"), [("zarr.json", "dh2sim_run", 1), ("blocks/zarr.json", "dh2sim_store", 2)]
)
def test_a_run_of_another_version_is_not_opened(tmp_path: Path, file: str, attribute: str, known: int) -> None:
    path = make(tmp_path / "run.zarr", layout())
    _set(path / file, attribute, 9)
    reported = f"'{path}' was written by another version of dh2sim: its format is 9, and this version reads {known}"
    with pytest.raises(RunError) as caught:
        open_dataset(path)
    assert str(caught.value) == reported
    with pytest.raises(RunError) as caught:
        RunWriter.resume(path, layout())
    assert str(caught.value) == reported


def test_a_run_of_the_first_version_is_not_opened(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout())
    node = json.loads((path / "blocks" / "zarr.json").read_text())
    node["attributes"] = {"block": 3, "rollouts": 7, "own": {}, "names": [], "digest": "0" * 64}
    (path / "blocks" / "zarr.json").write_text(json.dumps(node))
    with pytest.raises(RunError, match="its format is 1, and this version reads 2"):
        open_dataset(path)


def test_a_block_of_more_than_a_chunk_holds_is_refused(tmp_path: Path) -> None:
    huge = layout(rollouts=100, block=100, steps=4_000_000)
    with pytest.raises(RunError) as caught:
        RunWriter.create(tmp_path / "run.zarr", huge)
    assert str(caught.value) == (
        "100 rollouts of 'qpos' take 6.0 GiB, but a chunk holds at most 2 GiB: record fewer states or "
        "simulate fewer steps"
    )
    assert not list(tmp_path.iterdir())


def test_arrays_of_a_wrong_shape_are_refused(tmp_path: Path) -> None:
    of: Layout = layout()
    with RunWriter.create(tmp_path / "run.zarr", of) as writer:
        with pytest.raises(ValueError, match=r"'qpos' must have the shape \(1, 5, 2\), got \(3, 5, 2\)"):
            writer.write(2, block_of(of, 0), SECONDS)
        assert finish(writer) == (0, 1, 2)
