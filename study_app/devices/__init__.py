"""Haptic devices, input devices and simulated devices: a driver each, behind one contract."""
