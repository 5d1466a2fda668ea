"""Psychophysics without a study: delivered levels, psychometric functions, adaptive methods. Numpy only.

Read ``families`` (the functions), ``grid`` (the posterior) and ``adaptive`` (the choice of the next level) first.
"""
