"""Before a study: how many participants it needs, how precise thresholds will be, and its preregistration."""
