"""Does it hold: every engine against the table itself."""
