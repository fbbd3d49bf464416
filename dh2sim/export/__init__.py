"""Files: written whole or not at all, verified before they are put in place."""
