"""Psychophysics that does not depend on a study: delivered levels, psychometric functions, adaptive methods.

The package only uses numpy.

Read ``families`` (the functions), ``grid`` (the posterior) and ``adaptive`` (the choice of the next level) first.

Reading order: delivery, families; detection, grid; people, person_fit; adaptive.

Public modules: adaptive, delivery, detection, families, grid, people, person_fit.
"""
