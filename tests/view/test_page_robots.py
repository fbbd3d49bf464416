"""Every robot that comes with dh2sim, and one with a mesh, in a real browser."""

from __future__ import annotations

import pytest

from dh2sim.robot.read import builtin_robots, load_robot
from dh2sim.view.initial_state import folder_of, open_state
from tests.view.on_page import Serve, wait_for_position, wait_until


@pytest.fixture(scope="module")
def drawn() -> bool:
    return False


@pytest.mark.slow
@pytest.mark.parametrize("robot", builtin_robots())
def test_every_robot_that_comes_with_dh2sim_opens_at_home(serve: Serve, robot: str) -> None:
    spec = load_robot(robot)
    page, served = serve(open_state(spec, folder_of(robot)))
    zero = [0.0] * len(spec.moving_rows)
    wait_for_position(page, spec, spec.configurations["home"].tolist() if "home" in spec.configurations else zero)
    assert page.get_by_role("slider").count() >= len(spec.moving_rows)
    for number in range(1, len(spec.rows) + 1):
        assert served.client.scene.get_handle_by_name(f"/robot/link_{number}") is not None
    wait_until(lambda: page.get_by_text(f"dh2sim · {spec.name}").first.is_visible(), "its name")
