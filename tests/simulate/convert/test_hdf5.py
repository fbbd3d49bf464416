from __future__ import annotations

import json
import math
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.simulate.convert.hdf5 import CHUNK_BYTES, chunk_shape, to_hdf5
from dh2sim.simulate.dataset_layout import NOT_RUN
from tests.simulate.convert.samples import BLOCK, JOINTS, ROLLOUTS, Arrays, make_arrays, make_layout, write_run


def _flat(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset with mappings among its attributes as JSON, and names as NumPy's own text."""
    named = {
        name: (c.dims, np.array([str(label) for label in c.values], dtype=str), c.attrs)
        for name, c in dataset.coords.items()
        if c.dtype.kind == "T"
    }
    flat = dataset.load().assign_coords(named)
    flat.attrs = {
        name: json.dumps(value) if isinstance(value, dict) else value for name, value in dataset.attrs.items()
    }
    return flat


def _read(file: Path) -> xr.Dataset:
    with xr.open_dataset(file, engine="h5netcdf") as opened:
        return opened.load()


def test_xarray_reads_the_same_dataset_from_hdf5_as_from_the_run(run: Path, tmp_path: Path) -> None:
    [file] = to_hdf5(run, tmp_path / "run.h5")
    xr.testing.assert_identical(_read(file), _flat(xr.open_zarr(run)))


def test_every_number_is_what_was_written_bit_for_bit(run: Path, arrays: Arrays, tmp_path: Path) -> None:
    [file] = to_hdf5(run, tmp_path / "run.h5")
    with h5py.File(file) as plain:
        for name, array in arrays.items():
            assert plain[name].dtype == array.dtype
            assert plain[name][()].tobytes() == array.tobytes(), name
        assert [label.decode() for label in plain["joint"]] == list(JOINTS)


def test_a_long_text_is_kept_whole(run: Path, tmp_path: Path) -> None:
    [file] = to_hdf5(run, tmp_path / "run.h5")
    mjcf = make_layout().attributes["mjcf"]
    assert len(mjcf) > 2**16  # what an HDF5 attribute holds by itself
    with h5py.File(file) as plain:
        assert plain.attrs["mjcf"] == mjcf
        assert plain.attrs["robot_file_sha256"] == ""
        assert json.loads(plain.attrs["settings"]) == make_layout().attributes["settings"]
        assert (plain.attrs["seed"], plain.attrs["timestep"]) == (0, 0.002)


def test_the_file_follows_the_conventions_of_netcdf(run: Path, tmp_path: Path) -> None:
    [file] = to_hdf5(run, tmp_path / "run.h5")
    with h5py.File(file) as plain:
        assert [scale.label for scale in plain["qpos"].dims] == [""] * 3
        assert [scale[0].name for scale in plain["qpos"].dims] == ["/rollout", "/step", "/joint"]
        assert plain["qpos"].attrs["coordinates"] == "time joint_unit joint_lower"
        status = plain["status"].attrs
        assert (status["flag_values"].dtype, len(status["flag_meanings"].split())) == (np.int8, 11)


def test_numbers_are_packed_in_whole_rollouts(run: Path, tmp_path: Path) -> None:
    [file] = to_hdf5(run, tmp_path / "run.h5")
    with h5py.File(file) as plain:
        qpos = plain["qpos"]
        assert (qpos.chunks, qpos.compression, qpos.shuffle) == ((BLOCK, 5, 3), "gzip", True)


def test_the_same_run_gives_the_same_bytes(run: Path, tmp_path: Path) -> None:
    [first], [second] = (to_hdf5(run, tmp_path / name) for name in ("a.h5", "b.h5"))
    assert first.read_bytes() == second.read_bytes()


def test_rollouts_not_yet_run_are_blank(unfinished: Path, tmp_path: Path) -> None:
    dataset = _read(to_hdf5(unfinished, tmp_path / "run.h5")[0])
    rest = dataset.isel(rollout=slice(2 * BLOCK, None))
    assert set(rest["status"].values) == {NOT_RUN}
    assert np.isnan(rest["qpos"]).all()
    assert (rest["contacts"] == -1).all()


def test_a_robot_without_actuators_has_an_empty_dimension(tmp_path: Path) -> None:
    layout = make_layout(actuators=())
    run = write_run(tmp_path / "run.zarr", layout, make_arrays(layout))
    dataset = _read(to_hdf5(run, tmp_path / "run.h5")[0])
    assert dataset.sizes["actuator"] == 0
    assert dataset["ctrl"].shape == (ROLLOUTS, 4, 0)


def test_progress_of_an_hdf5_conversion_advances_by_blocks(run: Path, tmp_path: Path) -> None:
    reported: list[int] = []
    to_hdf5(run, tmp_path / "run.h5", advance=reported.append)
    assert reported == [3, 3, 1]


@given(
    shape=st.lists(st.integers(1, 5000), min_size=1, max_size=3).map(tuple),
    itemsize=st.sampled_from([1, 4, 8]),
    block=st.integers(1, 3000),
)
def test_chunks_are_small_and_never_lie_across_blocks(shape: tuple[int, ...], itemsize: int, block: int) -> None:
    chunks = chunk_shape(shape, itemsize, block)
    assert len(chunks) == len(shape)
    assert all(1 <= chunk <= size for chunk, size in zip(chunks, shape, strict=True))
    assert min(block, shape[0]) % chunks[0] == 0
    assert chunks[2:] == shape[2:]
    assert itemsize * math.prod(chunks) <= max(CHUNK_BYTES, itemsize * math.prod(shape[2:]))


@pytest.mark.parametrize(
    ("shape", "block", "chunks"),
    [
        ((1024, 2001, 6), 256, (32, 2001, 6)),
        ((1024, 2001, 6), 17, (17, 2001, 6)),
        ((10, 1_000_000, 6), 1, (1, 87381, 6)),
        ((1024,), 256, (256,)),
        ((3,), 256, (3,)),
    ],
)
def test_chunks_hold_as_many_rollouts_as_fit(shape: tuple[int, ...], block: int, chunks: tuple[int, ...]) -> None:
    assert chunk_shape(shape, 8, block) == chunks
