"""What docs/rollouts.md shows is what happens."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

PAGE = Path(__file__).resolve().parent.parent / "docs" / "rollouts.md"


def test_the_python_of_the_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    first, second = re.findall(
        r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL
    )
    exec(compile(first, "rollouts.md", "exec"), {})
    assert 0.0 < float(capsys.readouterr().out) < 0.01
    names: dict[str, Any] = {}
    exec(compile(second, "rollouts.md", "exec"), names)
    run, again = names["run"], names["again"]
    assert again.attrs["settings"] == {**run.attrs["settings"], "seed": 4}
    assert not again.equals(run)
