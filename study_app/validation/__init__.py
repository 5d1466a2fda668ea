"""Evidence for the program: accuracy, solver, soak, stability, timing, report rates. Commands alone import it."""
