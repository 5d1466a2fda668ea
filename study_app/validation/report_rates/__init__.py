"""How often the report's verdicts are wrong: simulated studies through the report's own tests."""
