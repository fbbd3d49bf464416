"""Whether two robots are the same mechanism, where they differ, and which misreading explains it; grading."""
