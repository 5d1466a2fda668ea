"""Psychophysics without a study: delivered levels, psychometric functions, adaptive methods. Numpy only."""
