"""Versions in the designer: what was run, what was saved, and how the study differs from it."""
