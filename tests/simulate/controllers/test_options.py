from __future__ import annotations

import re
from functools import partial
from typing import Annotated, Any, Literal, Optional

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field

from dh2sim.errors import ControllerError
from dh2sim.simulate.controllers.options import Within, join_pairs, options_of, read_options, split_pairs
from dh2sim.simulate.controllers.registry import choose
from tests.refusals import refusal


def constructor(  # type: ignore[no-untyped-def]
    batch: object,
    *,
    gain: float = 3.0,
    turns: int = 2,
    mirror: bool = False,
    side: Literal["left", "right"] = "left",
    share: Annotated[float, Within(at_least=0.0, below=1.0)] = 0.5,
    limit: Annotated[float | None, Within(above=0.0, unit="N·m")] = None,
    label: Optional[str] = None,  # noqa: UP045 - as many still write it
    plain="x",
    from_: str = "here",
    **rest: object,
) -> None: ...


OPTIONS = options_of(constructor, __name__, skip=1)
LISTED = "Options: gain=3, turns=2, mirror=false, side=left, share=0.5, limit=none, label=none, plain=x, from=here"


def read(text: str) -> dict[str, Any]:
    return read_options("swing", OPTIONS, text)


refused = partial(refusal, ControllerError, read)


def test_options_are_the_keywords_of_a_signature() -> None:
    names = ["gain", "turns", "mirror", "side", "share", "limit", "label", "plain", "from"]
    assert [option.name for option in OPTIONS] == names
    assert [option.parameter for option in OPTIONS][-1] == "from_"


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("gain=2", 2.0),
        ("gain=1e-3", 1e-3),
        ("gain = -4.5 ", -4.5),
        ("turns=7", 7),
        ("mirror=yes", True),
        ("mirror=False", False),
        ("side=right", "right"),
        ("share=0", 0.0),
        ("limit=none", None),
        ("limit=8", 8.0),
        ("label=none", None),
        ("label=a word", "a word"),
        ('label="a,b=c"', "a,b=c"),
        ("label='say \"so\"'", 'say "so"'),
        ("plain=1", "1"),
        ("from=there", "there"),
    ],
)
def test_a_value_is_read_as_its_type(text: str, value: object) -> None:
    (found,) = read(text).values()
    assert found == value
    assert type(found) is type(value)


def test_only_options_that_are_given_are_returned_in_the_signatures_order() -> None:
    assert list(read("side=left,gain=1").items()) == [("gain", 1.0), ("side", "left")]
    assert read("") == {}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("gian=2", "unknown option 'gian'. Did you mean 'gain'?"),
        ("zzz=2", "unknown option 'zzz'."),
        ("gain", "'gain' is not of the form key=value."),
        ("=3", "'=3' is not of the form key=value."),
        ("gain=", "option 'gain' must be a number, got ''."),
        ("gain=inf", "option 'gain' must be a number, got 'inf'."),
        ("gain=nan", "option 'gain' must be a number, got 'nan'."),
        ("gain=1,gain=2", "option 'gain' is given twice."),
        ("turns=2.5", "option 'turns' must be a whole number, got '2.5'."),
        ("mirror=maybe", "option 'mirror' must be true or false, got 'maybe'."),
        ("side=rihgt", "option 'side' must be left or right, got 'rihgt'. Did you mean 'right'?"),
        ("share=1", "option 'share' must be a number of at least 0 and below 1, got '1'."),
        ("limit=0", "option 'limit' must be a number above 0 N·m, or none, got '0'."),
        ("label='a", "the value of 'label' has an unclosed quotation mark '."),
    ],
)
def test_a_mistake_is_reported_with_what_is_allowed(text: str, problem: str) -> None:
    assert refused(text) == f"controller 'swing': {problem} {LISTED}"


