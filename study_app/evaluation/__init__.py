"""The force model under test: what accuracy costs in time, where it stays stable, and what a liquid is."""
