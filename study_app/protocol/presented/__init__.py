"""What the trials of a study present: their tracks, levels, and intervals."""
