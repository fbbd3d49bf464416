"""Tables fitted to measurements of a real robot: which numbers they tell, how well, and what they leave open."""
