"""Files that come in parts: however they come, no more is kept than a robot file may have."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dh2sim.errors import Dh2simError
from dh2sim.robot.yaml_tree import MAX_BYTES
from dh2sim.view.uploads import MOST_PARTS, Intake, Uploaded

HALF = MAX_BYTES // 2


def expecting(size: object = 6, count: object = 2, name: object = "arm.yaml", transfer: str = "t") -> Intake:
    intake = Intake()
    assert intake.announce(transfer=transfer, button="b", name=name, size=size, count=count) is None
    return intake


def test_parts_are_put_together_in_whatever_order_they_come() -> None:
    intake = expecting()
    assert intake.take(transfer="t", index=1, content=b"me") is None
    assert (intake.held, intake.awaited) == (2, ("b", "t"))
    assert intake.take(transfer="t", index=0, content=b"name") == Uploaded(
        button="b", name="arm.yaml", data=b"nameme"
    )
    assert (intake.held, intake.awaited) == (0, None)


def test_an_empty_file_is_there_at_once() -> None:
    intake = Intake()
    file = intake.announce(transfer="t", button="b", name="arm.yaml", size=0, count=0)
    assert file == Uploaded(button="b", name="arm.yaml", data=b"")
    assert intake.awaited is None


def test_the_largest_robot_file_is_taken() -> None:
    intake = expecting(size=MAX_BYTES, count=2)
    intake.take(transfer="t", index=0, content=b"a" * HALF)
    file = intake.take(transfer="t", index=1, content=b"a" * (MAX_BYTES - HALF))
    assert file is not None
    assert len(file.data) == MAX_BYTES


def test_a_larger_file_is_refused_before_anything_of_it_is_kept() -> None:
    intake = Intake()
    with pytest.raises(Dh2simError) as caught:
        intake.announce(transfer="t", button="b", name="big.yaml", size=5_000_000_000, count=10_000)
    assert str(caught.value) == "big.yaml has 5000000000 bytes; at most 1000000 are allowed."
    assert intake.take(transfer="t", index=0, content=b"a" * HALF) is None
    assert intake.held == 0


@pytest.mark.parametrize(
    ("size", "count"),
    [(-1, 1), (1, -1), (1, 0), (0, 1), (10, MOST_PARTS + 1), ("1", 1), (1, "1"), (1.0, 1), (None, None), (True, 1)],
)
def test_an_announcement_that_makes_no_sense_is_refused(size: object, count: object) -> None:
    intake = Intake()
    with pytest.raises(Dh2simError, match=r"^arm\.yaml was announced otherwise than browsers do\.$"):
        intake.announce(transfer="t", button="b", name="arm.yaml", size=size, count=count)
    assert intake.awaited is None


@pytest.mark.parametrize(
    ("index", "content"),
    [(0, b"namename"), (2, b"x"), (-1, b"x"), (0.0, b"x"), ("0", b"x"), (0, "name"), (0, ["x"] * 4), (0, None)],
)
def test_a_part_that_was_not_announced_ends_the_transfer(index: object, content: object) -> None:
    intake = expecting()
    with pytest.raises(Dh2simError) as caught:
        intake.take(transfer="t", index=index, content=content)
    assert str(caught.value) == "arm.yaml came otherwise than it was announced; nothing of it was kept."
    assert (intake.held, intake.awaited) == (0, None)


def test_a_part_that_comes_twice_ends_the_transfer() -> None:
    intake = expecting()
    intake.take(transfer="t", index=0, content=b"")
    with pytest.raises(Dh2simError):
        intake.take(transfer="t", index=0, content=b"")


def test_a_file_that_is_shorter_than_announced_is_dropped() -> None:
    intake = expecting(count=1)
    with pytest.raises(Dh2simError):
        intake.take(transfer="t", index=0, content=b"short")


def test_parts_of_other_transfers_are_dropped() -> None:
    intake = expecting()
    strangers: tuple[object, ...] = ("other", "", None, [], 0)
    for transfer in strangers:
        assert intake.take(transfer=transfer, index=0, content=b"x" * HALF) is None
    assert (intake.held, intake.awaited) == (0, ("b", "t"))


def test_a_file_takes_the_place_of_one_that_has_not_come_whole() -> None:
    intake = expecting()
    intake.take(transfer="t", index=0, content=b"name")
    intake.announce(transfer="u", button="c", name="other.yaml", size=1, count=1)
    assert (intake.held, intake.awaited) == (0, ("c", "u"))
    assert intake.take(transfer="t", index=1, content=b"me") is None
    assert intake.take(transfer="u", index=0, content=b"x") == Uploaded(button="c", name="other.yaml", data=b"x")


@pytest.mark.parametrize("name", [None, 3, b"x.yaml", ["x"]])
def test_a_name_that_is_no_text_is_not_used(name: object) -> None:
    intake = expecting(name=name, size=1, count=1)
    file = intake.take(transfer="t", index=0, content=b"x")
    assert file is not None
    assert file.name == "robot.yaml"


steps = st.one_of(
    st.tuples(st.just("announce"), st.sampled_from("tu"), st.integers(-1, 2 * MAX_BYTES), st.integers(-1, 20)),
    st.tuples(st.just("take"), st.sampled_from("tu"), st.integers(-1, 20), st.integers(0, HALF)),
)


@given(st.lists(steps, max_size=30))
def test_whatever_is_sent_no_more_is_held_than_a_robot_file_may_have(sent: list[tuple[str, str, int, int]]) -> None:
    intake = Intake()
    for step, transfer, first, second in sent:
        try:
            if step == "announce":
                intake.announce(transfer=transfer, button="b", name="x", size=first, count=second)
            else:
                intake.take(transfer=transfer, index=first, content=b"a" * second)
        except Dh2simError:
            assert intake.awaited is None
        assert intake.held <= MAX_BYTES
