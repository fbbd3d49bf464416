"""The panel beside the scene: widgets that send events and show the state."""
