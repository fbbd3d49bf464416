"""Axes files: joint axes to which frames are yet to be assigned."""
