"""The browser viewer: one immutable state, a scene derived from it, widgets that only send events."""
