"""Commands for serial robots refuse mechanisms in a sentence, and write nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.program import dh2sim

REFUSED = (
    "info four_bar",
    "jacobian four_bar home",
    "ik four_bar --at 0.5 0.5 0",
    "symbolic four_bar",
    "symbolic four_bar --what jacobian",
    "symbolic four_bar --what dynamics",
    "symbolic four_bar --as c -o arm.c",
    "symbolic four_bar --as python --what inverse-dynamics -o arm.py",
    "workspace four_bar -o reach.csv",
    "trajectory four_bar home home -o motion.csv",
    "convert four_bar --to modified -o other.yaml",
    "draw four_bar -o drawing.svg",
)


@pytest.mark.parametrize("command", REFUSED)
def test_a_mechanism_is_refused_and_nothing_is_written(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run = dh2sim(*command.split())
    assert (run.status, run.out) == (2, "")
    assert run.err.splitlines()[0].startswith("dh2sim: ")
    assert run.err.endswith("four_bar: has closed loops: this works on serial robots\n")
    assert run.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []
