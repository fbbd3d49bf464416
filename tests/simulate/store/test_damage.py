from __future__ import annotations

import random
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
import zarr

from dh2sim.errors import CalibrationError, RunDamagedError, RunError
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.description import describe
from dh2sim.simulate.store.reader import open_dataset, reading
from dh2sim.simulate.store.writer import RunWriter
from tests.program import contents
from tests.simulate.store.runs import copy, lasting, layout, make, resume

SMALL: Layout = layout(rollouts=3, block=2, steps=2)


def _delete(path: Path) -> None:
    path.unlink()


def _empty(path: Path) -> None:
    path.write_bytes(b"")


def _truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-3])


def _flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    at = random.Random(path.name).randrange(8 * len(data))
    data[at // 8] ^= 1 << at % 8
    path.write_bytes(data)


def _lengthen(path: Path) -> None:
    path.write_bytes(path.read_bytes() + b"\0")


def _block_of(file: str) -> int | None:
    """The block that a file belongs to; None for metadata and coordinates."""
    folder, _, name = file.rpartition("/")
    known = {variable.name for variable in SMALL.variables} | {"blocks/record"}
    return int(name.split(".")[1]) if folder in known and name.startswith("c.") else None


DAMAGES = [_delete, _empty, _truncate, _flip, _lengthen]


@pytest.mark.slow
@pytest.mark.parametrize("damage", DAMAGES)
def test_whatever_file_of_a_block_is_damaged_that_block_alone_is_computed_again(
    tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    sound = contents(path)
    for file in sound:
        block = _block_of(file)
        if block is not None:
            damage(path / file)
            assert resume(path, SMALL) == (block,), file
            assert contents(path) == sound, file


@pytest.mark.slow
@pytest.mark.parametrize("damage", DAMAGES)
def test_whatever_metadata_are_damaged_the_file_is_named_and_nothing_changes(
    tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    sound = contents(path)
    for file in sound:
        if _block_of(file) is None:
            damage(path / file)
            before = contents(path)
            with pytest.raises(RunError) as caught:
                RunWriter.resume(path, SMALL)
            assert f"'{path / file}'" in str(caught.value), file
            assert contents(path) == before, file
            (path / file).write_bytes(sound[file])
    assert resume(path, SMALL) == ()


def test_damaged_metadata_can_be_computed_again_elsewhere(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    sound = lasting(path)
    _empty(path / "zarr.json")
    with pytest.raises(RunDamagedError) as caught:
        RunWriter.resume(path, SMALL)
    assert str(caught.value) == (
        f"'{path / 'zarr.json'}' is missing or damaged and cannot be restored; "
        "resume with the same options in a new folder, which computes the same bits"
    )
    assert resume(tmp_path / "new.zarr", SMALL) == (0, 1)
    assert lasting(tmp_path / "new.zarr") == sound


@pytest.mark.slow
def test_no_bit_of_the_root_that_flips_is_read_as_something_else(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    root = path / "zarr.json"
    sound, dataset = root.read_bytes(), open_dataset(path).load()
    for at in range(0, 8 * len(sound), 8 * len(sound) // 200):
        data = bytearray(sound)
        data[at // 8] ^= 1 << (at // 8 + at) % 8
        root.write_bytes(data)
        try:
            read = open_dataset(path).load()
        except RunError:
            with pytest.raises(RunError):
                RunWriter.resume(path, SMALL)
        else:  # a blank, or an attribute that is none of the run's
            assert read.drop_attrs().identical(dataset.drop_attrs()), f"bit {at}"
            assert read.attrs.items() >= dataset.attrs.items(), f"bit {at}"


def test_a_block_whose_folder_is_missing_does_not_pass(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    for folder in ("qpos", "joint", "blocks"):
        (path / folder).rename(tmp_path / folder)
        with pytest.raises(RunDamagedError, match=f"'{path / folder}/zarr.json' is missing or damaged"):
            RunWriter.resume(path, SMALL)
        (tmp_path / folder).rename(path / folder)


def test_a_chunk_or_a_record_of_another_block_is_not_taken_for_this_ones(tmp_path: Path) -> None:
    of = layout(rollouts=4, block=2)
    path = make(tmp_path / "run.zarr", of)
    sound = lasting(path)
    for name in ("qpos/c.{}.0.0", "blocks/record/c.{}"):
        (path / name.format(1)).write_bytes((path / name.format(0)).read_bytes())
        assert resume(path, of) == (1,)
        assert lasting(path) == sound


def test_a_record_of_another_run_does_not_commit_a_block(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    other = make(tmp_path / "other.zarr", layout(rollouts=3, block=2, steps=2, settings={"seed": 1}))
    sound = contents(path)
    (path / "blocks" / "record" / "c.0").write_bytes((other / "blocks" / "record" / "c.0").read_bytes())
    assert describe(path).blocks_done == 1
    assert resume(path, SMALL) == (0,)
    assert contents(path) == sound


def test_files_that_were_never_finished_are_removed(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    sound = contents(path)
    (path / "qpos" / ".c.0.0.0.partial").write_bytes(b"half")
    (path / "blocks" / "record" / ".c.0.partial").write_bytes(b"{")
    assert resume(path, SMALL) == ()
    assert contents(path) == sound


def test_a_resumed_run_keeps_its_time_and_command(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    sound = contents(path)
    later = layout(
        rollouts=3, block=2, steps=2, created="2027-01-01T00:00:00+00:00", command="dh2sim rollout --resume"
    )
    (path / "qpos" / "c.0.0.0").unlink()
    assert resume(path, later) == (0,)
    assert contents(path) == sound


def test_attributes_that_a_user_added_stay(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    zarr.open_group(path, mode="r+").attrs["note"] = "for the paper"
    assert resume(path, SMALL) == ()
    assert open_dataset(path).attrs == {**SMALL.attributes, "note": "for the paper"}


def test_a_folder_that_has_lost_all_signs_of_a_run_is_none(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    _empty(path / "zarr.json")
    _empty(path / "blocks" / "zarr.json")
    with pytest.raises(RunError) as caught:
        RunWriter.resume(path, SMALL)
    assert str(caught.value) == f"'{path}' is not a run of dh2sim"


@pytest.mark.parametrize("look", [open_dataset, describe], ids=["open_dataset", "describe"])
@pytest.mark.parametrize("file", ["zarr.json", "blocks/zarr.json", "joint/c.0"])
def test_a_reader_names_the_metadata_that_are_damaged(
    tmp_path: Path, look: Callable[[Path], object], file: str
) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    _truncate(path / file)
    with pytest.raises(RunDamagedError) as caught:
        look(path)
    assert str(caught.value).startswith(f"'{path / file}' is missing or damaged and ")


def test_metadata_that_do_not_belong_together_are_both_named(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    other = make(tmp_path / "other.zarr", layout(rollouts=3, block=2, steps=2, robot="other"))
    (path / "zarr.json").write_bytes((other / "zarr.json").read_bytes())
    with pytest.raises(RunDamagedError) as caught:
        open_dataset(path)
    assert str(caught.value).startswith(
        f"'{path / 'zarr.json'}' or '{path / 'blocks' / 'zarr.json'}' is missing or damaged and "
    )


@pytest.mark.slow
def test_a_reader_of_any_damaged_file_gets_the_sound_numbers_or_an_error_for_users(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    dataset = open_dataset(path).load()
    for number, file in enumerate(contents(path)):
        if file.startswith("blocks/record/c."):
            continue
        damaged = copy(path, tmp_path / f"{number}.zarr")
        _truncate(damaged / file)
        with suppress(RunDamagedError), reading(damaged):
            assert open_dataset(damaged).load().identical(dataset), file


def test_what_is_wrong_with_a_use_of_a_run_is_not_called_damage(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match="its joints are others"), reading(tmp_path):
        raise CalibrationError("its joints are others")
