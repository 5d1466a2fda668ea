"""Psychophysics without a study: delivered levels, psychometric functions, adaptive methods. Numpy only.

Read ``families`` (the functions), ``grid`` (the posterior) and ``adaptive`` (the choice of the next level) first.

Reading order: delivery, families; detection, grid; people, person_fit; adaptive.

Public modules: adaptive, delivery, detection, families, grid, people, person_fit.
"""