def test_all_mistakes_are_reported_at_once() -> None:
    assert refused("gian=2,turns=x,share=-1") == (
        "controller 'swing':\n"
        "  unknown option 'gian'. Did you mean 'gain'?\n"
        "  option 'turns' must be a whole number, got 'x'\n"
        "  option 'share' must be a number of at least 0 and below 1, got '-1'\n"
        f"  {LISTED}"
    )


def test_an_option_without_a_default_must_be_given() -> None:
    def reading(*, file: str) -> None: ...

    options = options_of(reading, __name__, skip=0)
    with pytest.raises(ControllerError) as caught:
        read_options("replay", options, "")
    assert str(caught.value) == "controller 'replay': option 'file' is missing. Options: file=…"


def test_a_controller_without_options_says_so() -> None:
    with pytest.raises(ControllerError) as caught:
        choose("passive:speed=1")
    assert str(caught.value) == "controller 'passive': unknown option 'speed'. It has no options"


def test_a_type_that_no_text_can_give_is_refused() -> None:
    def bad(batch: object, *, gains: list[float]) -> None: ...

    message = (
        "option 'gains' is of type list; it may be float, int, bool, str, a Literal of texts, or one of these or None"
    )
    with pytest.raises(TypeError, match=f"^{re.escape(message)}$"):
        options_of(bad, __name__, skip=1)


def test_a_range_may_be_pydantics_own() -> None:
    def limited(batch: object, *, gain: Annotated[float, Field(gt=0, lt=2)] = 1.0) -> None: ...

    options = options_of(limited, __name__, skip=1)
    assert read_options("swing", options, "gain=1.5") == {"gain": 1.5}
    with pytest.raises(ControllerError, match="must be a number above 0 and below 2, got '2'"):
        read_options("swing", options, "gain=2")


@pytest.mark.parametrize("kind", [dict, bytes, object, float | int, Literal[1, 2]])
def test_types_that_are_not_simple_are_refused(kind: Any) -> None:
    def bad(batch: object, *, gains: Any = 1) -> None: ...

    bad.__annotations__["gains"] = kind
    with pytest.raises(TypeError, match=r"^option 'gains' is of type "):
        options_of(bad, __name__, skip=1)


def test_an_annotation_that_is_not_understood_is_refused() -> None:
    def bad(batch: object, *, gain: Nonsense = 1.0) -> None: ...  # type: ignore[name-defined] # noqa: F821

    message = "the annotation of option 'gain' is not understood: name 'Nonsense' is not defined"
    with pytest.raises(TypeError, match=f"^{re.escape(message)}$"):
        options_of(bad, __name__, skip=1)


def test_a_parameter_without_a_name_is_refused() -> None:
    def bad(batch: object, gain: float = 1.0, /) -> None: ...

    with pytest.raises(TypeError, match=r"^parameter 'gain' cannot be given by name$"):
        options_of(bad, __name__, skip=1)


def test_annotations_of_what_is_no_option_are_not_looked_at() -> None:
    def good(batch: Nonsense, *, gain: float = 1.0) -> None: ...  # type: ignore[name-defined] # noqa: F821

    assert [option.name for option in options_of(good, __name__, skip=1)] == ["gain"]


values = st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False)
texts = st.text(st.characters(codec="utf-8", exclude_characters="\"'", exclude_categories=["Cc", "Zl", "Zp"]))


@given(st.dictionaries(st.from_regex(r"[a-z]{1,5}", fullmatch=True), texts | texts.map(lambda text: f"it's {text}")))
def test_written_options_are_read_back(pairs: dict[str, str]) -> None:
    _, _, text = join_pairs("name", pairs.items()).partition(":")
    assert split_pairs(text) == (list(pairs.items()), [])


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_written_numbers_are_read_back_to_the_last_bit(number: float) -> None:
    def moving(*, x: float = 0.0) -> None: ...

    [option] = options_of(moving, __name__, skip=0)
    _, _, text = join_pairs("name", [("x", number)]).partition("=")
    assert option.read(text) == number
