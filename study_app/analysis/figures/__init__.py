"""Figures of answers, recognition, delays and movement."""
