"""The liquid lab without its windows: adjustable parameters, two settings for comparison, and their forces.

``live`` has device and servo and presents edited scenes; ``ab_comparison`` has the two settings, ``parameters`` the
parameters that can be adjusted; read these first. ``identify`` fits liquids to files of measurements.

Reading order: parameters, programmed_paths; ab_comparison, identify; presets, shadow; live.

Public modules: ab_comparison, identify.fit, identify.measured_force, identify.parameters, identify.preset, live,
parameters, presets, programmed_paths, shadow.
"""
