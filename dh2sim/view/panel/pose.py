"""The Pose tab: the pose of a frame in all notations, and its difference to MuJoCo."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from dh2sim.kinematics.forward import frame_names
from dh2sim.kinematics.transforms import pose_errors
from dh2sim.robot.spec import AngleUnit
from dh2sim.view.events import ChooseFrame
from dh2sim.view.frame_readout import FrameReadout, MujocoPose, readout_of
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Send, bind
from dh2sim.view.state import ViewState

if TYPE_CHECKING:
    import viser


class PoseTab:
    """Numbers that change with every move."""

    def __init__(self, client: viser.ClientHandle, send: Send, state: ViewState) -> None:
        """Add the widgets to viser's current container."""
        self._mujoco = MujocoPose()
        chooser = client.gui.add_dropdown("Frame", frame_names(state.model.chain), initial_value=state.frame)
        self._frame = bind(chooser, send, lambda name: ChooseFrame(name=name))
        self._pose = client.gui.add_html("")
        self._difference = client.gui.add_html("")
        self._shown: object = None
        self._compared: object = None

    def show(self, state: ViewState) -> None:
        """Show a state."""
        names = frame_names(state.model.chain)
        if tuple(self._frame.handle.options) != names:
            self._frame.handle.options = names
        self._frame.show(state.frame)
        shown = (state.model, state.q, state.frame, state.angle, state.floats)
        if shown != self._shown:
            self._shown = shown
            self._pose.content = _content(state)

    def compare(self, state: ViewState) -> None:
        """Compare with MuJoCo, which takes a while: to be called when there is nothing else to do."""
        compared = (state.model, state.q, state.frame)
        if compared != self._compared:
            self._compared = compared
            self._difference.content = markup.note(self._difference_text(state), name="mujoco")

    def _difference_text(self, state: ViewState) -> str:
        T = self._mujoco.pose(state.model, state.frame, state.q)
        if T is None:
            why = self._mujoco.problem or "the MJCF has no site for this frame; choose dh_i or tool0"
            return f"No comparison with MuJoCo: {markup.text(why)}"
        position, rotation = pose_errors(readout_of(state).T_base_frame, T)
        return f"Difference to MuJoCo: {float(position):.1e} m, {float(rotation):.1e} rad"


def _content(state: ViewState) -> str:
    readout = readout_of(state)
    matrix = [[f"{value:+.6f}" for value in row] for row in readout.T_base_frame.tolist()]
    return "".join(
        [
            markup.note(f"Pose of {frame_title(state)}, lengths in m"),
            markup.table(matrix, name="matrix"),
            markup.lines(pose_lines(readout, state.angle), name="pose"),
            markup.lines(_jacobian_lines(readout), name="jacobian"),
        ]
    )


def frame_title(state: ViewState) -> str:
    """Return which frame's pose is shown in which, HTML; base_link may not be the scene's frame."""
    floating = " (which floats in the scene)" if state.floats else ""
    return f"<b>{markup.text(state.frame)}</b> in base_link{floating}"


def pose_lines(readout: FrameReadout, angle: AngleUnit) -> list[tuple[str, str]]:
    """Return a pose as position, angles and quaternion, each with its name."""
    degrees = angle is AngleUnit.DEG
    angles = [math.degrees(turn) if degrees else turn for turn in readout.rpy]
    return [
        ("xyz [m]", _numbers(readout.xyz, 6)),
        (f"rpy [{'°' if degrees else 'rad'}]", _numbers(angles, 4 if degrees else 6)),
        ("quat wxyz", _numbers(readout.quaternion, 6)),
    ]


def _jacobian_lines(readout: FrameReadout) -> list[tuple[str, str]]:
    return [
        ("manipulability of tool0", f"{readout.manipulability:.6g}"),
        ("distance to singularity", f"{readout.smallest_singular_value:.6g}"),
    ]


def _numbers(values: Sequence[float], digits: int) -> str:
    return " ".join(f"{value:+.{digits}f}" for value in values)
