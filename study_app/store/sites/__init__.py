"""Merged studies: the results folders of several sites of one protocol, kept as they are next to each other."""
