"""Equivalence: two one-sided tests, without normality too, and their power."""
