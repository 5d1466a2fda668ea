"""Orders of conditions and trials, and the schedule."""
