"""What a Denavit-Hartenberg table means: the chain, its poses and its Jacobians."""
