from __future__ import annotations

import io
import os
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dh2sim.errors import ControllerError, Dh2simError
from dh2sim.input_files import NpyFile, csv_numbers, json_content, npz_arrays, read_input
from dh2sim.robot.read import load_robot
from dh2sim.simulate.controllers.recording import read_recording
from dh2sim.simulate.run import rollout


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_a_pipe_with_a_name_is_refused_instead_of_waited_for(tmp_path: Path) -> None:
    pipe = tmp_path / "robot.yaml"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match="is a named pipe, not a file"):
        read_input(pipe, 10)
    with pytest.raises(Dh2simError) as caught:
        load_robot(pipe)
    assert str(caught.value) == f"{pipe}: cannot be read: is a named pipe, not a file"


@pytest.mark.skipif(not os.path.exists("/dev/fd"), reason="the shell has no paths of pipes here")
def test_a_pipe_of_the_shell_is_read_to_its_end() -> None:
    read, write = os.pipe()
    os.write(write, b"content")
    os.close(write)
    try:
        assert read_input(Path(f"/dev/fd/{read}"), 100) == b"content"
    finally:
        os.close(read)


def test_a_file_that_is_larger_is_read_one_byte_further(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(bytes(100))
    assert len(read_input(tmp_path / "file", 10)) == 11


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
@pytest.mark.parametrize("option", ["start", "controller"])
def test_a_rollout_does_not_wait_for_a_pipe_with_a_name(tmp_path: Path, option: str) -> None:
    pipe = tmp_path / "states.csv"
    os.mkfifo(pipe)
    value = str(pipe) if option == "start" else f"replay:{pipe}"
    with pytest.raises(Dh2simError, match="is a named pipe, not a file"):
        rollout("planar_2r", rollouts=1, steps=1, **{option: value})  # type: ignore[arg-type]


MOST = 10_000


def npz(**arrays: Any) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def zipped(name: str, data: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, data)
    return stream.getvalue()


def changed(data: bytes, local: int, central: int, value: int) -> bytes:
    """Change a byte of the first entry of an archive, in both of its headers."""
    made = bytearray(data)
    made[local] = made[made.index(b"PK\x01\x02") + central] = value
    return bytes(made)


GOOD = npz(a=np.arange(6.0).reshape(2, 3), b=np.array(["x"]), c=np.zeros((0, 2)))


def test_arrays_come_back_from_files(tmp_path: Path) -> None:
    arrays = npz_arrays(GOOD, MOST)
    assert {name: array.tolist() for name, array in arrays.items()} == {
        "a": [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]],
        "b": ["x"],
        "c": [],
    }
    for array in (
        np.arange(6.0).reshape(2, 3),
        np.asfortranarray(np.ones((3, 2))),
        np.zeros((0, 2)),
        np.float64(3.0),
    ):
        np.save(tmp_path / "a.npy", array)
        np.testing.assert_array_equal(NpyFile(tmp_path / "a.npy").all(), array)


def header(text: bytes) -> bytes:
    return b"\x93NUMPY\x01\x00v\x00" + text.ljust(117) + b"\n"


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (b"", "it does not begin as one"),
        (header(b"(" * 117), "it does not begin as one"),
        (header(b"{'descr': '<f8', 'fortran_order': False, 'shape': (" + b"9" * 40 + b",)}"), "it is shorter than"),
        (header(b"{'descr': '<f8', 'fortran_order': False, 'shape': (-1, 6)}"), "it is shorter than it says"),
        (header(b"{'descr': '|O', 'fortran_order': False, 'shape': (1,)}"), "it contains Python objects"),
    ],
    ids=["empty", "endless", "huge", "negative", "objects"],
)
def test_a_file_that_is_no_array_is_refused(data: bytes, problem: str, tmp_path: Path) -> None:
    (tmp_path / "a.npy").write_bytes(data)
    with pytest.raises(ValueError, match=f"^is not a NumPy array: {problem}"):
        NpyFile(tmp_path / "a.npy")
    with pytest.raises(ValueError, match=f"^is not a NumPy archive: 'a.npy' is not a NumPy array: {problem}"):
        npz_arrays(zipped("a.npy", data), MOST)


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (b"", "is not a NumPy archive, or damaged"),
        (GOOD[:-30], "is not a NumPy archive, or damaged"),
        (changed(GOOD, 6, 8, 1), "is not a NumPy archive, or damaged"),
        (changed(GOOD, 8, 10, 99), "is not a NumPy archive, or damaged"),
        (zipped("a.npy", bytes(2**24)), "holds more than 1 MB"),
    ],
    ids=["empty", "cut off", "encrypted", "unknown method", "bomb"],
)
def test_a_damaged_archive_is_refused(data: bytes, problem: str) -> None:
    with pytest.raises(ValueError, match=f"^{problem}$"):
        npz_arrays(data, 2**20)


