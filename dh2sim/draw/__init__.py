"""Pictures of robots and runs: rendered by MuJoCo, plotted by matplotlib."""
