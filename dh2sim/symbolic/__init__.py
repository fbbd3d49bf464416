"""The table in symbols: exact expressions of poses, Jacobians and dynamics, and code printed from them."""
