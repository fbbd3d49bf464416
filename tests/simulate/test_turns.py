from __future__ import annotations

import threading
import time
from contextlib import closing
from functools import partial

import pytest

from dh2sim.simulate.turns import Turns


def test_python_runs_in_one_thread_at_a_time_and_the_rest_in_all() -> None:
    turns, both, now, most = Turns(2), threading.Barrier(2, timeout=10.0), [], []

    def work(number: int) -> None:
        for _ in range(20):
            now.append(number)
            time.sleep(1e-4)
            most.append(len(now))
            now.remove(number)
            with turns:
                both.wait()  # breaks unless the other thread comes, too

    assert len(list(turns.run([partial(work, 0), partial(work, 1)]))) == 2
    assert most == [1] * 40


def test_one_worker_works_in_the_thread_of_the_caller() -> None:
    turns, seen = Turns(1), []

    def work(number: int) -> None:
        with turns:
            seen.append((number, threading.current_thread()))

    for k, _ in enumerate(turns.run([partial(work, 0), partial(work, 1)])):
        assert seen == [(number, threading.current_thread()) for number in range(k + 1)]


def test_of_several_failures_the_first_piece_s_is_raised() -> None:
    turns, failed = Turns(2), threading.Event()

    def late() -> None:
        with turns:
            assert failed.wait(10.0)
        raise KeyError("first")

    def early() -> None:
        failed.set()
        raise KeyError("second")

    with pytest.raises(KeyError, match="first"):
        list(turns.run([late, early]))


@pytest.mark.parametrize("raises", [False, True])
def test_work_that_is_no_longer_wanted_stops_at_its_next_turn(raises: bool) -> None:
    turns, started = Turns(2), threading.Event()

    def first() -> None:
        with turns:
            assert started.wait(10.0)
        if raises:
            raise KeyError("first")

    def endless() -> None:
        while True:
            with turns:
                started.set()
                time.sleep(1e-3)

    before = threading.active_count()
    with closing(turns.run([first, endless, endless])) as done:
        if raises:
            with pytest.raises(KeyError, match="first"):
                next(done)
        else:
            next(done)
    assert threading.active_count() == before
