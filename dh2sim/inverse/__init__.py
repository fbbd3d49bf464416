"""Inverse kinematics: the configurations that reach a pose, every branch of them."""
