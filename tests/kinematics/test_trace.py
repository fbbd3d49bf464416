from __future__ import annotations

import pytest

from dh2sim.kinematics.trace import Token, Trace, cosine, count_operations, live_nodes, sine


def cost(trace: Trace, *outputs: float | Token) -> tuple[int, int, int]:
    operations = count_operations(trace, outputs)
    return operations.multiplications, operations.additions, operations.functions


def test_numbers_are_folded_and_zeros_and_ones_vanish() -> None:
    trace = Trace()
    [x] = trace.variables("q", 1)
    assert x * 0 == 0.0
    assert 0.0 * x == 0.0
    assert x - x == 0.0
    for same in (x * 1, 1 * x, x + 0, 0 + x, x - 0.0, -(0 - x), -1.0 * (-1 * x)):
        assert isinstance(same, Token)
        assert (same.index, same.sign) == (x.index, x.sign)
    assert cost(trace, x * 1 + 0) == (0, 0, 0)


def test_equal_operations_are_done_once_whatever_their_order_and_signs() -> None:
    trace = Trace()
    x, y = trace.variables("q", 2)
    assert cost(trace, x * y, y * x, -x * y, x * -y) == (1, 0, 0)
    assert cost(trace, x + y, y + x, -x - y, x - -y) == (0, 1, 0)
    assert cost(trace, x - y, y - x, -x + y) == (0, 1, 0)
    assert cost(trace, cosine(x), cosine(-x), sine(x), sine(-x)) == (0, 0, 2)
    assert (sine(-x).sign, cosine(-x).sign) == (-1, 1)


def test_only_what_outputs_need_counts_and_constants_do_not() -> None:
    trace = Trace()
    x, y = trace.variables("q", 2)
    a, b = trace.constant("a", 0.4), trace.constant("b", 0.3)
    unused = x * x * y
    once = (a + b) * a
    assert isinstance(once, Token)
    assert once.is_constant
    assert cost(trace, once * x + y) == (1, 1, 0)
    assert isinstance(unused, Token)
    assert unused.index not in live_nodes(trace, [once * x + y])


def test_constants_that_are_zero_or_one_need_no_name_and_others_have_a_value() -> None:
    trace = Trace()
    assert [trace.constant("a", value) for value in (-1.0, -0.0, 1.0)] == [-1.0, 0.0, 1.0]
    a, b = trace.constant("a", 0.4), trace.constant("b", 0.3)
    assert trace.value(-(2.0 * a * b - b)) == -(2.0 * 0.4 * 0.3 - 0.3)
    [x] = trace.variables("q", 1)
    with pytest.raises(ValueError, match="what depends on variables has no value"):
        trace.value(a * x)
