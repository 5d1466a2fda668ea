"""Accuracy of the velocity estimators: on imposed motions, and in closed loops with a hand."""
