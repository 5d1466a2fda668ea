"""Figures of blocks with a design: answers over levels, tracks, Weber fractions, settings."""
