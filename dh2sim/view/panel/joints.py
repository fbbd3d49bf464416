"""The Joints tab: a slider for each joint, named configurations, and keys that move joints."""

from __future__ import annotations

import math
import secrets
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal

from dh2sim.robot.units import AngleUnit
from dh2sim.view.events import Event, MoveJoint, Nudge, RandomConfiguration, SetConfiguration, ShowAngles
from dh2sim.view.frame_readout import readout_of
from dh2sim.view.panel import markup
from dh2sim.view.panel.bound import Bound, Send, bind, on_click
from dh2sim.view.panel.pose import frame_title, pose_lines
from dh2sim.view.state import ViewState, configurations

if TYPE_CHECKING:
    import viser

    from dh2sim.model.robot_model import JointModel


@dataclass(frozen=True, slots=True, kw_only=True)
class KeyPair:
    """The keys of a joint as a user names them."""

    down: str
    up: str


KEYS: Final = tuple(
    KeyPair(down=down, up=up)
    for down, up in (("1", "3"), ("4", "6"), ("7", "9"), ("R", "Y"), ("F", "H"), ("V", "N"), ("G", "Shift+G"))
)
"""Of joints 1 to 7: rows of the numeric keypad, then of letters."""


ARROW_KEYS_FOR_SLIDERS: Final = """<img hidden src="data:," onerror="
if (!document.body.dataset.dh2sim) {
    document.body.dataset.dh2sim = 'arrows';
    document.body.addEventListener('keydown', (event) => {
        if (event.key.startsWith('Arrow') && event.target.closest('[role=slider]')) event.stopPropagation();
    });
}">"""
"""Keeps arrow keys that move a slider from also turning viser's camera."""


def add_keys(client: viser.ClientHandle, send: Send) -> None:
    """Make a page listen to the keys; viser ignores them while the user types into a field."""
    client.gui.add_html(ARROW_KEYS_FOR_SLIDERS)
    for joint, pair in enumerate(KEYS):
        _add(client, send, pair.down, joint, -1)
        _add(client, send, pair.up, joint, 1)


def _add(client: viser.ClientHandle, send: Send, key: str, joint: int, direction: Literal[-1, 1]) -> None:
    *modifier, letter = key.split("+")
    command = client.gui.add_command(
        f"Joint {joint + 1}: {'increase' if direction > 0 else 'decrease'}",
        description="3 degrees, or 1 % of a prismatic joint's travel",
        hotkey=letter,  # type: ignore[arg-type]
        modifier="shift" if modifier else None,
    )

    async def pressed(_press: Any) -> None:
        send(Nudge(joint=joint, direction=direction))

    command.on_trigger(pressed)


_LAST: Final = 1e9
"""Order of the widgets below the sliders, which are replaced now and then."""
_DIGITS: Final = {"deg": 2, "rad": 4, "m": 4}
"""Decimals of a coordinate."""


class JointsTab:
    """Sliders, which are replaced when limits, units or joints change."""

    def __init__(self, client: viser.ClientHandle, tab: viser.GuiTabHandle, send: Send, state: ViewState) -> None:
        """Add the widgets to a tab, viser's current container."""
        self._gui = client.gui
        self._send = send
        self._sliders: list[Bound[float]] = []
        self._built: object = None
        self._units = bind(
            self._gui.add_dropdown("Angles in", ("deg", "rad"), initial_value=state.angle.value),
            send,
            lambda unit: ShowAngles(unit=AngleUnit(unit)),
        )
        self._tab = tab
        self._readout = self._gui.add_html("", order=_LAST)
        self._choice: Any = None

    def show(self, state: ViewState) -> None:
        """Show a state."""
        self._units.show(state.angle.value)
        layout = _layout(state)
        if layout != self._built:
            self._built = layout
            self._build(state)
        for slider, joint, value in zip(self._sliders, state.model.moving_joints, state.commanded, strict=True):
            slider.show(_displayed(joint, value, state.angle))
        caption = markup.note(frame_title(state))
        self._readout.content = caption + markup.lines(pose_lines(readout_of(state), state.angle), name="readout")

    def _build(self, state: ViewState) -> None:
        for widget in [*(slider.handle for slider in self._sliders), *([self._choice] if self._choice else [])]:
            widget.remove()
        with self._tab:
            self._sliders = [
                self._slider(i, joint, state.commanded[i], state.angle)
                for i, joint in enumerate(state.model.moving_joints)
            ]
            self._choice = self._gui.add_button_group("Go to", (*configurations(state.model), "random"))
        on_click(self._choice, self._send, lambda: _configuration(str(self._choice.value)))

    def _slider(self, index: int, joint: JointModel, value: float, angle: AngleUnit) -> Bound[float]:
        lower, upper = joint.travel
        unit = _unit(joint, angle)
        slider = self._gui.add_slider(
            f"{joint.name} [{_symbol(unit)}]",
            min=_displayed(joint, lower, angle),
            max=_displayed(joint, upper, angle),
            step=10.0 ** -_DIGITS[unit],
            initial_value=_displayed(joint, value, angle),
            hint=_hint(index, joint),
        )

        def event(number: float) -> Event:
            return MoveJoint(joint=index, value=math.radians(number) if unit == "deg" else number)

        return bind(slider, self._send, event)


def _configuration(name: str) -> Event:
    return RandomConfiguration(seed=secrets.randbits(32)) if name == "random" else SetConfiguration(name=name)


def _layout(state: ViewState) -> object:
    """Return everything that the sliders depend on besides joint coordinates."""
    joints = [(joint.name, joint.type, joint.travel) for joint in state.model.moving_joints]
    return joints, state.angle, tuple(configurations(state.model))


def _unit(joint: JointModel, angle: AngleUnit) -> str:
    return angle.value if joint.type.turns else "m"


def _symbol(unit: str) -> str:
    return "°" if unit == "deg" else unit


def _displayed(joint: JointModel, value: float, angle: AngleUnit) -> float:
    unit = _unit(joint, angle)
    number = round(math.degrees(value) if unit == "deg" else value, _DIGITS[unit])
    return number + 0.0


def _hint(index: int, joint: JointModel) -> str:
    keys = f"; keys {KEYS[index].down} and {KEYS[index].up}" if index < len(KEYS) else ""
    limits = "no limits" if joint.position_range is None else "limits from the robot file"
    if "position" in joint.assumed:
        limits = "assumed limits: the robot file has none"
    return f"{joint.type.value}, {limits}{keys}"
