"""What windows show of one session."""
