"""Fits of a liquid's parameters to measured motion and force, or to a flow curve.

Reading order: measured_force, parameters; search; estimates; fit; figures; preset.
"""
