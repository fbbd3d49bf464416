"""The kinds of tables in docs/importing.md are read, and are the same arm."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from tests.formats.table.samples import imported, standard, tool_poses

PAGE = (Path(__file__).parents[3] / "docs" / "importing.md").read_text(encoding="utf-8")
SECTION = PAGE.partition("### Kinds of tables\n")[2].partition("\n## ")[0]
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", SECTION, re.MULTILINE | re.DOTALL)
ENDINGS = {"matlab": "m", "latex": "tex", "text": "txt"}


def test_the_page_shows_every_kind() -> None:
    assert [kind for kind, _ in BLOCKS] == [
        "md", "csv", "md", "latex", "html", "mediawiki", "rst", "text", "matlab", "py", "matlab", "yaml", "py",
        "json", "py",
    ]  # fmt: skip


@pytest.mark.parametrize(("kind", "text"), BLOCKS)
def test_an_example_of_the_page_is_the_arm(kind: str, text: str) -> None:
    found, q = imported(text, f"arm.{ENDINGS.get(kind, kind)}"), (0.3, -0.5)
    expected = standard(q[0], 0.4, 0, math.pi / 2) @ standard(q[1] + math.pi / 2, 0, 0.3, 0)
    np.testing.assert_allclose(tool_poses(found.spec, [q])[0], expected, atol=1e-15)


@pytest.mark.parametrize(("kind", "text"), [block for block in BLOCKS if block[0] != "csv"])
def test_an_example_of_the_page_is_read_in_a_block_of_a_readme_too(kind: str, text: str) -> None:
    assert len(imported(f"# Arm\n\nSee below.\n\n```{kind}\n{text}```\n\nThe end.\n", "README.md").spec.rows) >= 2
