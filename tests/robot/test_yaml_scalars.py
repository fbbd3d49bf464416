"""Plain scalars mean what YAML 1.2's core schema says."""

from __future__ import annotations

import math

import pytest

from dh2sim.robot.yaml_tree import Scalar, resolve_plain


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("", None),
        ("~", None),
        ("null", None),
        ("true", True),
        ("False", False),
        ("yes", "yes"),
        ("on", "on"),
        ("0", 0),
        ("-12", -12),
        ("+3", 3),
        ("012", 12),
        ("0o17", 15),
        ("0x1F", 31),
        ("1_000", "1_000"),
        ("1:30", "1:30"),
        ("1.5", 1.5),
        ("1.", 1.0),
        (".5", 0.5),
        ("-1e3", -1000.0),
        ("1e-3", 0.001),
        (".", "."),
        ("-", "-"),
        ("1e", "1e"),
        (".inf", math.inf),
        ("-.Inf", -math.inf),
        ("inf", "inf"),
        ("2024-01-01", "2024-01-01"),
        ("9" * 5000, math.inf),
        ("0x" + "f" * 5000, math.inf),
    ],
)
def test_plain_scalar_means_what_the_core_schema_says(text: str, value: Scalar) -> None:
    resolved = resolve_plain(text)
    assert resolved == value
    assert type(resolved) is type(value)


def test_dot_nan_is_not_a_number() -> None:
    resolved = resolve_plain(".nan")
    assert isinstance(resolved, float)
    assert math.isnan(resolved)
