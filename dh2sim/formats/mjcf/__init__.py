"""MJCF files to serial robots; MuJoCo parses them."""
