"""RobotSpecs to robot files."""
