"""Devices without hardware: a simulated hand and handle."""
