"""Evidence for the program: accuracy, solver, soak, stability, timing, report rates. Only commands import it.

``table`` is the form of all evidence: read it first, then ``cost`` (time per tick) and ``accuracy.comparison`` (error
of forces) as examples.

Reading order: appraisal, computer, cost, reference_model, table, thesis_figures; appraisal_measurement,
reference_solutions, report_rates, soak, thresholds, timing; cfd, outlets, stability; expected_error; accuracy.

Public modules: accuracy, appraisal, cfd, computer, cost, expected_error, outlets, reference_solutions, report_rates,
soak, stability, table, thesis_figures, thresholds, timing.
"""
