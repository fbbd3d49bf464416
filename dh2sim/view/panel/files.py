"""Files: a robot to open; and to take home the robot file as edited, and the models made of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dh2sim.export.render import Format
from dh2sim.view.panel.bound import Send, on_click
from dh2sim.view.panel.uploads import UploadButtons

if TYPE_CHECKING:
    import viser

    from dh2sim.view.robot_files import RobotFiles


def add_files(client: viser.ClientHandle, send: Send, uploads: UploadButtons, files: RobotFiles) -> None:
    """Add the buttons to viser's current container."""
    gui = client.gui
    uploads.add("Open a robot file", files.open)
    checked = "Compared with the table before it is handed out"
    on_click(gui.add_button("Save robot file"), send, lambda: files.save)
    on_click(gui.add_button("Save URDF", hint=checked), send, lambda: lambda: files.export(Format.URDF))
    on_click(gui.add_button("Save MJCF", hint=checked), send, lambda: lambda: files.export(Format.MJCF))
    on_click(gui.add_button("Back to the opened file", hint="Forgets all edits"), send, lambda: files.back)
