"""Evidence for the program: accuracy, solver, soak, stability, timing, report rates. Only commands import it."""
