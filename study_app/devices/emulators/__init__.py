"""Emulated devices: the program's own drivers in front of emulated hardware. No driver imports them."""
