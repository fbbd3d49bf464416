"""Files to take home: the robot file as edited, and the models made of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from dh2sim.export.render import Format
from dh2sim.view.panel.bound import Send, on_click

if TYPE_CHECKING:
    import viser


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FileActions:
    """What the buttons do."""

    save: Callable[[], None]
    """Hands out the robot file."""
    export: Callable[[Format], None]
    """Hands out a model."""
    back: Callable[[], None]
    """Returns to the robot file that was opened."""


def add_files(client: viser.ClientHandle, send: Send, files: FileActions) -> None:
    """Add the buttons to viser's current container."""
    gui = client.gui
    checked = "Compared with the table before it is handed out"
    on_click(gui.add_button("Save robot file"), send, lambda: files.save)
    on_click(gui.add_button("Save URDF", hint=checked), send, lambda: lambda: files.export(Format.URDF))
    on_click(gui.add_button("Save MJCF", hint=checked), send, lambda: lambda: files.export(Format.MJCF))
    on_click(gui.add_button("Back to the opened file", hint="Forgets all edits"), send, lambda: files.back)
