"""What moves a robot on a page: simulation, recording, inverse kinematics, the mouse."""
