"""Controllers that come with dh2sim, and how others are found."""
