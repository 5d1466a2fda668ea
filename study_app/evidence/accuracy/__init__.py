"""Accuracy over computation time: models compared with independently computed references."""
