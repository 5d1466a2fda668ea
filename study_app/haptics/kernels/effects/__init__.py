"""Contributions to the force, one file each: a kernel, with equation and source in its docstring."""
