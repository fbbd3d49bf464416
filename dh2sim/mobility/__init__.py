"""Degrees of freedom of a mechanism, counted and true: screws, rank of its loops, motion along them."""
