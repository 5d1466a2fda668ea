"""What windows show, as values without Qt."""
