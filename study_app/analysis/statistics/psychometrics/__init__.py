"""Psychometric functions of pooled answers: fit, test for a rise, detection threshold."""
