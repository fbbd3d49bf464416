"""Tests of dh2sim/calibrate."""
