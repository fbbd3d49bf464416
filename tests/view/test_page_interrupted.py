"""The whole program is interrupted while a page in a real browser simulates."""

from __future__ import annotations

import re
import signal
from typing import TYPE_CHECKING

import pytest

from tests.cli.test_view import TIMEOUT, first_line, is_free, serving, unused_port
from tests.view.on_page import choose, open_tab, shown, wait_until

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext


@pytest.mark.slow
def test_an_interruption_ends_a_program_that_simulates(window: BrowserContext) -> None:
    with serving("stanford", "--port", str(port := unused_port())) as process:
        found = re.search(r"http://\S+", first_line(process))
        assert found is not None
        page = window.new_page()
        page.goto(found.group())
        open_tab(page, "Motion")
        choose(page, "Mode", "physics")
        wait_until(
            lambda: re.match(r"Simulated: (?!0\.0)", shown(page, "motion")) is not None, "the arm is simulated"
        )
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=TIMEOUT)
        page.close()
    assert (process.returncode, out, err) == (130, "", "dh2sim: interrupted\n")
    assert is_free(port)
