"""Psychophysics without a study: what was delivered to a hand. Numpy only."""
