"""Contributions to the force, one file each: a kernel, with equation and source in its docstring.

Reading order: added_mass, buoyancy, current, drag, non_newtonian, surface; history, unsteady_drag, wake; local_wake.
"""
