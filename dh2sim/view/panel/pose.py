"""The Pose tab: the pose of a frame in another, in all notations, its difference to MuJoCo, and tool0's Jacobian."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from dh2sim.kinematics.forward import frame_names
from dh2sim.kinematics.transforms import pose_errors
from dh2sim.robot.units import AngleUnit
from dh2sim.typing import Array
from dh2sim.view.events import ChooseFrame, ChooseReference, Show
from dh2sim.view.frame_readout import FrameReadout, MujocoPose, readout_of, relative_pose
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Send, bind
from dh2sim.view.panel.branches import BranchList
from dh2sim.view.panel.reach import ReachFolder
from dh2sim.view.scene.ellipsoids import force_half_axes
from dh2sim.view.state import Part, ViewState

if TYPE_CHECKING:
    import viser

_FORCE_HINT: Final = (
    "The forces at tool0 that joint torques and forces of norm 1 hold: long where the velocity's is short"
)


class PoseTab:
    """Numbers that change with every move."""

    def __init__(self, client: viser.ClientHandle, send: Send, state: ViewState) -> None:
        """Add the widgets to viser's current container."""
        self._mujoco = MujocoPose()
        names = frame_names(state.model.chain)
        chooser = client.gui.add_dropdown("Frame", names, initial_value=state.frame)
        self._frame = bind(chooser, send, lambda name: ChooseFrame(name=name))
        chooser = client.gui.add_dropdown(
            "in", names, initial_value=state.reference, hint="dh_2 in dh_1 is the matrix A₂ of the table's row 2"
        )
        self._reference = bind(chooser, send, lambda name: ChooseReference(name=name))
        self._pose = client.gui.add_html("")
        self._difference = client.gui.add_html("")
        self._branches = BranchList(client, send, state)
        with client.gui.add_folder("Jacobian of tool0"):
            self._jacobian = client.gui.add_html("")
            self._ellipsoid = bind(
                client.gui.add_checkbox(
                    "Ellipsoid in scene",
                    Part.ELLIPSOID in state.shown,
                    hint="The velocities of tool0 while the joint rates have the norm 1, drawn 0.15 m for 1 m/s",
                ),
                send,
                lambda on: Show(part=Part.ELLIPSOID, on=on),
            )
            self._force = bind(
                client.gui.add_checkbox("Forces in scene", Part.FORCE in state.shown, hint=_FORCE_HINT),
                send,
                lambda on: Show(part=Part.FORCE, on=on),
            )
        self._reach = ReachFolder(client, send, state)
        self._shown: object = None
        self._shown_slow: object = None

    def show(self, state: ViewState) -> None:
        """Show a state."""
        names = frame_names(state.model.chain)
        for chooser, name in ((self._frame, state.frame), (self._reference, state.reference)):
            if tuple(chooser.handle.options) != names:
                chooser.handle.options = names
            chooser.show(name)
        self._ellipsoid.show(Part.ELLIPSOID in state.shown)
        self._force.show(Part.FORCE in state.shown)
        self._reach.show(state)
        self._branches.show(state)
        shown = (state.model, state.q, state.frame, state.reference, state.angle, state.floats)
        if shown != self._shown:
            self._shown = shown
            self._pose.content = _pose(state)

    def show_slow(self, state: ViewState) -> None:
        """Show the Jacobian, and compare with MuJoCo, which takes a while."""
        shown = (state.model, state.q, state.frame, state.reference)
        if shown != self._shown_slow:
            self._shown_slow = shown
            self._jacobian.content = jacobian_markup(readout_of(state))
            self._difference.content = markup.note(self._difference_text(state), name="mujoco")

    def _difference_text(self, state: ViewState) -> str:
        T = self._mujoco.pose(state.model, state.frame, state.q)
        if T is None:
            why = self._mujoco.problem or "the MJCF has no site for this frame; choose dh_i or tool0"
            return f"No comparison with MuJoCo: {markup.text(why)}"
        own = relative_pose(state.model.chain, "base_link", state.frame, state.q)
        position, rotation = pose_errors(own, T)
        inside = "" if state.reference == "base_link" else " in base_link"
        return f"Difference to MuJoCo{inside}: {float(position):.1e} m, {float(rotation):.1e} rad"


def _pose(state: ViewState) -> str:
    readout = readout_of(state)
    return "".join(
        [
            markup.note(f"Pose of {frame_title(state)}, lengths in m"),
            matrix_markup(readout.T_reference_frame, name="matrix"),
            markup.lines(pose_lines(readout, state.angle), name="pose"),
        ]
    )


def frame_title(state: ViewState) -> str:
    """Return which frame's pose is shown in which, HTML; base_link may not be the scene's frame."""
    floating = " (which floats in the scene)" if state.floats and state.reference == "base_link" else ""
    return f"<b>{markup.text(state.frame)}</b> in {markup.text(state.reference)}{floating}"


def matrix_markup(T: Array, *, name: str) -> str:
    """Return a pose of shape (4, 4) as a table, HTML."""
    return markup.table([[f"{round(value, 6) + 0.0:+.6f}" for value in row] for row in T.tolist()], name=name)


def pose_lines(readout: FrameReadout, angle: AngleUnit) -> list[tuple[str, str]]:
    """Return a pose as position, angles and quaternion, each with its name."""
    degrees = angle is AngleUnit.DEG
    angles = [math.degrees(turn) if degrees else turn for turn in readout.rpy]
    return [
        ("xyz [m]", _numbers(readout.xyz, 6)),
        (f"rpy [{'°' if degrees else 'rad'}]", _numbers(angles, 4 if degrees else 6)),
        ("quat wxyz", _numbers(readout.quaternion, 6)),
    ]


def jacobian_markup(readout: FrameReadout) -> str:
    """Return the Jacobian in base_link, HTML, with measures of it and of its linear part."""
    names = ("vx", "vy", "vz", "ωx", "ωy", "ωz")
    rows = [
        [name, *(f"{round(value, 3) + 0.0:+.3f}" for value in row)]
        for name, row in zip(names, readout.jacobian.tolist(), strict=True)
    ]
    half_axes = " ".join(f"{half:.4g}" for half in readout.ellipsoid.semi_axes.tolist())
    forces = " ".join(f"{half:.4g}" for half in force_half_axes(readout.ellipsoid).tolist())
    measures = [
        ("manipulability", f"{readout.manipulability:.6g}"),
        ("distance to singularity", f"{readout.smallest_singular_value:.6g}"),
        ("ellipsoid, half axes [m/s]", half_axes),
        ("of force [N]", forces),
    ]
    note = markup.note("In base_link; m/s and rad/s for 1 rad/s or 1 m/s of each joint")
    return note + markup.table(rows, name="jacobian") + markup.lines(measures, name="measures")


def _numbers(values: Sequence[float], digits: int) -> str:
    return " ".join(f"{value:+.{digits}f}" for value in values)
