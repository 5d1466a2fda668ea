"""The contributions to the force, one file each: equation and source in the docstring, the kernel under it."""
