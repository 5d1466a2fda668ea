"""The documentation in the program: its pages, without a network."""
