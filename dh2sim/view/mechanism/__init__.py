"""A page for a mechanism: its driven joints are moved, and the passive ones follow through the closed loops."""
