"""A browser page of a mechanism: sliders of its driven joints, readouts, simulation, recordings, and its thread."""

from __future__ import annotations

import logging
import math
import queue
import threading
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from dh2sim.errors import Dh2simError
from dh2sim.kinematics.loop_motion import named_configuration
from dh2sim.kinematics.transforms import rpy_from_rotation
from dh2sim.kinematics.tree import body_poses, placed
from dh2sim.messages import bug_text, listed, printable
from dh2sim.model.mechanism import MechanismModel
from dh2sim.view.mechanism.motion import MechanismMotion
from dh2sim.view.mechanism.scene import PATH, frame_path, mechanism_page_html, mechanism_scene
from dh2sim.view.page import is_disconnect
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Bound, bind, on_click
from dh2sim.view.scene.painter import Painter

if TYPE_CHECKING:
    import viser

    from dh2sim.model.robot_model import JointModel
    from dh2sim.view.motion.replay import Replay
    from dh2sim.view.scene.items import Polyline

Task = Callable[[], None]
_TICK: Final = 1.0 / 30.0
"""s between pictures of a simulation."""
_FEW: Final = 8
"""Joints of a mechanism whose frames are shown at first; more would hide it."""
_MANUAL, _PHYSICS, _RECORDING = "manual", "physics", "recording"
_SPEEDS: Final = ("0.1", "0.25", "0.5", "1", "2")
NOT_HERE: Final = "The table of a mechanism is not edited here: change its file, and open it again."
_log: Final = logging.getLogger(__name__)


