"""Understanding results folders; never a live session."""
