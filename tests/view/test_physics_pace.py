"""Simulated time keeps up with a clock, as far as it can, and says how far that is."""

from __future__ import annotations

import re

import pytest

from dh2sim.view.motion.physics import MAX_BACKLOG, RealTime

STEP = 0.002


def whole_steps(due: float) -> float:
    """What a simulation makes of it."""
    return int(due / STEP + 1e-6) * STEP


def run(pace: RealTime, *, frame: float, seconds: float, share: float = 1.0, start: float = 100.0) -> float:
    """Frames of a clock, in which a share of what is due is simulated; return how much was."""
    total = 0.0
    for k in range(round(seconds / frame) + 1):
        done = whole_steps(share * pace.due(start + k * frame))
        pace.simulated(done)
        total += done
    return total


@pytest.mark.parametrize("frame", [0.001, 1 / 60, 0.0333, 0.09])
def test_simulated_time_follows_the_clock_whatever_the_frames(frame: float) -> None:
    pace = RealTime()
    seconds = round(3.0 / frame) * frame
    assert run(pace, frame=frame, seconds=seconds) == pytest.approx(seconds, abs=STEP)
    assert pace.factor == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("speed", [0.25, 2.0])
def test_another_speed_is_kept_too(speed: float) -> None:
    pace = RealTime(speed)
    assert run(pace, frame=0.02, seconds=4.0) == pytest.approx(4.0 * speed, abs=STEP)
    assert pace.factor == pytest.approx(speed, abs=0.01)


def test_a_simulation_that_is_too_slow_shows_in_the_factor_and_is_not_chased() -> None:
    pace = RealTime()
    clock, total = 0.0, 0.0
    for _ in range(100):
        pace.due(clock)
        pace.simulated(0.004)  # all that time allows in a frame
        total += 0.004
        clock += 0.02
    assert pace.factor == pytest.approx(0.2, abs=0.01)
    assert pace.due(clock) == pytest.approx(MAX_BACKLOG)


def test_a_pause_of_the_page_is_not_made_up_for() -> None:
    pace = RealTime()
    run(pace, frame=0.02, seconds=1.0)
    assert pace.due(100.0 + 1.0 + 30.0) == pytest.approx(MAX_BACKLOG)


def test_the_factor_is_that_of_the_last_second() -> None:
    pace = RealTime()
    run(pace, frame=0.02, seconds=5.0, share=0.0)
    assert pace.factor == 0.0
    run(pace, frame=0.02, seconds=3.0, start=105.02)
    assert pace.factor == pytest.approx(1.0, abs=0.02)


def test_before_two_readings_nothing_is_due_and_there_is_no_factor() -> None:
    pace = RealTime()
    assert pace.factor is None
    assert pace.due(5.0) == 0.0
    assert pace.factor is None


def test_nothing_is_due_if_the_clock_stops_or_goes_back() -> None:
    pace = RealTime()
    pace.due(5.0)
    assert pace.due(5.0) == 0.0
    assert pace.due(4.0) == 0.0
    assert pace.due(5.004) == pytest.approx(0.004)


def test_after_a_restart_the_next_reading_is_the_first() -> None:
    pace = RealTime()
    run(pace, frame=0.02, seconds=1.0)
    pace.restart()
    assert pace.factor is None
    assert pace.due(500.0) == 0.0
    assert pace.due(500.02) == pytest.approx(0.02)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan")])
def test_a_speed_that_is_not_positive_is_refused(speed: float) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(f'speed must be positive, got {speed}')}$"):
        RealTime(speed)
