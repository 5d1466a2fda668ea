"""Haptic devices, input devices and simulated devices: one driver each, with a common interface."""
