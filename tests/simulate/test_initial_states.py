from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dh2sim.errors import SettingsError
from dh2sim.simulate import rollout
from dh2sim.simulate.initial_states import InitialStates, read_initial_states
from tests.refusals import refusal

JOINTS = ("joint_1", "slide")
CONFIGURATIONS = {"home": np.array([0.1, 0.2]), "zero": np.zeros(2), "folded": np.array([0.3, 0.4])}
COLUMNS = "Columns are joints, rad or m, and optionally slide_velocity and so on"


def read(text: str | Path, rollouts: int = 3) -> InitialStates:
    return read_initial_states(str(text), JOINTS, CONFIGURATIONS, rollouts)


refused = partial(refusal, SettingsError, read)


@pytest.fixture
def csv(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str | bytes], str]:
    """Write a file of the current folder and return its name."""
    monkeypatch.chdir(tmp_path)

    def write(text: str | bytes) -> str:
        Path("s.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
        return "s.csv"

    return write


@pytest.fixture
def npy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., str]:
    monkeypatch.chdir(tmp_path)

    def write(array: Any, **how: Any) -> str:
        np.save("s.npy", array, **how)
        return "s.npy"

    return write


def test_random_states_are_not_given() -> None:
    start = read("random")
    assert (start.name, start.given, start.digest) == ("random", None, "")


@pytest.mark.parametrize("name", ["home", "zero"])
def test_home_and_zero_are_the_robots_and_need_no_digest(name: str) -> None:
    start = read(name)
    assert start.given is not None
    assert start.given.tolist() == [[CONFIGURATIONS[name].tolist(), [0.0, 0.0]]]
    assert (start.name, start.digest) == (name, "")


def test_a_configuration_is_a_state_at_rest_for_all() -> None:
    start = read("folded")
    assert start.given is not None
    assert start.given.tolist() == [[[0.3, 0.4], [0.0, 0.0]]]
    assert start.digest == hashlib.sha256(start.given.tobytes()).hexdigest()
    assert not start.given.flags.writeable


def test_a_csv_file_names_joints_in_any_order(csv: Callable[[str], str]) -> None:
    start = read(csv("slide, joint_1\n0.5,1e-1\n\n-0.25,-2\n0,0\n"))
    assert start.given is not None
    assert start.name == "s.csv"
    assert start.given[:, 0].tolist() == [[0.1, 0.5], [-2.0, -0.25], [0.0, 0.0]]
    assert not start.given[:, 1].any()


def test_a_csv_file_may_give_velocities(csv: Callable[[str | bytes], str]) -> None:
    start = read(csv("\ufeffjoint_1,slide,slide_velocity\r\n1,2,3\r\n".encode()))
    assert start.given is not None
    assert start.given.tolist() == [[[1.0, 2.0], [0.0, 3.0]]]


@pytest.mark.parametrize(
    ("array", "states"),
    [
        (np.array([1.0, 2.0]), [[[1, 2], [0, 0]]]),
        (np.array([1, 2]), [[[1, 2], [0, 0]]]),
        (np.array([[1.0, 2.0]] * 3, dtype=np.float32), [[[1, 2], [0, 0]]] * 3),
        (np.asfortranarray(np.arange(12.0).reshape(3, 2, 2)), np.arange(12.0).reshape(3, 2, 2).tolist()),
        (np.arange(4.0).reshape(1, 2, 2), [[[0, 1], [2, 3]]]),
    ],
    ids=["one", "integers", "positions", "states", "one state"],
)
def test_an_npy_file_holds_positions_or_states(array: Any, states: Any, npy: Callable[..., str]) -> None:
    start = read(npy(array))
    assert start.given is not None
    assert start.given.dtype == np.float64
    assert start.given.tolist() == states


def test_the_same_states_have_the_same_digest(csv: Callable[[str], str], npy: Callable[..., str]) -> None:
    assert read(csv("joint_1,slide\n1,2\n")).digest == read(npy(np.array([1.0, 2.0]))).digest
    assert read(csv("joint_1,slide\n1,2\n")).digest != read(npy(np.array([1.0, 2.5]))).digest


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("fold", ". Did you mean 'folded'?"),
        ("here", ""),
        ("", ""),
        ("s.txt", ""),
    ],
)
def test_an_unknown_start_is_refused_with_those_that_are_known(text: str, words: str) -> None:
    assert refused(text) == (
        f"start must be one of home, zero, random, folded, or a .csv or .npy file of joint positions, got {text!r}"
        f"{words}"
    )


