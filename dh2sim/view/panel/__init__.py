"""What stands beside the scene: widgets that send events and show the state, each tab in a file of its own."""
