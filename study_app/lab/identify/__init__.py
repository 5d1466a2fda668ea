"""Parameters of a liquid from measured motion and force.

Reading order: measured_force, parameters; search; estimates; fit; figures; preset.
"""
