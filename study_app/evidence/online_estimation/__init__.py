"""The evidence of estimation while it runs: closed loops in which estimates are applied."""
