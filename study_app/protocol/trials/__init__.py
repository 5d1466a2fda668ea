"""Tasks of a trial."""
