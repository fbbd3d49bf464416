"""URDF texts to serial robots."""
