"""The liquid lab without its windows: adjustable parameters, two settings side by side, and their forces.

``live`` is device and servo with a scene that is edited, ``ab_comparison`` the two settings, ``parameters`` what can be
adjusted; read these first. ``identify`` fits liquids to files of measurements.

Reading order: parameters, programmed_paths; ab_comparison, identify; presets, shadow; live.

Public modules: ab_comparison, identify.fit, identify.measured_force, identify.parameters, identify.preset, live,
parameters, presets, programmed_paths, shadow.
"""
