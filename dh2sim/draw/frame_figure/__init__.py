"""A frame assignment as a picture of axes, frames and lengths."""
