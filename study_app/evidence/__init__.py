"""Evidence for the program: accuracy, solver, soak, stability, timing, report rates. Only commands import it.

``table`` is the form of all evidence: read it first, then ``cost`` (time per tick) and ``accuracy.comparison`` (error
of forces) as examples.
"""
