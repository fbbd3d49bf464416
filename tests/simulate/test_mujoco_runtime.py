from __future__ import annotations

import threading

import mujoco
import pytest

from dh2sim.errors import ControllerError
from dh2sim.simulate import mujoco_runtime as engine
from dh2sim.simulate import rollout
from dh2sim.simulate.mujoco_runtime import quiet_engine
from tests.simulate import robots


def timer() -> int | None:
    """The address that MuJoCo's C library calls for the time, None if none."""
    pointer = engine._timer()
    assert pointer is not None
    return pointer.value


def handler(_text: str) -> None:
    """A user's own."""


def test_importing_mujoco_installs_a_timer() -> None:
    assert timer() is not None


def test_the_timer_is_away_inside_and_back_afterwards() -> None:
    before = timer()
    with quiet_engine():
        assert timer() is None
    assert timer() == before


def test_it_is_away_until_the_last_of_several_is_through() -> None:
    before = timer()
    with quiet_engine():
        with quiet_engine():
            assert timer() is None
        assert timer() is None
    assert timer() == before


def test_it_is_back_after_an_error() -> None:
    before = timer()
    with pytest.raises(KeyError), quiet_engine():
        raise KeyError
    assert timer() == before


def test_threads_share_it() -> None:
    before = timer()
    inside, outside = threading.Barrier(5), threading.Barrier(5)
    seen: list[int | None] = []

    def work() -> None:
        with quiet_engine():
            inside.wait(60)
            seen.append(timer())
            outside.wait(60)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    inside.wait(60)
    assert timer() is None
    outside.wait(60)
    for thread in threads:
        thread.join()
    assert seen == [None] * 4
    assert timer() == before


def test_the_time_of_mujocos_own_profile_stops_inside_only() -> None:
    model = mujoco.MjModel.from_xml_string("<mujoco><worldbody/></mujoco>")
    data = mujoco.MjData(model)
    with quiet_engine():
        mujoco.mj_step(model, data)
        assert data.timer[mujoco.mjtTimer.mjTIMER_STEP].duration == 0.0
    mujoco.mj_step(model, data, nstep=100)
    assert data.timer[mujoco.mjtTimer.mjTIMER_STEP].duration > 0.0


@pytest.mark.parametrize("own", [None, handler], ids=["none", "own"])
def test_a_users_own_handler_of_warnings_is_put_back(own: object) -> None:
    mujoco.set_mju_user_warning(own)
    try:
        with quiet_engine(), quiet_engine():
            assert mujoco.get_mju_user_warning() not in (None, own)
        assert mujoco.get_mju_user_warning() is own
    finally:
        mujoco.set_mju_user_warning(None)


def test_a_run_leaves_both_as_they_were() -> None:
    before = timer()
    mujoco.set_mju_user_warning(handler)
    try:
        rollout(robots.arm(), rollouts=2, steps=3)
        with pytest.raises(ControllerError):
            rollout(robots.arm(), rollouts=2, steps=3, controller="tests.simulate.drivers:Nothing")
        assert timer() == before
        assert mujoco.get_mju_user_warning() is handler
    finally:
        mujoco.set_mju_user_warning(None)


def test_no_run_has_a_timer_while_it_runs() -> None:
    seen: list[int | None] = []
    rollout(robots.arm(), rollouts=2, steps=3, advance=lambda _: seen.append(timer()))
    assert seen == [None]
