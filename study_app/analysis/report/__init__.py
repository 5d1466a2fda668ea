"""The report: what was found, in words, tables and figures, with everything that is needed to doubt it."""
