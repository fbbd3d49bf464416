"""Who moves the joints: the user, a simulation, or a recording."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from dh2sim.view.events import Pause, Step
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Bound, Send, bind, on_click
from dh2sim.view.state import Mode, ViewState

if TYPE_CHECKING:
    import viser

    from dh2sim.view.motion.motion_source import Mover
    from dh2sim.view.motion.physics import Drive
    from dh2sim.view.motion.replay import Replay

_WORDS = {Mode.STILL: "me", Mode.PHYSICS: "physics", Mode.REPLAY: "the recording"}


class MotionTab:
    """Widgets of the simulation, and of the run if there is one."""

    def __init__(self, client: viser.ClientHandle, send: Send, mover: Mover) -> None:
        """Add the widgets to viser's current container."""
        gui = client.gui
        self._send, self._mover = send, mover
        self._mode = self._chosen(gui.add_dropdown("Moved by", self._modes()))
        self._told = gui.add_html("")
        self._paused = False
        self._pause = gui.add_button("Pause", disabled=True)
        self._step = gui.add_button("Step", disabled=True, hint="One time step, or the recording's next instant")
        on_click(self._pause, send, lambda: Pause(on=not self._paused))
        on_click(self._step, send, Step)
        with gui.add_folder("Physics"):
            self._gravity = bind(gui.add_checkbox("Gravity", True), send, lambda _on: self._act)
            self._drive = bind(gui.add_dropdown("Actuators", ("position", "free")), send, lambda _drive: self._act)
            on_click(gui.add_button("Begin anew"), send, lambda: self._begin)
            gui.add_html(markup.note("Drag a link in the scene to pull at it."))
        self._rollout: Any = None
        self._instant: Bound[float] | None = None
        self._recording: Any = None
        if mover.replay is not None:
            self._recording = gui.add_folder("Recording")
            with self._recording:
                self._add_recording(gui, mover.replay)

    def show(self, state: ViewState) -> None:
        """Show a state."""
        self._mode.show(_WORDS[state.mode])
        if tuple(self._mode.handle.options) != self._modes():
            self._mode.handle.options = self._modes()
            self._recording.visible = self._mover.playable
        self._show_pause(state)
        if self._instant is not None:
            self._instant.show(round(100.0 * self._mover.share, 1))
        told = self._mover.told if state.mode is not Mode.STILL else ""
        self._told.content = markup.note(markup.text(told), name="motion")

    def _modes(self) -> tuple[str, ...]:
        """Return who can be asked to move the joints; not a recording of another robot."""
        return tuple(_WORDS[mode] for mode in Mode if mode is not Mode.REPLAY or self._mover.playable)

    def _show_pause(self, state: ViewState) -> None:
        still = state.mode is Mode.STILL
        if still != self._pause.disabled:
            self._pause.disabled = self._step.disabled = still
        if state.paused != self._paused:
            self._paused = state.paused
            self._pause.label = "Play" if state.paused else "Pause"

    def _chosen(self, widget: Any) -> Bound[Any]:
        """Begin anew whenever a choice changes."""
        return bind(widget, self._send, lambda _value: self._begin)

    def _add_recording(self, gui: viser.GuiApi, replay: Replay) -> None:
        self._rollout = gui.add_dropdown("Rollout", [str(number) for number in replay.rollouts])
        self._speed = gui.add_dropdown("Speed", ("0.1", "0.25", "0.5", "1", "2"), initial_value="1")
        instant = gui.add_slider("Instant [%]", min=0.0, max=100.0, step=0.1, initial_value=0.0)
        bind(self._rollout, self._send, lambda _value: self._begin)
        bind(self._speed, self._send, lambda _value: self._pace)
        self._instant = bind(instant, self._send, lambda percent: lambda: self._mover.seek(percent / 100.0))
        if replay.note:
            gui.add_html(markup.note(markup.text(replay.note)))

    def _begin(self) -> None:
        """Let whoever is chosen move the joints, from the beginning."""
        chosen = self._mode.handle.value
        if chosen == _WORDS[Mode.PHYSICS]:
            self._mover.simulate(gravity=self._has_gravity, drive=self._driven_by)
        elif chosen == _WORDS[Mode.REPLAY]:
            self._mover.play(int(self._rollout.value))
            self._pace()
        else:
            self._mover.be_still()

    def _act(self) -> None:
        """Let what is chosen act in the simulation that runs, if one does."""
        self._mover.act(gravity=self._has_gravity, drive=self._driven_by)

    @property
    def _has_gravity(self) -> bool:
        return bool(self._gravity.handle.value)

    @property
    def _driven_by(self) -> Drive:
        return cast("Drive", self._drive.handle.value)

    def _pace(self) -> None:
        self._mover.pace(float(self._speed.value))
