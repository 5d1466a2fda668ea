"""Pages of trials of intervals: where in the trial one is, the one question, and feedback."""
