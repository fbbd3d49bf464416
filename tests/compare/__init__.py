"""Comparing robots, grading tables, making exercises."""
