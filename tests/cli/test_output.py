"""JSON of commands has no numbers that are not finite."""

from __future__ import annotations

import json
import math

import pytest

from dh2sim.cli.output import json_text
from dh2sim.errors import NotFiniteError


def test_json_reads_back() -> None:
    value = {"a": [1.0, {"b": "é"}], "c": None}
    assert json.loads(json_text(value)) == value
    assert json_text(value, indent=None, ensure_ascii=False) == '{"a": [1.0, {"b": "é"}], "c": null}'


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_refused_with_its_place(number: float) -> None:
    with pytest.raises(NotFiniteError, match=rf"^JSON\.a\[1\]\.b: {number} is not a finite number"):
        json_text({"a": [1.0, {"b": number}]})
