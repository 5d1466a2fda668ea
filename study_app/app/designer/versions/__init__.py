"""Versions in the designer: what was run, and how the study differs from it."""
