"""The browser viewer: one immutable state, a scene derived from it, widgets that only send events."""

from dh2sim.extras import require_extra

require_extra("view", "viser", "websockets", "msgspec", what="the viewer")
