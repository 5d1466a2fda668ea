"""The compiled force model and loop."""
