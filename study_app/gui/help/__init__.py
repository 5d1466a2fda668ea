"""The documentation inside the program, without a network."""