@pytest.mark.parametrize(
    ("read", "data", "problem"),
    [
        (csv_numbers, b"a,b\n1,\xff\n", "is not a CSV file: line 2 is not UTF-8: byte 0xff"),
        (csv_numbers, b"a\n" + b"1" * 199_999, "is not a CSV file: field larger than field limit"),
        (csv_numbers, b"a\n" + b"1," * 200_000, "is not a CSV file: line 2 has more than 200000 characters"),
        (csv_numbers, b"a," * 30_000, "has 30001 columns; at most 2000 are allowed"),
        (json_content, b"\xff\xfe{\0", "is not a JSON file: line 1 is not UTF-8: byte 0xff; it seems to be UTF-16"),
    ],
    ids=["bytes", "long cell", "long line", "wide", "UTF-16"],
)
def test_a_text_that_cannot_be_used_is_refused(read: Callable[[bytes], object], data: bytes, problem: str) -> None:
    with pytest.raises(ValueError, match=f"^{problem}"):
        read(data)


def test_numbers_of_csv_come_with_lines_as_in_the_file() -> None:
    found = csv_numbers(b"\xef\xbb\xbfa, b\r\n\r\n1,2\r\n , \r\n-3e1,nan\r\nx\r\n")
    assert found.header == ("a", "b")
    assert found.problems == (
        "line 5, column 'b': 'nan' is not a finite number",
        "line 6 has 1 values; the first line names 2 columns",
    )
    assert csv_numbers(b"a,b\n1,2\n3,4").values.tolist() == [[1.0, 2.0], [3.0, 4.0]]
    assert (
        csv_numbers(b"a,b\n").problems == csv_numbers(b"").problems == ("there are no values below the first line",)
    )


@pytest.mark.parametrize("line", [b"1\n", b"x\n", b"1,1\n", b"\n"])
def test_a_csv_of_many_short_lines_takes_little_memory(line: bytes) -> None:
    data = b"a\n" + line * (100_000 // len(line))
    tracemalloc.start()
    csv_numbers(data)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 12 * len(data) + 10**6


def test_an_array_whose_file_becomes_shorter_is_refused_while_it_is_read(tmp_path: Path) -> None:
    for array in (np.ones((4, 1000)), np.asfortranarray(np.ones((4, 1000)))):
        np.save(tmp_path / "a.npy", array)
        found = NpyFile(tmp_path / "a.npy")
        np.testing.assert_array_equal(found.rows(1, 3), array[1:3])
        os.truncate(tmp_path / "a.npy", 20_000)
        with pytest.raises(ValueError, match="became shorter while it was read"):
            found.rows(3, 4)


@pytest.mark.parametrize("how", ["shorter", "altered", "gone"])
def test_a_recording_that_changes_while_it_is_replayed_is_refused(how: str, tmp_path: Path) -> None:
    file = tmp_path / "controls.npy"
    np.save(file, np.arange(24.0).reshape(4, 3, 2))
    recording = read_recording(str(file), "ctrl")
    np.testing.assert_array_equal(recording.read(range(1, 3)), np.arange(24.0).reshape(4, 3, 2)[1:3])
    if how == "shorter":
        os.truncate(file, 150)
    elif how == "altered":
        np.save(file, np.ones((4, 3, 2)))
    else:
        file.unlink()
    with pytest.raises(ControllerError, match=r"^'.*controls.npy' was changed while it was replayed"):
        recording.read(range(2, 4))
