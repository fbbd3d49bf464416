"""What a robot is made of: shapes, mass, inertia, limits and actuators; the one value that every writer reads."""
