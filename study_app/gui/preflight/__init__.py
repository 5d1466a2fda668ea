"""Pre-flight: the checks before a session, and the decision to begin."""