@pytest.mark.parametrize("name", ["s.csv", "s.npy", "no/such/s.CSV"])
def test_a_file_that_is_not_there_is_named(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    assert refused(path) == f"start {path}: cannot be read: No such file or directory"


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    (tmp_path / "s.csv").mkdir()
    assert refused(tmp_path / "s.csv") == f"start {tmp_path / 's.csv'}: cannot be read: Is a directory"


@pytest.mark.parametrize(
    ("text", "problems"),
    [
        ("", ["1: missing column 'joint_1'", "1: missing column 'slide'"]),
        ("joint_1\n1\n", ["1: missing column 'slide'"]),
        (
            "joint_1,slid,turn\n0,0,0\n",
            [
                "1: unknown column 'slid'. Did you mean 'slide'?",
                "1: unknown column 'turn'.",
                "1: missing column 'slide'",
            ],
        ),
        ("joint_1,slide,joint_1\n0,0,0\n", ["1: duplicate column 'joint_1'"]),
    ],
)
def test_every_wrong_column_is_reported(text: str, problems: list[str], csv: Callable[[str], str]) -> None:
    found = refused(csv(text)).splitlines()
    assert found == [*(f"start s.csv:{problem}" for problem in problems), COLUMNS]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("joint_1,slide\n1,2\n\n1\n", ": line 4 has 1 values; the first line names 2 columns"),
        ("joint_1,slide\n1,2\n1,2,3\n", ": line 3 has 3 values; the first line names 2 columns"),
        ("joint_1,slide\n1,2\n\n1,two\n", ": line 4, column 'slide': 'two' is not a finite number"),
        ("joint_1,slide\n1,\n", ": line 2, column 'slide': '' is not a finite number"),
        ("joint_1,slide\n1,2\ninf,2\n0,0\n", ": line 3, column 'joint_1': 'inf' is not a finite number"),
        ("joint_1,slide\n1,nan\n", ": line 2, column 'slide': 'nan' is not a finite number"),
        ("joint_1,slide\n", ": there are no values below the first line"),
        ("joint_1,slide\n1,2\n1,2\n", ": must contain 1 state, or one for each of 3 rollouts, got 2"),
    ],
)
def test_a_wrong_cell_is_reported_with_its_place(text: str, words: str, csv: Callable[[str], str]) -> None:
    assert refused(csv(text)) == f"start s.csv{words}"


@pytest.mark.parametrize("data", [b"\xff\xfe\x00j", b"joint_1,slide\n0," + b"1" * 200_000], ids=["bytes", "long"])
def test_what_is_no_text_or_has_endless_cells_is_no_csv_file(data: bytes, csv: Callable[[bytes], str]) -> None:
    assert refused(csv(data)).startswith("start s.csv: is not a CSV file: ")


@pytest.mark.parametrize(
    ("array", "found"),
    [
        (np.zeros((3, 3)), "float64 of shape (3, 3)"),
        (np.zeros((3, 3, 2)), "float64 of shape (3, 3, 2)"),
        (np.zeros(()), "float64 of shape ()"),
        (np.array(["1", "2"]), "<U1 of shape (2,)"),
        (np.zeros(2, dtype=complex), "complex128 of shape (2,)"),
        (np.zeros(2, dtype=bool), "bool of shape (2,)"),
    ],
    ids=str,
)
def test_an_array_of_another_shape_or_kind_is_refused(array: Any, found: str, npy: Callable[..., str]) -> None:
    assert refused(npy(array)) == (
        "start s.npy: must contain numbers of shape (2,) or (rollouts, 2), joint positions in rad and m, or "
        f"(rollouts, 2, 2), positions and velocities; got {found}"
    )


def test_an_array_of_as_many_states_as_rollouts_or_one_is_wanted(npy: Callable[..., str]) -> None:
    name = npy(np.zeros((4, 2)))
    assert read(name, 4).given is not None
    assert refused(name) == "start s.npy: must contain 1 state, or one for each of 3 rollouts, got 4"


def test_no_code_hides_in_an_array(npy: Callable[..., str]) -> None:
    assert refused(npy(np.array([None, 1]), allow_pickle=True)) == (
        "start s.npy: is not a NumPy array: it contains Python objects, which are not read"
    )


HUGE = "{'descr': '<f8', 'fortran_order': False, 'shape': (100000000000000, 2), }"


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"PK\x03\x04rubbish",
        b"\x93NUMPY\x01\x00v\x00" + HUGE.ljust(117).encode() + b"\n",
        b"\x93NUMPY\x01\x00v\x00{",
    ],
    ids=["empty", "archive", "huge", "cut off"],
)
def test_a_file_that_is_no_array_is_refused(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "s.npy"
    path.write_bytes(data)
    found = refused(path)
    assert found.startswith(f"start {path}: is not a NumPy array: ")
    assert "\n" not in found


def test_an_archive_of_arrays_is_refused(tmp_path: Path) -> None:
    with (tmp_path / "s.npy").open("wb") as stream:
        np.savez(stream, q=np.zeros(2))
    assert refused(tmp_path / "s.npy").startswith(f"start {tmp_path / 's.npy'}: is not a NumPy array: ")


def test_rollouts_start_at_the_states_of_a_file(tmp_path: Path) -> None:
    states = np.random.default_rng(1).uniform(-0.5, 0.5, (4, 2, 2))
    np.save(tmp_path / "s.npy", states)
    run = rollout("planar_2r", rollouts=4, steps=1, start=str(tmp_path / "s.npy"))
    assert np.array_equal(run.qpos.values[:, 0], states[:, 0])
    assert np.array_equal(run.qvel.values[:, 0], states[:, 1])


def test_a_state_outside_the_limits_is_found_with_its_rollout(tmp_path: Path) -> None:
    path = tmp_path / "s.npy"
    np.save(path, [[0.0, 0.0], [0.0, 9.0]])
    with pytest.raises(SettingsError) as caught:
        rollout("planar_2r", rollouts=2, steps=1, start=str(path))
    assert str(caught.value) == (
        f"start {path}: joint_2 of rollout 1 would start at 9 rad, outside its limits -2.79253 to 2.79253 rad"
    )
