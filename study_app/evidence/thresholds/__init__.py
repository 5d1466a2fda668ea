"""Whether thresholds are recovered: observers with a planted threshold, by methods and analysis, and by the program."""