class MechanismPage:
    """Shows a mechanism to a viser client, and moves it."""

    def __init__(
        self,
        client: viser.ClientHandle,
        model: MechanismModel,
        disconnect: Callable[[], None],
        replay: Replay | None = None,
    ) -> None:
        """Draw nothing before ``start``.

        Args:
            client: The page's viser client.
            model: The mechanism.
            disconnect: Closes the connection to the browser.
            replay: A run of the mechanism, or a trajectory, to play; it plays at once.
        """
        self.client = client
        self.motion = MechanismMotion(model)
        self._replay = replay
        self._path: Polyline | None = None
        self._model = model
        self._disconnect = disconnect
        self._painter = Painter(client.scene)
        self._queue: queue.SimpleQueue[tuple[Task, Task | None] | None] = queue.SimpleQueue()
        self._closed = threading.Event()
        self._notice, self._frame, self._frames = "", "tool0", len(model.joints) <= _FEW
        self._gap: float | None = None
        self._pending: dict[int, float] = {}
        """Where driven joints are to be moved; a slider that is dragged sends faster than loops are closed."""
        self._thread = threading.Thread(target=self._run, name=f"page-{client.client_id}", daemon=True)

    def start(self) -> None:
        """Draw, and begin to work through events."""
        self._thread.start()

    def close(self) -> None:
        """End after the present task; what is queued is dropped."""
        self._closed.set()
        self._queue.put(None)

    @property
    def is_alive(self) -> bool:
        """Whether its thread has not ended yet."""
        return self._thread.is_alive()

    def join(self, timeout: float) -> None:
        """Wait until its thread has ended, at most ``timeout`` seconds."""
        if self._thread.is_alive():
            self._thread.join(timeout)

    def send(self, task: Any, *, on_start: Task | None = None) -> None:
        """Queue a function, from any thread; ``on_start`` is called when its turn comes."""
        self._queue.put((task, on_start))

    def _run(self) -> None:
        try:
            self._draw()
            with self.client.atomic():
                self._build()
            self._show()
            while self._take():
                self._show()
        except Exception as error:
            if not is_disconnect(error):
                _log.error("dh2sim: a page was closed. %s", printable(bug_text(error)))
                self._disconnect()

    def _take(self) -> bool:
        """Work through the queue, or advance what moves; return False once the page is closed."""
        try:
            task = self._queue.get(timeout=_TICK if self.motion.is_moving else None)
            while task is not None and not self._closed.is_set():
                self._do(*task)
                task = self._queue.get_nowait()
            return False
        except queue.Empty:
            self._do(self._tick, None)
            return True

    def _tick(self) -> None:
        pending, self._pending = self._pending, {}
        if pending:
            self.motion.move(pending)
        self._gap = self.motion.tick()

    def _do(self, task: Task, on_start: Task | None) -> None:
        if on_start is not None:
            on_start()
        try:
            task()
        except Dh2simError as error:
            self._notice = str(error)
        except Exception as error:  # the page goes on
            self._notice = bug_text(error)

    def _build(self) -> None:
        """Add the widgets."""
        gui, model = self.client.gui, self._model
        closures = listed(f"{closure.name} ({closure.type.value})" for closure in model.tree.closures)
        about = f"{model.name}, closed by {closures}" if closures else f"{model.name}, without closed loops"
        gui.add_html(markup.note(markup.text(about), name="mechanism"))
        self._sliders = [self._slider(place, k) for place, k in enumerate(self.motion.driven)]
        choice = gui.add_button_group("Go to", tuple(dict.fromkeys(("home", *model.spec.configurations))))
        on_click(choice, self.send, lambda: partial(self._go, str(choice.value)))
        modes = (_MANUAL, _PHYSICS) if self._replay is None else (_MANUAL, _PHYSICS, _RECORDING)
        self._mode = bind(gui.add_dropdown("Mode", modes), self.send, lambda mode: partial(self._start, mode))
        if self._replay is not None:
            with gui.add_folder("Recording"):
                self._build_recording(self._replay)
        bind(gui.add_checkbox("DH frames", self._frames), self.send, lambda on: partial(self._show_frames, bool(on)))
        frames = tuple(name for name in model.tree.frames if not name.rpartition("/")[2].startswith("link_"))
        bind(
            gui.add_dropdown("Frame", frames, initial_value=self._frame), self.send, lambda f: partial(self._read, f)
        )
        self._readout, self._passive = gui.add_html(""), gui.add_html("")
        on_click(gui.add_button("Save this page (.html)"), self.send, lambda: self._save)
        gui.add_html(markup.note(markup.text(NOT_HERE), name="not-here"))
        self._banner = gui.add_html("")

    def _build_recording(self, replay: Replay) -> None:
        gui = self.client.gui
        self._rollout = gui.add_dropdown("Rollout", [str(number) for number in replay.rollouts])
        self._speed = gui.add_dropdown("Speed", _SPEEDS, initial_value="1")
        time = gui.add_slider("Time [%]", min=0.0, max=100.0, step=0.1, initial_value=0.0)
        self._pause, step = gui.add_button("Pause"), gui.add_button("Step", hint="The recording's next time")
        self._status = gui.add_html("")
        bind(self._rollout, self.send, lambda _number: partial(self._start, _RECORDING))
        bind(self._speed, self.send, lambda _factor: self._set_speed)
        self._time = bind(time, self.send, lambda percent: partial(self._seek, percent / 100.0))
        on_click(self._pause, self.send, lambda: self._toggle_pause)
        on_click(step, self.send, lambda: self.motion.step)
        if replay.note:
            gui.add_html(markup.note(markup.text(replay.note)))
        self.send(partial(self._start, _RECORDING))

    def _slider(self, place: int, joint: int) -> Bound[float]:
        model = self._model.moving_joints[joint]
        lower, upper = model.travel
        value = _displayed(model, float(self.motion.q[joint]))
        slider = self.client.gui.add_slider(
            f"{model.name} [{'°' if model.type.turns else 'm'}]",
            min=min(_displayed(model, lower), value),
            max=max(_displayed(model, upper), value),
            step=0.01 if model.type.turns else 0.0001,
            initial_value=value,
            hint=f"{model.type.value}, driven",
        )

        def moved(number: float) -> Task:
            return partial(self._move, place, math.radians(number) if model.type.turns else number)

        return bind(slider, self.send, moved)

    def _move(self, place: int, value: float) -> None:
        self._notice = ""
        self._pending[place] = value

    def _go(self, name: str) -> None:
        if self.motion.recording is not None:
            self._start(_MANUAL)
        self._notice = ""
        self.motion.place(named_configuration(self._model.spec, name))

    def _start(self, mode: str) -> None:
        self._notice, self._path = "", None
        if mode == _PHYSICS:
            self.motion.simulate()
        elif mode == _RECORDING and self._replay is not None:
            self.motion.play(self._replay, int(self._rollout.value))
            self._set_speed()
            self._trace()
        else:
            self.motion.stop()

    def _trace(self) -> None:
        """Let the path of the chosen frame be drawn."""
        if self._replay is not None and self.motion.recording is not None:
            self._path = frame_path(self._model, self._replay.positions(int(self._rollout.value)), self._frame)

    def _set_speed(self) -> None:
        if self.motion.recording is not None:
            self.motion.recording.set_speed(float(self._speed.value))

    def _seek(self, progress: float) -> None:
        if self.motion.recording is not None:
            self.motion.recording.seek(progress)

    def _toggle_pause(self) -> None:
        self.motion.paused = not self.motion.paused

    def _show_frames(self, on: bool) -> None:
        self._frames = on

    def _read(self, frame: str) -> None:
        self._frame = frame
        self._trace()

    def _save(self) -> None:
        content = mechanism_page_html(self._model, self.motion.q).encode()
        self.client.send_file_download(f"{self._model.name}.html", content, save_immediately=True)

    def _draw(self) -> None:
        with self.client.atomic():
            scene = mechanism_scene(self._model, self.motion.q, frames=self._frames)
            self._painter.draw(scene if self._path is None else {**scene, PATH: self._path})
        self.client.flush()

    def _show(self) -> None:
        self._draw()
        q, joints = self.motion.q, self._model.moving_joints
        with self.client.atomic():
            for slider, k, value in zip(self._sliders, self.motion.driven, self.motion.wanted, strict=True):
                slider.show(_displayed(joints[k], value))
            T = placed(body_poses(self._model.tree, q), self._model.tree.frame(self._frame))
            xyz = " ".join(f"{round(x, 6) + 0.0:.6f}" for x in T[:3, 3].tolist())
            rpy = " ".join(f"{round(math.degrees(x), 4) + 0.0:.4f}" for x in rpy_from_rotation(T[:3, :3]))
            pose = [("xyz [m]", xyz), ("rpy [°]", rpy)]
            if self._gap is not None and self.motion.is_moving:
                pose.append(("loops open by", f"{1000 * self._gap:.3f} mm"))
            self._show_mode()
            self._readout.content = markup.lines(pose, name="readout")
            passive = [k for k in range(len(joints)) if k not in self.motion.driven]
            rows = [(markup.text(joints[k].name), _text(joints[k], float(q[k]))) for k in passive]
            self._passive.content = markup.lines(rows, name="passive")
            self._banner.content = markup.banner(markup.lines_of_text(self._notice), error=True, name="notice")
        self.client.flush()

    def _show_mode(self) -> None:
        recording = self.motion.recording
        self._mode.show(_RECORDING if recording is not None else _PHYSICS if self.motion.is_moving else _MANUAL)
        if self._replay is None:
            return
        self._time.show(0.0 if recording is None else round(100.0 * recording.progress, 1))
        self._status.content = markup.note(markup.text(recording.status if recording else ""), name="recording")
        label = "Play" if self.motion.paused else "Pause"
        if label != self._pause.label:
            self._pause.label = label


def _displayed(joint: JointModel, value: float) -> float:
    return round(math.degrees(value), 2) + 0.0 if joint.type.turns else round(value, 4) + 0.0


def _text(joint: JointModel, value: float) -> str:
    return f"{round(math.degrees(value), 4) + 0.0:.4f}°" if joint.type.turns else f"{round(value, 6) + 0.0:.6f} m"
