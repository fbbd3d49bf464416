from __future__ import annotations

import random
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
import zarr

from dh2sim.errors import RunDamagedError, RunError
from dh2sim.simulate.dataset_layout import Layout
from dh2sim.simulate.description import summarize
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


def _replace_by_a_folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def _concerned(file: str) -> tuple[int, ...]:
    """The block that has to be simulated again, if any, when a file is damaged."""
    folder, _, name = file.rpartition("/")
    known = {variable.name for variable in SMALL.variables} | {"blocks/checksum"}
    return (int(name.split(".")[1]),) if folder in known and name.startswith("c.") else ()


@pytest.mark.slow
@pytest.mark.parametrize("damage", [_delete, _empty, _truncate, _flip, _lengthen])
def test_whatever_file_is_damaged_the_run_is_mended_and_no_other_block_is_simulated(
    tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    sound = contents(path)
    for file in sound:
        damage(path / file)
        assert resume(path, SMALL) == _concerned(file), file
        mended = contents(path)
        assert mended.keys() == sound.keys(), file
        different = {name for name in sound if mended[name] != sound[name]}
        assert different == ({file} if file.startswith("blocks/seconds/c") else set()), file
        (path / file).write_bytes(sound[file])  # nobody knows any more how long the block took


@pytest.mark.slow
def test_any_bit_of_the_root_may_flip(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    root = path / "zarr.json"
    sound = root.read_bytes()
    for at in range(0, 8 * len(sound), 8 * len(sound) // 40):
        data = bytearray(sound)
        data[at // 8] ^= 1 << (at // 8 + at) % 8
        root.write_bytes(data)
        assert resume(path, SMALL) == ()
        assert root.read_bytes() == sound, f"bit {at}"


def test_a_whole_folder_that_is_missing_is_made_again(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    sound = lasting(path)
    for folder in ("qpos", "joint", "blocks"):
        for file in sorted((path / folder).rglob("*"), reverse=True):
            file.unlink() if file.is_file() else file.rmdir()
        (path / folder).rmdir()
        assert resume(path, SMALL) == (() if folder == "joint" else (0, 1))
        assert lasting(path) == sound


def test_a_chunk_of_another_block_is_not_taken_for_this_ones(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", layout(rollouts=4, block=2))
    sound = lasting(path)
    (path / "qpos" / "c.1.0.0").write_bytes((path / "qpos" / "c.0.0.0").read_bytes())
    assert resume(path, layout(rollouts=4, block=2)) == (1,)
    assert lasting(path) == sound


def test_files_that_were_never_finished_are_removed(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    sound = contents(path)
    (path / "qpos" / ".c.0.0.0.partial").write_bytes(b"half")
    (path / ".zarr.json.partial").write_bytes(b"{")
    assert resume(path, SMALL) == ()
    assert contents(path) == sound


def test_what_was_made_when_and_how_stays(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    sound = contents(path)
    later = layout(
        rollouts=3, block=2, steps=2, created="2027-01-01T00:00:00+00:00", command="dh2sim rollout --resume"
    )
    assert resume(path, later) == ()
    assert contents(path) == sound
    (path / "zarr.json").unlink()
    assert resume(path, later) == ()
    assert contents(path) == sound


def test_attributes_that_a_user_added_stay(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    zarr.open_group(path, mode="r+").attrs["note"] = "for the paper"
    assert resume(path, SMALL) == ()
    assert open_dataset(path).attrs == {**SMALL.attributes, "note": "for the paper"}


def test_attributes_that_are_lost_in_both_copies_are_told_of(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    _empty(path / "zarr.json")
    _empty(path / "blocks" / "zarr.json")
    with pytest.raises(RunError) as caught:
        RunWriter.resume(path, SMALL)
    assert str(caught.value) == f"'{path}' is not a run of dh2sim; remove it yourself or choose another --out"


def test_damaged_attributes_are_not_mended_with_those_of_another_run(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    root = path / "zarr.json"
    root.write_bytes(root.read_bytes()[:-10])
    before = contents(path)
    with pytest.raises(RunDamagedError) as caught:
        RunWriter.resume(path, layout(rollouts=3, block=2, steps=2, robot="other"))
    assert str(caught.value) == (
        f"'{root}' is damaged. It can be mended with the options and versions that the run was made with; "
        "these are others, or too much is lost. Give the same, or write to another --out"
    )
    assert contents(path) == before


@pytest.mark.parametrize("look", [open_dataset, summarize], ids=["open_dataset", "summarize"])
def test_a_reader_is_told_how_damaged_metadata_are_mended(tmp_path: Path, look: Callable[[Path], object]) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    told = f"'{path}' is damaged; `dh2sim rollout` with the options it was made with and --resume mends it"
    _truncate(path / "zarr.json")
    with pytest.raises(RunDamagedError) as caught:
        look(path)
    assert str(caught.value) == told


def test_a_reader_of_any_damaged_file_gets_the_sound_numbers_or_an_error_for_users(tmp_path: Path) -> None:
    path = make(tmp_path / "run.zarr", SMALL)
    dataset = open_dataset(path).load()
    for number, file in enumerate(contents(path)):
        if file.startswith("blocks/"):
            continue
        damaged = copy(path, tmp_path / f"{number}.zarr")
        _truncate(damaged / file)
        with suppress(RunDamagedError), reading(damaged):
            assert open_dataset(damaged).load().identical(dataset), file
