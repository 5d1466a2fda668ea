"""Pre-flight: the checks before a session, and whether to begin."""
