"""Blocks of levels: thresholds, exponents, sensitivities and settings of participants and groups."""
