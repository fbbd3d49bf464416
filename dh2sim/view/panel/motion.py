"""The Motion tab: what moves the joints, the user, a simulation or a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

from dh2sim.view.events import Pause, Step
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Bound, Send, bind, on_click
from dh2sim.view.state import Mode, ViewState

if TYPE_CHECKING:
    import viser

    from dh2sim.view.motion.motion_source import MotionControl
    from dh2sim.view.motion.physics import Drive
    from dh2sim.view.motion.replay import Replay

_MODES: Final = {Mode.MANUAL: "manual", Mode.PHYSICS: "physics", Mode.REPLAY: "recording"}


class MotionTab:
    """Widgets of the simulation, and of the run if there is one."""

    def __init__(self, client: viser.ClientHandle, send: Send, motion: MotionControl) -> None:
        """Add the widgets to viser's current container."""
        gui = client.gui
        self._send, self._motion = send, motion
        self._mode = bind(gui.add_dropdown("Mode", self._modes()), send, lambda _mode: self._start)
        self._status = gui.add_html("")
        self._paused = False
        self._pause = gui.add_button("Pause", disabled=True)
        self._step = gui.add_button("Step", disabled=True, hint="One time step, or the recording's next time")
        on_click(self._pause, send, lambda: Pause(on=not self._paused))
        on_click(self._step, send, Step)
        with gui.add_folder("Physics"):
            self._gravity = bind(gui.add_checkbox("Gravity", True), send, lambda _on: self._set_physics)
            drives = gui.add_dropdown("Actuators", ("position", "free"))
            self._drive = bind(drives, send, lambda _drive: self._set_physics)
            on_click(gui.add_button("Reset"), send, lambda: self._start)
            gui.add_html(markup.note("Drag a link in the scene to pull at it."))
        self._rollout: Any = None
        self._time: Bound[float] | None = None
        self._recording: Any = None
        if motion.replay is not None:
            self._recording = gui.add_folder("Recording")
            with self._recording:
                self._add_recording(gui, motion.replay)

    def show(self, state: ViewState) -> None:
        """Show a state."""
        self._mode.show(_MODES[state.mode])
        if tuple(self._mode.handle.options) != self._modes():
            self._mode.handle.options = self._modes()
            self._recording.visible = self._motion.playable
        self._show_pause(state)
        if self._time is not None:
            self._time.show(round(100.0 * self._motion.progress, 1))
        status = self._motion.status if state.mode is not Mode.MANUAL else ""
        self._status.content = markup.note(markup.text(status), name="motion")

    def _modes(self) -> tuple[str, ...]:
        """Return the modes to choose from; a recording of another robot is none."""
        return tuple(label for mode, label in _MODES.items() if mode is not Mode.REPLAY or self._motion.playable)

    def _show_pause(self, state: ViewState) -> None:
        manual = state.mode is Mode.MANUAL
        if manual != self._pause.disabled:
            self._pause.disabled = self._step.disabled = manual
        if state.paused != self._paused:
            self._paused = state.paused
            self._pause.label = "Play" if state.paused else "Pause"

    def _add_recording(self, gui: viser.GuiApi, replay: Replay) -> None:
        self._rollout = gui.add_dropdown("Rollout", [str(number) for number in replay.rollouts])
        self._speed = gui.add_dropdown("Speed", ("0.1", "0.25", "0.5", "1", "2"), initial_value="1")
        time = gui.add_slider("Time [%]", min=0.0, max=100.0, step=0.1, initial_value=0.0)
        bind(self._rollout, self._send, lambda _value: self._start)
        bind(self._speed, self._send, lambda _value: self._set_speed)
        self._time = bind(time, self._send, lambda percent: lambda: self._motion.seek(percent / 100.0))
        if replay.note:
            gui.add_html(markup.note(markup.text(replay.note)))

    def _start(self) -> None:
        """Start the chosen mode from the beginning."""
        mode = self._mode.handle.value
        if mode == _MODES[Mode.PHYSICS]:
            self._motion.simulate(gravity=self._has_gravity, drive=self._driven_by)
        elif mode == _MODES[Mode.REPLAY]:
            self._motion.play(int(self._rollout.value))
            self._set_speed()
        else:
            self._motion.stop()

    def _set_physics(self) -> None:
        self._motion.set_physics(gravity=self._has_gravity, drive=self._driven_by)

    @property
    def _has_gravity(self) -> bool:
        return bool(self._gravity.handle.value)

    @property
    def _driven_by(self) -> Drive:
        return cast("Drive", self._drive.handle.value)

    def _set_speed(self) -> None:
        self._motion.set_speed(float(self._speed.value))
