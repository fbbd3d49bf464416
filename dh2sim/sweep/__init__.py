"""What each of many designs can do: measures of robots without simulation, in a table."""
