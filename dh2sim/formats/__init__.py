"""How others read a robot: RobotModel -> URDF text, MJCF text, scene text. Nothing here touches a file."""
