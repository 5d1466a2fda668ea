"""Trials: their designs, stimuli, methods and tasks, and what their intervals present."""
