"""Devices: the haptic and input devices of this machine, and their diagnosis."""
