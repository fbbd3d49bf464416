"""A frame assignment in the words of a textbook."""
