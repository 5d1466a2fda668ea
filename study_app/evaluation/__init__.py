"""The force model under test: references, cost, stability."""
