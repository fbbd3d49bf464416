"""The message of an error that a call must raise."""

from __future__ import annotations

from collections.abc import Callable

import pytest


def refusal(error: type[Exception], function: Callable[..., object], /, *args: object, **kwargs: object) -> str:
    """Call a function, which must raise this error, and return the error's text."""
    with pytest.raises(error) as caught:
        function(*args, **kwargs)
    return str(caught.value)
