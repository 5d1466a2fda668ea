"""Whether thresholds are recovered: observers with a known threshold, by methods and analysis, and by the program."""
