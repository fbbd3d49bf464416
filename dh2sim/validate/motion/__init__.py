"""Checks of the physics of an exported model."""
