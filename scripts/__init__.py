"""What keeps the project: checks, measurements, and what makes its pages and pictures."""
