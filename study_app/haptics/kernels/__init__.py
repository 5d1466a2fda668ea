"""The compiled force model and loop.

Reading order: compiled; c_functions, plant, vector; known_force; effects, estimators, sample_validation; passivity,
regions; safety; tick; loop.
"""
