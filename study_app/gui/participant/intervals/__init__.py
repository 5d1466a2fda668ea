"""The pages of trials with several intervals: the current interval, the question and the feedback."""
