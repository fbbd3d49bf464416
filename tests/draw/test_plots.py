"""Plots: what is in the figures, and that their files are the same every time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from PIL import Image

from dh2sim.draw.plot_style import plot_style, value_range
from dh2sim.draw.plots import (
    KINDS,
    plot_energy,
    plot_joints,
    plot_tool,
    plot_tracking,
    require_kind,
    roll_pitch_yaw,
    saturated,
    write_plot,
)
from dh2sim.errors import OutputError, PictureError
from tests.draw.datasets import rollout, stopped, swinging


@pytest.fixture(autouse=True)
def _settings() -> Iterator[None]:
    with plot_style():
        yield


def shown(figure: Figure) -> list[Any]:
    return [ax for ax in figure.axes if ax.get_visible()]


def line(ax: Any, label: str) -> Any:
    [found] = [line for line in ax.get_lines() if line.get_label() == label]
    return found


def legend(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_every_joint_has_its_position_velocity_and_force_with_units() -> None:
    run = swinging()
    figure = plot_joints(rollout(run, 1))
    labels = [ax.get_ylabel() for ax in shown(figure)]
    turning = ["position, rad", "velocity, rad/s", "torque, N·m"]
    assert labels == [*turning, "position, m", "velocity, m/s", "force, N", *turning]
    titles = [ax.get_title(loc="left") for ax in shown(figure)]
    assert titles == ["joint_1", "", "", "joint_2", "", "", "joint_3", "", ""]
    assert [ax.get_xlabel() for ax in shown(figure)] == [""] * 6 + ["time, s"] * 3
    assert figure.get_suptitle() == "rpr · pd:kp=10 · run.zarr, rollout 1"
    position = shown(figure)[3]
    assert np.array_equal(line(position, "position").get_xydata().T, [run["time"], run["qpos"][1, :, 1]])
    force = shown(figure)[5]
    assert np.array_equal(line(force, "actuator force").get_ydata(), run["torque"][1, :, 1])


def test_references_are_dashed_and_controls_thin() -> None:
    run = swinging()
    position = shown(plot_joints(rollout(run)))[0]
    reference, control, actual = (line(position, name) for name in ("reference", "control", "position"))
    assert np.array_equal(reference.get_ydata(), run["qpos_ref"][0, :, 0])
    assert reference.is_dashed()
    assert not actual.is_dashed()
    assert np.array_equal(control.get_xydata().T, [run["interval_time"], run["ctrl"][0, :, 0]])
    assert control.get_linewidth() < actual.get_linewidth()
    assert control.get_drawstyle() == "steps-post"


def test_what_is_outside_the_limits_is_shaded_where_it_is_in_view() -> None:
    run = swinging().copy(deep=True)
    run["joint_lower"][:] = -np.inf
    run["joint_upper"][:] = np.inf
    assert "outside the limits" not in legend(plot_joints(rollout(run)))
    position = run["qpos"].values[0, :, 0]
    limit = float(0.5 * (position.min() + position.max()))
    run["joint_upper"][0] = limit
    figure = plot_joints(rollout(run))
    assert "outside the limits" in legend(figure)
    [shade] = shown(figure)[0].patches
    bottom, top = shown(figure)[0].get_ylim()
    assert (shade.get_y(), shade.get_y() + shade.get_height()) == pytest.approx((limit, top))
    assert bottom < position.min()
    assert not shown(figure)[3].patches


def test_the_velocity_limit_holds_both_ways() -> None:
    run = swinging().copy(deep=True)
    run["joint_velocity_limit"][0] = 0.4 * float(np.abs(run["qvel"].values[0, :, 0]).max())
    assert len(shown(plot_joints(rollout(run)))[1].patches) == 2


def test_a_run_without_velocities_or_torques_has_fewer_columns() -> None:
    run = swinging(without=("qvel", "torque", "ctrl", "qpos_ref"))
    figure = plot_joints(rollout(run))
    assert [ax.get_ylabel() for ax in shown(figure)] == ["position, rad", "position, m", "position, rad"]
    assert legend(figure)[0] == "position"


def test_many_joints_stand_beside_each_other() -> None:
    run = xr.concat([swinging(), swinging(), swinging(), swinging()], "joint", data_vars="minimal")
    run = run.assign_coords(joint=[f"joint_{k}" for k in range(1, 13)])
    figure = plot_joints(rollout(run.drop_vars(["qvel", "torque", "ctrl"])))
    grid = shown(figure)[0].get_gridspec()
    assert (grid.nrows, grid.ncols) == (6, 2)
    assert sorted(ax.get_title(loc="left") for ax in shown(figure)) == sorted(f"joint_{k}" for k in range(1, 13))


def test_a_rollout_that_stopped_says_why() -> None:
    figure = plot_joints(rollout(stopped(swinging(), 0, 6)))
    assert figure.get_suptitle() == "rpr · pd:kp=10 · run.zarr, rollout 0 · stopped: bad_qacc"
    assert len(line(shown(figure)[0], "position").get_xdata()) == 7


def test_the_tool_is_shown_over_time_and_in_space() -> None:
    run = swinging("stanford")
    figure = plot_tool(rollout(run))
    above, below, path = figure.axes
    assert [ax.get_ylabel() for ax in (above, below)] == ["position of tool0, m", "orientation of tool0, rad"]
    assert [path.get_xlabel(), path.get_ylabel(), path.get_zlabel()] == ["x, m", "y, m", "z, m"]
    pose = run["tool_pose"].values[0]
    assert np.array_equal(line(above, "z").get_ydata(), pose[:, 2])
    assert np.array_equal(np.array(path.get_lines()[0].get_data_3d()).T, pose[:, :3])
    spans = [np.ptp(limits) for limits in (path.get_xlim(), path.get_ylim(), path.get_zlim())]
    assert spans == pytest.approx([spans[0]] * 3), "a metre is as long along every axis"


def test_angles_give_the_rotation_back_and_do_not_jump() -> None:
    t = np.linspace(0.0, 9.0, 200)
    axis = np.array([0.36, -0.48, 0.8])
    quaternions = np.concatenate([np.cos(t / 2)[:, None], np.sin(t / 2)[:, None] * axis], axis=1)
    angles = roll_pitch_yaw(quaternions)
    for angle, (roll, pitch, yaw) in zip(t, angles, strict=True):
        K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        R = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
        x = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
        y = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
        z = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
        assert z @ y @ x == pytest.approx(R, abs=1e-12)
    assert np.abs(np.diff(angles, axis=0)).max() < 0.5


def test_energy_is_shown_with_its_total_and_what_that_drifts() -> None:
    run = swinging()
    above, below = plot_energy(rollout(run)).axes
    energy = run["energy"].values[0]
    total = energy.sum(axis=1)
    assert (above.get_ylabel(), below.get_ylabel()) == ("energy, J", "change of the total, J")
    assert np.array_equal(line(above, "potential").get_ydata(), energy[:, 0])
    assert np.array_equal(line(above, "kinetic").get_ydata(), energy[:, 1])
    assert np.array_equal(line(above, "total").get_ydata(), total)
    assert np.array_equal(
        line(below, f"at most {np.abs(total - total[0]).max():.2g} J").get_ydata(), total - total[0]
    )


def test_tracking_shows_the_error_with_its_root_mean_square() -> None:
    run = swinging()
    figure = plot_tracking(rollout(run))
    error = (run["qpos"] - run["qpos_ref"]).values[0]
    assert [ax.get_ylabel() for ax in shown(figure)] == ["q − q_ref, rad", "q − q_ref, m", "q − q_ref, rad"]
    rms = np.sqrt((error[:, 1] ** 2).mean())
    assert shown(figure)[1].get_title(loc="left") == f"joint_2   RMS {rms:.2g} m"
    assert any(np.array_equal(found.get_ydata(), error[:, 1]) for found in shown(figure)[1].get_lines())
    assert not figure.legends


def test_saturation_is_marked_where_it_is() -> None:
    run = swinging().copy(deep=True)
    assert not saturated(rollout(run)).any()
    run["ctrl"][0, 3:5, 1] = run["joint_upper"][1]
    assert np.argwhere(saturated(rollout(run))).tolist() == [[3, 1], [4, 1]]
    figure = plot_tracking(rollout(run))
    marks = line(shown(figure)[1], "actuator saturated")
    assert np.array_equal(marks.get_xdata(), run["interval_time"][3:5])
    assert legend(figure) == ["actuator saturated"]


@pytest.mark.parametrize(
    ("what", "gone", "reason"),
    [
        ("joints", ("qpos", "qvel"), "needs qpos, which the run does not contain; record again with qpos "),
        (
            "tool",
            ("tool_pose",),
            "needs tool_pose, which the run does not contain; record again with tool_pose ",
        ),
        ("energy", ("energy",), "needs energy, which the run does not contain; record again with energy "),
        (
            "tracking",
            ("qpos_ref",),
            "needs qpos_ref, which the run does not contain; record again with reference ",
        ),
        (
            "tracking",
            ("qpos", "qpos_ref"),
            "needs qpos and qpos_ref, which the run does not contain; record again with qpos,reference ",
        ),
    ],
)
def test_what_was_not_recorded_is_named_with_how_to_record_it(what: str, gone: tuple[str, ...], reason: str) -> None:
    run = swinging(without=gone)
    there = [name for name in ("qpos", "qvel", "qpos_ref", "tool_pose", "energy", "ctrl", "torque") if name in run]
    with pytest.raises(PictureError) as caught:
        KINDS[what](rollout(run), None)
    assert str(caught.value) == f"run.zarr: this plot {reason}(recorded: {', '.join(there)})"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "ending"),
    [
        ("joints", "svg"),
        ("tool", "svg"),
        ("tracking", "svg"),
        ("energy", "svg"),
        ("energy", "pdf"),
        ("energy", "png"),
    ],
)
def test_a_plot_is_the_same_bytes_every_time(tmp_path: Path, what: str, ending: str) -> None:
    for name in ("a", "b"):
        write_plot(tmp_path / f"{name}.{ending}", rollout(), what, dpi=60)
    first = (tmp_path / f"a.{ending}").read_bytes()
    assert first == (tmp_path / f"b.{ending}").read_bytes()
    assert b"Date" not in first
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"a.{ending}", f"b.{ending}"]


def test_a_plot_is_as_large_as_is_asked_for(tmp_path: Path) -> None:
    write_plot(tmp_path / "a.png", rollout(), "energy", size=(640, 400), dpi=80)
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (640, 400)


def test_a_plot_that_is_too_small_for_its_labels_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="the picture is too small for its labels"):
        write_plot(tmp_path / "a.png", rollout(), "joints", size=(300, 200))
    assert list(tmp_path.iterdir()) == []


def test_a_users_own_settings_of_matplotlib_change_nothing_and_stay(tmp_path: Path) -> None:
    write_plot(tmp_path / "a.svg", rollout(), "energy")
    with mpl.rc_context({"lines.linewidth": 9.0, "axes.facecolor": "black"}):
        write_plot(tmp_path / "b.svg", rollout(), "energy")
        assert mpl.rcParams["lines.linewidth"] == 9.0
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


def test_unknown_plots_and_endings_are_refused(tmp_path: Path) -> None:
    with pytest.raises(PictureError) as caught:
        require_kind("joint")
    assert str(caught.value) == (
        "unknown plot 'joint'. Did you mean 'joints'? Allowed: joints, tool, energy, tracking"
    )
    with pytest.raises(PictureError) as caught:
        write_plot(tmp_path / "a.jpg", rollout(), "joints")
    assert str(caught.value) == "cannot write 'a.jpg' as a plot; allowed endings: .png, .svg, .pdf"
    with pytest.raises(OutputError) as caught_output:
        write_plot(tmp_path / "no" / "a.png", rollout(), "energy")
    assert str(caught_output.value) == (
        f"cannot write '{tmp_path / 'no' / 'a.png'}': there is no folder '{tmp_path / 'no'}'"
    )


def test_an_axis_of_what_hardly_changes_does_not_show_noise() -> None:
    low, high = value_range(0.5 + 1e-15 * np.arange(3))
    assert (low, high) == pytest.approx((0.5, 0.5), abs=0.02)
    assert high - low > 0.01, "labels of the axis need no offset"
    low, high = value_range(0.5 + 1e-5 * np.arange(3))
    assert high - low < 3e-5, "what does change fills the axis"
    assert value_range(np.array([np.nan])) == value_range(np.zeros(1))


def test_names_are_no_formulas(tmp_path: Path) -> None:
    run = swinging(without=("ctrl", "torque")).assign_attrs(robot="$\\bad{$ \x1b")
    strange = run.assign_coords(joint=[f"$\\frac{{{name}$" for name in run["joint"].values])
    for kind in ("joints", "tool", "tracking"):
        write_plot(tmp_path / f"{kind}.svg", rollout(strange, 1), kind)
        assert (tmp_path / f"{kind}.svg").stat().st_size > 1000
