"""Clocks and thread priorities of each operating system."""
