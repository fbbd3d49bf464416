"""A robot as straight-line code: pose, Jacobian and inverse dynamics, in several languages."""
