"""Error rates of the report's verdicts: simulated studies evaluated by the report's own tests."""
