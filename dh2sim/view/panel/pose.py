"""The pose of a frame, in every way that it is written, and the same pose from MuJoCo."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from dh2sim.kinematics.forward import frame_names
from dh2sim.robot.spec import AngleUnit
from dh2sim.view.events import ChooseFrame
from dh2sim.view.motion.mujoco_pose import Twin
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Send, bind
from dh2sim.view.panel.readings import Readings, difference, readings_of
from dh2sim.view.state import ViewState

if TYPE_CHECKING:
    import viser


class PoseTab:
    """Numbers that change with every move."""

    def __init__(self, client: viser.ClientHandle, send: Send, state: ViewState) -> None:
        """Add the widgets to viser's current container."""
        self._twin = Twin()
        chooser = client.gui.add_dropdown("Frame", frame_names(state.model.chain), initial_value=state.frame)
        self._frame = bind(chooser, send, lambda name: ChooseFrame(name=name))
        self._pose = client.gui.add_html("")
        self._twins = client.gui.add_html("")
        self._shown: object = None
        self._compared: object = None

    def show(self, state: ViewState) -> None:
        """Show a state."""
        names = frame_names(state.model.chain)
        if tuple(self._frame.handle.options) != names:
            self._frame.handle.options = names
        self._frame.show(state.frame)
        seen = (state.model, state.q, state.frame, state.angle, state.floats)
        if seen != self._shown:
            self._shown = seen
            self._pose.content = _content(state)

    def settle(self, state: ViewState) -> None:
        """Compare with MuJoCo, which takes a while: to be called when nothing else is to be done."""
        seen = (state.model, state.q, state.frame)
        if seen != self._compared:
            self._compared = seen
            self._twins.content = markup.note(self._told(state), name="mujoco")

    def _told(self, state: ViewState) -> str:
        T = self._twin.pose(state.model, state.frame, state.q)
        if T is None:
            why = self._twin.problem or "its file has no site for this frame; choose dh_i or tool0"
            return f"MuJoCo: {markup.text(why)}"
        position, rotation = difference(readings_of(state).T_base_frame, T)
        return f"MuJoCo has it {position:.1e} m and {rotation:.1e} rad from there."


def _content(state: ViewState) -> str:
    readings = readings_of(state)
    matrix = [[f"{value:+.6f}" for value in row] for row in readings.T_base_frame.tolist()]
    return "".join(
        [
            markup.note(f"Pose of {whose_pose(state)}, lengths in m"),
            markup.table(matrix, name="matrix"),
            markup.lines(pose_lines(readings, state.angle), name="pose"),
            markup.lines(_of_jacobian(readings), name="jacobian"),
        ]
    )


def whose_pose(state: ViewState) -> str:
    """Return which frame's pose is told, and in which: that is not the scene's where base_link floats; HTML."""
    floating = " (which floats in the scene)" if state.floats else ""
    return f"<b>{markup.text(state.frame)}</b> in base_link{floating}"


def pose_lines(readings: Readings, angle: AngleUnit) -> list[tuple[str, str]]:
    """Return a pose as position, angles and quaternion, each with its name."""
    degrees = angle is AngleUnit.DEG
    angles = [math.degrees(turn) if degrees else turn for turn in readings.rpy]
    return [
        ("xyz [m]", _numbers(readings.xyz, 6)),
        (f"rpy [{'°' if degrees else 'rad'}]", _numbers(angles, 4 if degrees else 6)),
        ("quat wxyz", _numbers(readings.quaternion, 6)),
    ]


def _of_jacobian(readings: Readings) -> list[tuple[str, str]]:
    return [
        ("manipulability of tool0", f"{readings.manipulability:.6g}"),
        ("distance to singularity", f"{readings.smallest_singular_value:.6g}"),
    ]


def _numbers(values: Sequence[float], digits: int) -> str:
    return " ".join(f"{value:+.{digits}f}" for value in values)
