"""What the user wrote: robot files read into a RobotSpec, and the robots that come with dh2sim."""
