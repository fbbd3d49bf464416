"""What a state looks like: the items of its scene, and the painter that sends them to a page."""
