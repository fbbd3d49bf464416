"""Scenes as one HTML page: viser's own page with what viser would have sent to it inside.

viser's page is one file without references to others; a recording of what a server sends goes into it as base64, and
is played back by the same code that draws for a server.
"""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from dh2sim.view.items import Scene
from dh2sim.view.page_export_extent import Extent
from dh2sim.view.painter import Painter
from dh2sim.view.quiet_server import server_for_nobody

if TYPE_CHECKING:
    import viser

_FIELD: Final = math.radians(40.0)
"""How wide the camera sees, up and down."""
_FROM: Final = (1.0, -1.25, 0.7)
"""Where the camera is, seen from the middle."""
_ROOM: Final = 1.05
"""Around the extent."""
_LAST: Final = 1.0 / 30.0
"""s: how long the end of an animation stands, before it begins again."""
_TITLE: Final = "<title>Viser</title>"


def page_html(moments: Sequence[tuple[float, Scene]], *, title: str, extent: Extent) -> str:
    """Return a page that needs nothing but a browser.

    Args:
        moments: Times, s, ascending from 0, and what is seen then; a single one stands still, more are played again
            and again, with a time slider.
        title: Of the page.
        extent: What the camera looks at first.
    """
    with server_for_nobody() as server:
        _look_at(server, extent)
        _add_ground(server, extent)
        painter = Painter(server.scene)
        painter.draw(moments[0][1])
        recording = server.get_scene_serializer()
        now = moments[0][0]
        for time, scene in moments[1:]:
            recording.insert_sleep(time - now)
            painter.draw(scene)
            now = time
        if len(moments) > 1:
            recording.insert_sleep(_LAST)
        page = recording.as_html()
    return page.replace(_TITLE, f"<title>{html.escape(title)}</title>", 1)


def _look_at(server: viser.ViserServer, extent: Extent) -> None:
    distance = _ROOM * extent.radius / math.sin(0.5 * _FIELD)
    direction = np.array(_FROM) / np.linalg.norm(_FROM)
    camera = server.initial_camera
    camera.look_at = extent.centre
    camera.position = np.array(extent.centre) + distance * direction
    camera.fov = _FIELD
    camera.near, camera.far = 0.01 * distance, 100.0 * distance


def _add_ground(server: viser.ViserServer, extent: Extent) -> None:
    """Add a grid of a round number of metres on the ground, below the middle of what is seen."""
    cell = _round_length(extent.radius / 4.0)
    side = 20.0 * cell
    x, y = (5.0 * cell * round(value / (5.0 * cell)) for value in extent.centre[:2])
    server.scene.add_grid(
        "/ground", width=side, height=side, cell_size=cell, section_size=5.0 * cell, position=(x, y, 0.0)
    )


def _round_length(length: float) -> float:
    """Return 1, 2 or 5 times a power of ten, at most ``length``."""
    unit = 10.0 ** math.floor(math.log10(length))
    return max(step for step in (1.0, 2.0, 5.0) if step * unit <= length) * unit
