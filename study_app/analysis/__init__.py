"""Analysis of results folders, never of a live session."""
