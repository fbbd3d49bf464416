"""What a state looks like: items derived from it, and the painter that sends them to a page."""
