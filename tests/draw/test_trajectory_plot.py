from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dh2sim import plan_trajectory
from dh2sim.draw.plot_style import plot_style
from dh2sim.draw.trajectory_plot import plot_trajectory
from tests.program import dh2sim
from tests.sample_robots import model


def test_every_joint_has_a_row_of_position_velocity_acceleration_and_jerk() -> None:
    planned = plan_trajectory(model("stanford"), ["home", 1.1 * model("stanford").home])
    sampled = planned.sample()
    with plot_style():
        figure = plot_trajectory(sampled, "title")
    assert len(figure.axes) == 6 * 4
    expected = [values[:, 2] for values in planned.at(sampled.time)]
    for ax, values, unit in zip(figure.axes[8:12], expected, ("m", "m/s", "m/s²", "m/s³"), strict=True):
        np.testing.assert_array_equal(ax.lines[0].get_ydata(), values)
        assert ax.get_ylabel() == unit


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".csv", ".npz"])
def test_the_command_plots_a_trajectory_file_beside_it(tmp_path: Path, suffix: str) -> None:
    motion = tmp_path / f"motion{suffix}"
    plan_trajectory(model("scara"), ["home", "zero"]).save(motion)
    run = dh2sim("plot", motion)
    assert (run.status, run.err) == (0, "")
    assert (tmp_path / "motion.png").read_bytes().startswith(b"\x89PNG")
    for words, said in ((["--what", "tool"], "--what"), (["--rollout", "1"], "--rollout")):
        refused = dh2sim("plot", motion, *words)
        assert refused.status == 2
        assert f"{said} does not apply to a trajectory file" in refused.err
