"""Engines that read exported files: poses, Jacobians and dynamics, straight from a file on disk."""
