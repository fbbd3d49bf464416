"""Line drawings of a robot: the kinematic diagram of textbooks, its frames, and the classic stick plot."""
