"""Figures of people, answers, levels, recognition, delays and movement, and those of the first page."""
