from __future__ import annotations

import base64
import hashlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dh2sim.errors import OutputError, RunDamagedError
from dh2sim.sweep.journal import MOST_LINE, Journal
from tests.program import dh2sim
from tests.sweep.test_sweep import sweep

SETTINGS = {"robot": "arm", "seed": 0}
ROWS = [[0.1, float("inf")], [-0.0, 1e-308]]


def begun(folder: Path, settings: dict[str, Any] = SETTINGS) -> tuple[Path, Path]:
    """Return a table's path and its journal, which has two chunks."""
    out = folder / "arms.csv"
    with Journal.open(out, settings, overwrite=False) as journal:
        journal.add(0, ["reach"], ROWS)
        journal.add(1, ["reach"], ROWS)
    return out, folder / "arms.csv.journal"


def forged(path: Path, line: int, **changes: object) -> None:
    """Change what is in a line of a journal, and sign it anew, as whoever knows how can."""
    lines = path.read_bytes().splitlines()
    value = {**json.loads(lines[line][65:]), **changes}
    content = json.dumps(value).encode()
    key = lines[0][:64] if line else b""
    lines[line] = hashlib.sha256(key + content).hexdigest().encode() + b" " + content
    path.write_bytes(b"\n".join(lines) + b"\n")


def test_numbers_come_back_to_the_bit(tmp_path: Path) -> None:
    out, _ = begun(tmp_path)
    with Journal.open(out, SETTINGS, overwrite=False) as journal:
        assert (journal.length(0), journal.length(1), journal.length(2)) == (2, 2, 0)
        assert np.array(journal.rows(1)).tobytes() == np.array(ROWS).tobytes()


@pytest.mark.parametrize("kept", range(0, 400, 23))
def test_a_journal_that_was_cut_off_anywhere_is_continued(tmp_path: Path, kept: int) -> None:
    out, path = begun(tmp_path)
    path.write_bytes(path.read_bytes()[:kept])
    with Journal.open(out, SETTINGS, overwrite=False) as journal:
        journal.add(1, ["reach"], ROWS)
        assert journal.rows(1) == ROWS


@pytest.mark.parametrize("place", range(0, 500, 31))
def test_a_changed_byte_is_noticed(tmp_path: Path, place: int) -> None:
    out, path = begun(tmp_path)
    data = bytearray(path.read_bytes())
    data[place % len(data)] ^= 1
    path.write_bytes(data)
    before = path.read_bytes()
    with (
        pytest.raises(RunDamagedError, match="is damaged, or no journal of a sweep; --overwrite starts again"),
        Journal.open(out, SETTINGS, overwrite=False),
    ):
        pass
    assert path.read_bytes() == before


def test_lines_of_another_sweep_are_not_taken(tmp_path: Path) -> None:
    out, path = begun(tmp_path)
    (tmp_path / "other").mkdir()
    _, other = begun(tmp_path / "other", {**SETTINGS, "seed": 1})
    path.write_bytes(path.read_bytes().splitlines(keepends=True)[0] + other.read_bytes().split(b"\n", 1)[1])
    with pytest.raises(RunDamagedError), Journal.open(out, SETTINGS, overwrite=False):
        pass


@pytest.mark.parametrize(
    "changes",
    [
        {"chunk": -1},
        {"chunk": 10**30},
        {"chunk": True},
        {"chunk": [1]},
        {"columns": "reach"},
        {"columns": [["reach"]]},
        {"designs": 3},
        {"designs": -1},
        {"designs": 10**18},
        {"designs": "2"},
        {"numbers": "AAAA"},
        {"numbers": "é"},
        {"numbers": [1.0]},
        {"numbers": None},
    ],
)
def test_a_forged_line_is_refused(tmp_path: Path, changes: dict[str, object]) -> None:
    out, path = begun(tmp_path)
    forged(path, 1, **changes)
    with pytest.raises(RunDamagedError), Journal.open(out, SETTINGS, overwrite=False):
        pass


@pytest.mark.parametrize("settings", [None, [], "x", 3])
def test_forged_settings_are_refused(tmp_path: Path, settings: object) -> None:
    out, path = begun(tmp_path)
    forged(path, 0, settings=settings)
    with pytest.raises(RunDamagedError), Journal.open(out, SETTINGS, overwrite=False):
        pass


