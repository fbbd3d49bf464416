"""Trajectories: paths through waypoints, and when to be where on them so that limits hold."""
