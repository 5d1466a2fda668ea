"""Questionnaires, rating scales and their simulated answers."""