def test_a_line_without_end_is_not_read(tmp_path: Path) -> None:
    out, path = begun(tmp_path)
    with path.open("r+b") as stream:
        stream.truncate(MOST_LINE * 1000)  # with holes, which take no room
    with pytest.raises(RunDamagedError), Journal.open(out, SETTINGS, overwrite=False):
        pass


def test_deep_nesting_is_refused(tmp_path: Path) -> None:
    out, path = begun(tmp_path)
    content = b"[" * 1_000_000
    path.write_bytes(hashlib.sha256(content).hexdigest().encode() + b" " + content + b"\n")
    with pytest.raises(RunDamagedError), Journal.open(out, SETTINGS, overwrite=False):
        pass


def _link(path: Path) -> None:
    (path.parent / "private").write_text("not to be touched")
    path.symlink_to(path.parent / "private")


@pytest.mark.skipif(os.name == "nt", reason="no links and pipes here")
@pytest.mark.parametrize("make", [_link, os.mkfifo, os.mkdir], ids=["link", "pipe", "folder"])
@pytest.mark.parametrize("overwrite", [False, True])
def test_no_other_file_is_written_to(tmp_path: Path, make: Callable[[Path], None], overwrite: bool) -> None:
    make(tmp_path / "arms.csv.journal")
    with (
        pytest.raises(OutputError, match=r"^cannot write '.*arms\.csv\.journal': "),
        Journal.open(tmp_path / "arms.csv", SETTINGS, overwrite=overwrite),
    ):
        pass
    if (tmp_path / "private").exists():
        assert (tmp_path / "private").read_text() == "not to be touched"


def test_a_file_of_another_kind_is_left_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "arms.csv.journal"
    path.write_text("notes without a line end")
    with pytest.raises(RunDamagedError), Journal.open(tmp_path / "arms.csv", SETTINGS, overwrite=False):
        pass
    assert path.read_text() == "notes without a line end"


def test_a_journal_that_changes_while_it_is_used_is_noticed(tmp_path: Path) -> None:
    out, path = begun(tmp_path)
    with Journal.open(out, SETTINGS, overwrite=False) as journal:
        path.write_bytes(path.read_bytes()[:250])
        with pytest.raises(RunDamagedError):
            journal.rows(1)


@pytest.mark.skipif(os.name == "nt", reason="no locks here")
def test_a_sweep_is_measured_by_one_process_at_a_time(tmp_path: Path) -> None:
    out, path = begun(tmp_path)
    with Journal.open(out, SETTINGS, overwrite=False):
        before = path.read_bytes()
        for overwrite in (False, True):
            with (
                pytest.raises(OutputError, match=r"another process is measuring '.*arms\.csv'"),
                Journal.open(out, SETTINGS, overwrite=overwrite),
            ):
                pass
        assert path.read_bytes() == before


def test_rows_of_other_designs_are_refused(tmp_path: Path) -> None:
    out = tmp_path / "arms.csv"
    sweep(out, count=3, measure="reach")
    table = out.read_bytes()
    path = tmp_path / "arms.csv.journal"
    found = np.frombuffer(base64.b64decode(json.loads(path.read_bytes().splitlines()[1][65:])["numbers"]))
    for altered in (found + np.array([0.01, 0, 0] * 3), found[:6], np.append(found, 1.0)):
        number = base64.b64encode(altered.tobytes()).decode()
        forged(path, 1, numbers=number, designs=1 if len(altered) == 10 else 3)
        with pytest.raises(RunDamagedError):
            sweep(out, count=1 if len(altered) == 10 else 3, measure="reach")
    assert out.read_bytes() == table


def test_the_command_says_in_a_sentence_what_is_damaged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arms.csv.journal").write_bytes(os.urandom(1000) + b"\n")
    words = ("sweep", "planar_2r", "--vary", "a1=0.4", "--count", "1", "--measure", "reach", "-o", "arms.csv")
    run = dh2sim(*words)
    sentence = "'arms.csv.journal' is damaged, or no journal of a sweep; --overwrite starts again"
    assert (run.status, run.out, run.err) == (2, "", f"dh2sim: {sentence}\n")
    assert dh2sim(*words, "--overwrite").status == 0
