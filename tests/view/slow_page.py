"""Pages that are late at random, in search of tests that only pass because pages are fast: see ``--slow-page``."""

from __future__ import annotations

import asyncio
import contextlib
import random
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

LONGEST = 0.5
"""s of a delay."""


@contextlib.contextmanager
def slow_pages(seed: int) -> Iterator[None]:
    """Delay drawing, each part of the panel and each message, now and then; nothing is shown together any more."""
    import viser.infra

    from dh2sim.view.access import PageConnection
    from dh2sim.view.page import Page
    from dh2sim.view.panel.panel import Panel
    from dh2sim.view.scene.painter import Painter

    chance = random.Random(seed)

    def delay(probability: float) -> float:
        return chance.uniform(0.0, LONGEST) if chance.random() < probability else 0.0

    def late(patch: pytest.MonkeyPatch, owner: type, name: str, probability: float) -> None:
        original = getattr(owner, name)

        def call(*arguments: Any, **options: Any) -> Any:
            if threading.current_thread().name.startswith("page-"):
                time.sleep(delay(probability))
            return original(*arguments, **options)

        patch.setattr(owner, name, call)

    def late_message(patch: pytest.MonkeyPatch, name: str) -> None:
        original = getattr(PageConnection, name)

        async def call(*arguments: Any, **options: Any) -> Any:
            if name == "send":
                await asyncio.sleep(delay(0.1))
            result = await original(*arguments, **options)
            if name == "recv":
                await asyncio.sleep(delay(0.1))
            return result

        patch.setattr(PageConnection, name, call)

    with pytest.MonkeyPatch.context() as patch:
        for owner, name in ((Painter, "draw"), (Panel, "show"), (Panel, "show_slow"), (Page, "apply")):
            late(patch, owner, name, 0.2)
        late(patch, viser.infra.WebsockMessageHandler, "queue_message", 0.01)
        patch.setattr(viser.infra.WebsockMessageHandler, "atomic", lambda _self: contextlib.nullcontext())
        late_message(patch, "send")
        late_message(patch, "recv")
        yield
