"""How each engine reads the files that were written: poses, Jacobians and dynamics, straight from a file on disk."""
