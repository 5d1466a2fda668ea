"""Commands that print evidence: accuracy, solver, soak, stability, timing."""
