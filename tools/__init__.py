"""Tools for those who write the documentation; run from a checkout, not installed."""
