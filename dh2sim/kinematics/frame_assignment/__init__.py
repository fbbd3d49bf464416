"""From joint axes to Denavit-Hartenberg frames: every case, by rules that are stated where they are applied."""
